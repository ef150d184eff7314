"""How much a thing holds: the elements of all containers that hang from it, so that nothing grows unseen."""

import gc
from collections import deque
from types import BuiltinFunctionType, FunctionType, ModuleType, TracebackType
from typing import Any, Final, NamedTuple

import canopen
import numpy as np

_ATOMS: Final = (int, float, str, bytes)
_NOT_PART: Final = (*_ATOMS, type, ModuleType, BuiltinFunctionType, TracebackType, canopen.ObjectDictionary)
_CONTAINERS: Final = (list, dict, set, deque, bytearray)


class Footprint(NamedTuple):
    """What was found.

    Attributes:
        elements: Of all containers together; the bytes of buffers count as elements.
        largest: Of the largest container.
    """

    elements: int
    largest: int


def footprint(root: object, *, without: tuple[type, ...] = ()) -> Footprint:
    """What hangs from an object: its attributes, what closures hold, and so on; not modules, types or the EDS.

    Args:
        root: The object.
        without: Types of objects to stop at.
    """
    not_part = _NOT_PART + without
    seen: set[int] = set()
    waiting: list[Any] = [root]
    elements = largest = 0
    while waiting:
        each = waiting.pop()
        if isinstance(each, not_part) or id(each) in seen:
            continue
        seen.add(id(each))
        if isinstance(each, _CONTAINERS):
            elements += len(each)
            largest = max(largest, len(each))
        if isinstance(each, FunctionType):  # its globals are the module's
            waiting += [*(each.__closure__ or ()), *(each.__defaults__ or ())]
        elif not isinstance(each, np.ndarray):
            waiting += gc.get_referents(each)
    return Footprint(elements, largest)
