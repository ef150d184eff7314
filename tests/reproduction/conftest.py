"""One `torquerig reproduce` for all tests, with two laws just added: the one of docs/laws.md, and a bad one."""

import contextlib
import io
import json
import re
import sys
import textwrap
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from torquerig.cli import main
from torquerig.control import laws

DOCUMENT = Path(__file__).parents[2] / "docs" / "laws.md"
GREEDY_LAW = """
    from dataclasses import dataclass
    from typing import ClassVar

    from torquerig.control.law import Gains, Law, Published


    @dataclass(frozen=True, slots=True)
    class Greedy(Law):
        name: ClassVar[str] = "greedy"
        gains: ClassVar = {2: Gains(9e9, 0.0)}
        published: ClassVar = {2: Published(1.0, 0.1, "a paper")}

        def torque(self, state, desired):
            return self.model.distribute(state.position, self.kp * (desired.position - state.position))
"""
"""It asks for far more than any limit allows, and has a result that is not the thesis'."""


class Reproduced(NamedTuple):
    """What a reproduction left: its exit code, its folder, what it printed, and that as JSON."""

    code: int
    place: Path
    printed: str
    plants: dict[str, Any]

    def runs(self, plant: str) -> dict[tuple[str, int], dict[str, Any]]:
        return {(run["law"], run["motion"]): run for run in self.plants[plant]["runs"]}


@pytest.fixture(scope="session")
def reproduced(tmp_path_factory):
    folder = tmp_path_factory.mktemp("laws")
    example = re.search(r"```python\n(.*?)```", DOCUMENT.read_text(encoding="utf-8"), re.DOTALL)
    assert example is not None
    if "spring-damper" not in laws.load_laws():  # somebody may have followed the document
        (folder / "dropped_spring_damper.py").write_text(example.group(1), encoding="utf-8")
    (folder / "dropped_greedy.py").write_text(textwrap.dedent(GREEDY_LAW), encoding="utf-8")
    place = tmp_path_factory.mktemp("reproduced") / "out"
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(io.StringIO()) as printed:
        patch.setattr(laws, "__path__", [*laws.__path__, str(folder)])
        code = main(["reproduce", "--json", "--out", str(place)])
    for module in [name for name in sys.modules if name.startswith("torquerig.control.laws.dropped")]:
        del sys.modules[module]
    return Reproduced(code, place, printed.getvalue(), json.loads(printed.getvalue())["plants"])
