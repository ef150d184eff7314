"""The control laws, one file a law: whatever `Law` a module of this package defines is found by its name."""

import importlib
import inspect
import pkgutil
from types import ModuleType
from typing import Any, TypeGuard

from torquerig.control.errors import UnknownLawError
from torquerig.control.law import Law

__all__ = ["law_named", "load_laws"]


def load_laws() -> dict[str, type[Law]]:
    """Find the laws by scanning this package.

    Returns:
        Law classes by name, in alphabetical order.

    Raises:
        ValueError: If two laws have the same name.
    """
    laws: dict[str, type[Law]] = {}
    for entry in pkgutil.iter_modules(__path__):
        module = importlib.import_module(f"{__name__}.{entry.name}")
        for law in vars(module).values():
            if not _is_law_of(module, law):
                continue
            if law.name in laws:
                raise ValueError(f"two laws are named '{law.name}': {laws[law.name].__module__} and {law.__module__}")
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
    """
    laws = load_laws()
    if name not in laws:
        raise UnknownLawError(f"unknown law '{name}': choose {', '.join(laws)}")
    return laws[name]


def _is_law_of(module: ModuleType, thing: Any) -> TypeGuard[type[Law]]:  # noqa: ANN401  (whatever a module holds)
    """Whether a thing is a law that this module defines, not one that it imports or an abstract ancestor."""
    if not (inspect.isclass(thing) and issubclass(thing, Law)):
        return False
    return thing.__module__ == module.__name__ and not inspect.isabstract(thing)
