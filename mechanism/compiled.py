"""`compiled`: numba's njit with a disk cache that cannot serve stale machine code.

numba stamps a cached function with its own file alone. When a function it calls changes in another file, the old
machine code, callee included, is loaded without a word (numba issue 1833, open since 2016). Here the cache folder's
name is the digest of every source that a kernel may be made from: changed sources are another folder. Those sources
are this folder and the kernel's own; a kernel that calls compiled code of a third folder is refused at import.
The folder stands in the first writable place of: NUMBA_CACHE_DIR; `__pycache__` beside this file; the user's cache.
Without any, kernels are compiled anew in each process.
"""

import functools
import hashlib
import inspect
import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any, Final, ParamSpec, TypeVar, cast

import numba
from numpy.typing import NDArray

P = ParamSpec("P")
R = TypeVar("R")

_CONFIG: Final[Any] = numba.config  # its members are made from the environment: type checkers see none
_OPTIONS: Final[dict[str, Any]] = {"error_model": "numpy", "no_cfunc_wrapper": True}
"""No kernel is handed to C as a function pointer: an eighth of the compile time saved."""
_HOUSE: Final = Path(__file__).resolve().parent
_PREFIX: Final = "torquerig-"
_KEPT: Final = 12
"""Cache folders kept in one place: a few branches' worth. Older ones go, or every edit would leave one behind."""


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """The function as machine code, made at its first call and kept on disk for later processes.

    Division by zero gives inf or nan, as in numpy: a kernel never raises.

    Raises:
        TypeError: The function calls compiled code from a folder whose changes its cache would not notice.
    """
    own = Path(inspect.getfile(function)).resolve().parent
    _refuse_foreign_callees(function, {_HOUSE, own})
    folder = _cache_folder(own)
    if folder is not None:
        found = _CONFIG.CACHE_DIR
        _CONFIG.CACHE_DIR = str(folder)  # read when the dispatcher is made, and only then
        try:
            dispatcher: Any = numba.njit(cache=True, **_OPTIONS)(function)
        finally:
            _CONFIG.CACHE_DIR = found
        # numba falls back on its own places when this one fails, and there the trap is open again
        if _CONFIG.DISABLE_JIT or folder in Path(dispatcher.stats.cache_path).parents:
            return cast("Callable[P, R]", dispatcher)
    return cast("Callable[P, R]", numba.njit(**_OPTIONS)(function))


def entry(kernel: Callable[..., R], *arrays: NDArray[Any], scalars: tuple[str, ...] = ()) -> Callable[..., R]:
    """A kernel's machine code for arguments of some types, compiled now; a call costs a quarter of numba's own.

    Numba's call looks at the type of every argument, this one at none: arrays and scalars have to be what was told.

    Args:
        kernel: The kernel.
        arrays: Arrays of the types of its first arguments.
        scalars: Names of numba's types of the arguments that follow: "int64", "float64".
    """
    if _CONFIG.DISABLE_JIT:
        return kernel
    types = (*map(numba.typeof, arrays), *(getattr(numba.types, name) for name in scalars))
    return cast("Callable[..., R]", cast("Any", kernel).compile(types))


def bind(kernel: Callable[..., R], *arrays: NDArray[Any], scalars: tuple[str, ...] = ()) -> Callable[..., R]:
    """The same with its arrays, to be called with its scalars; whoever wants other arrays writes into these."""
    return functools.partial(entry(kernel, *arrays, scalars=scalars), *arrays)


def _refuse_foreign_callees(function: Callable[P, R], folders: set[Path]) -> None:
    """Callees by name, and by attribute of a module; what is defined further down stands in the same file."""
    for name in inspect.unwrap(function).__code__.co_names:
        value = inspect.unwrap(function).__globals__.get(name)
        if isinstance(value, ModuleType):
            ours = value.__name__.split(".")[0] == __name__.split(".")[0]
            origin = value.__file__ if ours else None
        else:
            callee = getattr(value, "py_func", None)
            origin = None if callee is None else inspect.getfile(callee)
        if origin is not None and Path(origin).resolve().parent not in folders:
            raise TypeError(
                f"{function.__qualname__} calls compiled code of {origin}: only {_HOUSE} and its own folder are watched"
            )


@functools.cache
def _cache_folder(own: Path) -> Path | None:
    """The folder for kernels of the folder `own`, made if need be; None when no place can be written."""
    try:
        name = _PREFIX + _digest(own)
    except OSError:  # no readable sources (a zip file, say): nothing to tell fresh from stale by
        return None
    cache_home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    wish = _CONFIG.CACHE_DIR and os.path.abspath(_CONFIG.CACHE_DIR)
    for place in (wish, _HOUSE / "__pycache__", os.path.join(cache_home, "torquerig")):
        if not place or not os.path.isabs(place):  # no wish; no home folder
            continue
        folder = Path(place) / name
        try:
            if not folder.is_dir():
                folder.mkdir(parents=True, exist_ok=True)
                _sweep(folder)
            tempfile.TemporaryFile(dir=folder).close()
        except OSError:
            continue
        return folder
    return None


def _digest(own: Path) -> str:
    """Digest of all sources of the two folders; versions and processors are told apart by numba."""
    digest = hashlib.sha256()
    for folder in sorted({_HOUSE, own}):
        for source in sorted(folder.glob("*.py")):
            content = source.read_bytes()
            digest.update(f"{source.name} {len(content)} ".encode() + content)
    return digest.hexdigest()[:16]


def _sweep(newest: Path) -> None:
    """Removes the oldest of the folders beside; a process that still uses one compiles again, nothing worse."""
    folders = sorted(newest.parent.glob(_PREFIX + "*"), key=lambda folder: folder.stat().st_mtime)
    for folder in folders[:-_KEPT]:
        shutil.rmtree(folder, ignore_errors=True)
