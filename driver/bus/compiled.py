"""`compiled`: numba's njit for this folder, with a disk cache that cannot serve stale machine code.

numba stamps a cached function with its own file alone; when a function that it calls changes in another file, the old
code is loaded without a word (numba issue 1833). So the cache folder's name is the digest of every file with kernels
here. It stands in `__pycache__` beside them, or where NUMBA_CACHE_DIR says; if neither can be written, kernels are
compiled anew in each process.
"""

import functools
import hashlib
import os
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final, cast

import numba

from torquerig.driver.bus.record_kernels import RecordAt

_numba: Final[Any] = numba  # it has no types
Kernel = Callable[..., Any]  # numba gives no types, and the arguments are records

_CONFIG: Final[Any] = numba.config  # its members are made from the environment
_OPTIONS: Final[dict[str, Any]] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
_HOUSE: Final = Path(__file__).resolve().parent


def compiled(function: Kernel) -> Kernel:
    """The function as machine code, made when it is bound or called first; others may run Python meanwhile."""
    return _made(function, _OPTIONS)


def brief(function: Kernel) -> Kernel:
    """As `compiled`, of what takes microseconds: Python's lock is kept.

    To let it go and take it back costs 50 ns, and another thread that gets hold of it may keep it for 5 ms.
    """
    return _made(function, _OPTIONS | {"nogil": False})


def bind(kernel: Kernel, *records: Any, scalars: tuple[str, ...] = ()) -> Callable[..., int]:  # noqa: ANN401
    """A kernel with its records, compiled now; called with its scalars it costs a sixth of numba's own call.

    Args:
        kernel: The kernel.
        records: Its first arguments, arrays of one record each, which it is given by their addresses.
        scalars: Names of numba's types of the arguments that follow.
    """
    types = (
        *(RecordAt(_numba.typeof(each).dtype) for each in records),
        *(getattr(_numba.types, name) for name in scalars),
    )
    entry = kernel.compile(types)  # type: ignore[attr-defined]  # numba's dispatcher has it
    bound = partial(entry, *(each.ctypes.data for each in records))
    bound.__dict__["records"] = records  # they must live as long
    return bound


def _made(function: Kernel, options: dict[str, Any]) -> Kernel:
    folder = _cache_folder()
    if folder is None:
        return cast("Kernel", _numba.njit(**options)(function))
    found = _CONFIG.CACHE_DIR
    _CONFIG.CACHE_DIR = str(folder)  # read when the dispatcher is made, and only then
    try:
        return cast("Kernel", _numba.njit(cache=True, **options)(function))
    finally:
        _CONFIG.CACHE_DIR = found


@functools.cache
def _cache_folder() -> Path | None:
    """The folder for machine code, made if need be; None when no place can be written."""
    digest = hashlib.sha256()
    for source in sorted(_HOUSE.glob("*kernels.py")):
        digest.update(source.read_bytes())
    for place in (_CONFIG.CACHE_DIR, _HOUSE / "__pycache__"):
        folder = Path(place) / f"torquerig-bus-{digest.hexdigest()[:16]}"
        try:
            if place and os.path.isabs(place):
                folder.mkdir(parents=True, exist_ok=True)
                tempfile.TemporaryFile(dir=folder).close()
                return folder
        except OSError:
            continue
    return None
