"""The disk cache of compiled kernels: it serves fresh code only, and doing without it is no error."""

import importlib
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import torquerig.mechanism.compiled as decorator

INNER = """
from torquerig.mechanism.compiled import compiled

@compiled
def inner_kernel(x):
    return {} * x
"""
OUTER = """
from inner_source import inner_kernel
from torquerig.mechanism.compiled import compiled

@compiled
def outer_kernel(x):
    return inner_kernel(x) + 1.0
"""
NAMES = ("inner_source", "outer_source")

Load = Callable[[Path], Any]


@pytest.fixture
def load(monkeypatch: pytest.MonkeyPatch) -> Load:
    """Imports a folder's outer kernel as a new process would: sources read anew, machine code from the disk or not."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    for name in NAMES:
        monkeypatch.delitem(sys.modules, name, raising=False)

    def import_anew(folder: Path) -> Any:
        for name in NAMES:
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        decorator._cache_folder.cache_clear()
        with monkeypatch.context() as patch:
            patch.syspath_prepend(str(folder))
            return importlib.import_module("outer_source").outer_kernel

    return import_anew


@pytest.fixture
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Path]:
    """The three places a cache may stand in; all are plain files, so that even root cannot write there."""
    blocked = {name: tmp_path / name for name in ("wish", "user")} | {"package": tmp_path / "house" / "__pycache__"}
    for place in blocked.values():
        place.parent.mkdir(exist_ok=True)
        place.touch()
    (tmp_path / "house" / "kernels.py").write_text("# what this package's kernels are made from\n")
    monkeypatch.setattr(decorator, "_HOUSE", tmp_path / "house")
    monkeypatch.setattr(decorator._CONFIG, "CACHE_DIR", str(blocked["wish"]))
    monkeypatch.setenv("XDG_CACHE_HOME", str(blocked["user"]))
    return blocked


def write(folder: Path, factor: float) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "inner_source.py").write_text(INNER.format(factor))
    (folder / "outer_source.py").write_text(OUTER)
    return folder


def from_disk(kernel: Any) -> bool:
    return list(kernel.stats.cache_hits.values()) == [1]


@pytest.mark.parametrize("name", ["wish", "package", "user"])
def test_a_later_process_loads_from_the_first_writable_place(
    name: str, tmp_path: Path, places: dict[str, Path], load: Load
) -> None:
    places[name].unlink()
    sources = write(tmp_path / "sources", 2.0)
    first, later = load(sources), load(sources)
    assert (first(1.0), from_disk(first)) == (3.0, False)
    assert (later(1.0), from_disk(later)) == (3.0, True)
    assert places[name] in Path(later.stats.cache_path).parents


def test_a_change_of_a_callee_in_another_file_is_noticed(tmp_path: Path, places: dict[str, Path], load: Load) -> None:
    places["wish"].unlink()
    sources = write(tmp_path / "sources", 2.0)
    assert load(sources)(1.0) == 3.0
    write(sources, 5.0)
    changed = load(sources)
    assert (changed(1.0), from_disk(changed)) == (6.0, False)
    write(sources, 2.0)
    back = load(sources)
    assert (back(1.0), from_disk(back)) == (3.0, True)


def test_a_change_in_the_package_itself_is_noticed(tmp_path: Path, places: dict[str, Path], load: Load) -> None:
    places["wish"].unlink()
    sources = write(tmp_path / "sources", 2.0)
    load(sources)(1.0)
    (tmp_path / "house" / "kernels.py").write_text("# changed\n")
    later = load(sources)
    later(1.0)
    assert not from_disk(later)


def test_without_a_writable_place_kernels_are_compiled_anew(
    tmp_path: Path, places: dict[str, Path], load: Load
) -> None:
    sources = write(tmp_path / "sources", 2.0)
    assert load(sources)(1.0) == 3.0
    assert load(sources)(1.0) == 3.0
    assert all(place.is_file() for place in places.values())
    assert not (sources / "__pycache__").exists()


def test_compiled_callees_from_unwatched_folders_are_refused(
    tmp_path: Path, places: dict[str, Path], load: Load, monkeypatch: pytest.MonkeyPatch
) -> None:
    places["wish"].unlink()
    elsewhere = write(tmp_path / "elsewhere", 2.0)
    here = write(tmp_path / "here", 2.0)
    (here / "inner_source.py").unlink()
    monkeypatch.syspath_prepend(str(elsewhere))
    with pytest.raises(TypeError, match="outer_kernel calls compiled code of"):
        load(here)


def test_only_a_few_folders_are_kept(tmp_path: Path) -> None:
    for age in range(30):
        folder = tmp_path / f"torquerig-{age:02d}"
        folder.mkdir()
        os.utime(folder, (age, age))
    (tmp_path / "other").mkdir()
    decorator._sweep(tmp_path / "torquerig-29")
    names = [folder.name for folder in sorted(tmp_path.iterdir())]
    assert names == ["other", *(f"torquerig-{age:02d}" for age in range(18, 30))]


def test_division_by_zero_gives_infinity() -> None:
    @decorator.compiled
    def ratio(a: float, b: float) -> float:
        return a / b

    assert ratio(1.0, 0.0) == float("inf")
