"""How many arithmetic operations a compiled kernel does: it is run as plain Python on numbers that count themselves."""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from types import FunctionType, SimpleNamespace
from typing import Any, Self

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, slots=True)
class Operations:
    """Operations of one call.

    Attributes:
        additions: Additions and subtractions.
        multiplications: Multiplications.
        divisions: Divisions and roots, lengths (hypot) among them.
    """

    additions: int
    multiplications: int
    divisions: int

    @property
    def all(self) -> int:
        """All of them."""
        return self.additions + self.multiplications + self.divisions


def count(kernel: Callable[..., object], *arguments: npt.NDArray[np.float64]) -> Operations:
    """The operations of one call of a kernel, with those of the kernels it calls; exponents and signs are free.

    Args:
        kernel: A function made by `compiled`.
        arguments: Arrays for it; those it fills are filled.
    """
    tally: Counter[str] = Counter()
    number = _counting(tally)

    def lift(values: npt.NDArray[np.float64]) -> npt.NDArray[np.object_]:
        lifted = np.empty(values.shape, dtype=object)
        lifted.ravel()[:] = [number(value) for value in values.ravel()]
        return lifted

    lifted = [lift(values) for values in arguments]
    _plain(kernel, number, lift, tally)(*lifted)
    for values, result in zip(arguments, lifted, strict=True):
        values[...] = result.astype(float)
    return Operations(tally["add"], tally["mul"], tally["div"])


def _counting(tally: Counter[str]) -> type[float]:
    """A float that enters its operations into a tally."""

    def operation(name: str, kind: str) -> Callable[..., Any]:
        def operate(self: float, other: float) -> Any:  # noqa: ANN401  (a number or NotImplemented, as float's own)
            tally[kind] += 1
            result = getattr(float, name)(self, other)
            return result if result is NotImplemented else Number(result)

        return operate

    class Number(float):
        """It stays one of its kind."""

        def __neg__(self) -> Self:
            return type(self)(float.__neg__(self))

        def __abs__(self) -> Self:
            return type(self)(float.__abs__(self))

    for name, kind in (("add", "add"), ("sub", "add"), ("mul", "mul"), ("truediv", "div")):
        setattr(Number, f"__{name}__", operation(f"__{name}__", kind))
        setattr(Number, f"__r{name}__", operation(f"__r{name}__", kind))
    return Number


def _plain(
    kernel: Callable[..., object], number: type[float], lift: Callable[..., object], tally: Counter[str]
) -> Callable[..., object]:
    """The kernel as plain Python, whose callees are plain too, and whose roots and new arrays are counted."""

    def root(function: Callable[..., float]) -> Callable[..., float]:
        def counted(*values: float) -> float:
            tally["div"] += 1
            return number(function(*values))

        return counted

    source: Any = getattr(kernel, "py_func", kernel)
    names = dict(source.__globals__)
    names["np"] = SimpleNamespace(zeros=lambda shape: lift(np.zeros(shape)), empty=lambda shape: lift(np.zeros(shape)))
    for name in source.__code__.co_names:
        value: Any = names.get(name)
        if hasattr(value, "py_func"):
            names[name] = _plain(value, number, lift, tally)
        elif value is math.sqrt or value is math.hypot:
            names[name] = root(value)
    return FunctionType(source.__code__, names)
