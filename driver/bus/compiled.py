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

_numba: Final[Any] = numba  # it has no types
Kernel = Callable[..., Any]  # numba gives no types, and the arguments are records

_CONFIG: Final[Any] = numba.config  # its members are made from the environment
_OPTIONS: Final[dict[str, Any]] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
_HOUSE: Final = Path(__file__).resolve().parent


def compiled(function: Kernel) -> Kernel:
    """The function as machine code, made when it is bound or called first; others may run Python meanwhile."""
    folder = _cache_folder()
    if folder is None:
        return cast("Kernel", _numba.njit(**_OPTIONS)(function))
    found = _CONFIG.CACHE_DIR
    _CONFIG.CACHE_DIR = str(folder)  # read when the dispatcher is made, and only then
    try:
        return cast("Kernel", _numba.njit(cache=True, **_OPTIONS)(function))
    finally:
        _CONFIG.CACHE_DIR = found


def bind(kernel: Kernel, *records: Any, scalars: tuple[str, ...] = ()) -> Callable[..., int]:  # noqa: ANN401
    """A kernel with its records, compiled now; called with its scalars it costs a quarter of numba's own call.

    Args:
        kernel: The kernel.
        records: Its first arguments, arrays of records; nobody checks their types at a call any more.
        scalars: Names of numba's types of the arguments that follow.
    """
    types = (*(_numba.typeof(each) for each in records), *(getattr(_numba.types, name) for name in scalars))
    return partial(kernel.compile(types), *records)  # type: ignore[attr-defined]  # numba's dispatcher has it


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
