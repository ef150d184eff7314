"""The control laws, one file a law: whatever `Law` a module of this package defines is found by its name."""

import importlib
import inspect
import pkgutil
from collections.abc import Mapping
from types import ModuleType
from typing import Any, TypeGuard

from torquerig.control.errors import LawFileError, UnknownLawError
from torquerig.control.law import Gains, Law

__all__ = ["law_named", "load_laws"]


def load_laws() -> dict[str, type[Law]]:
    """Find the laws by scanning this package.

    Returns:
        Law classes by name, in alphabetical order.

    Raises:
        LawFileError: If a law has no name or no gains, or two laws have the same name.
    """
    laws: dict[str, type[Law]] = {}
    for entry in pkgutil.iter_modules(__path__):
        module = importlib.import_module(f"{__name__}.{entry.name}")
        for law in vars(module).values():
            if not _is_law_of(law, module):
                continue
            _check(module, law)
            if law.name in laws:
                raise LawFileError(f"two laws are named '{law.name}': {laws[law.name].__module__} and {law.__module__}")
            laws[law.name] = law
    return dict(sorted(laws.items()))


def law_named(name: str) -> type[Law]:
    """The law of this name.

    Args:
        name: As on the command line, "computed-torque".

    Returns:
        Its class.

    Raises:
        UnknownLawError: If no file of this package defines it.
        LawFileError: If a file of this package defines a law that cannot be used.
    """
    laws = load_laws()
    if name not in laws:
        raise UnknownLawError(f"unknown law '{name}': choose {', '.join(laws)}")
    return laws[name]


def _is_law_of(thing: Any, module: ModuleType) -> TypeGuard[type[Law]]:  # noqa: ANN401  (whatever a module holds)
    """Whether a thing is a law that this module defines, not one that it imports or an abstract ancestor."""
    if not (inspect.isclass(thing) and issubclass(thing, Law)):
        return False
    return thing.__module__ == module.__name__ and not inspect.isabstract(thing)


def _check(module: ModuleType, law: type[Law]) -> None:
    """Refuse a law that does not say what every law must: abstract class attributes cannot be declared."""
    place = f"{module.__file__}: law {law.__name__}"
    name, gains = getattr(law, "name", None), getattr(law, "gains", None)
    if not (isinstance(name, str) and name):
        raise LawFileError(f'{place} has no name: it must say name: ClassVar[str] = "its-name"')
    if not (isinstance(gains, Mapping) and gains and all(map(_is_pair, gains.values()))):
        raise LawFileError(f"{place} has no gains: it must say gains: ClassVar = {{motion: Gains(kp, kv)}}")


def _is_pair(gains: object) -> bool:
    """Whether something can be kp and kv."""
    return isinstance(gains, tuple) and len(gains) == len(Gains._fields)
