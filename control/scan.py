"""Laws and estimators are found, not registered: whatever subclass a module of their package defines is one by name."""

import importlib.util
import inspect
import pkgutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any, Generic, TypeGuard, TypeVar

from torquerig.control.errors import ControlError

Kind = TypeVar("Kind")


@dataclass(frozen=True, slots=True)
class Scan(Generic[Kind]):
    """What is looked for in a package.

    Attributes:
        ancestor: The abstract ancestor of what is looked for, whose subclasses have a `name`.
        noun: What one is called: "law".
        error: What is raised for a file that cannot be used.
        lacks: What else a class lacks, in words that begin with "has no"; None for nothing.
    """

    ancestor: type[Any]
    noun: str
    error: type[ControlError]
    lacks: Callable[[type[Kind]], str | None] = lambda _found: None

    def of(self, package: str, path: Sequence[str]) -> dict[str, type[Kind]]:
        """The classes that a package's modules define.

        Args:
            package: Its name.
            path: Its folders.

        Returns:
            Classes by name, in alphabetical order.

        Raises:
            ControlError: As `error` says: a module cannot be imported, a class has no name or lacks something, or two
                have the same name. The message names the file.
        """
        found: dict[str, type[Kind]] = {}
        for entry in pkgutil.iter_modules(path):
            module = self._imported(f"{package}.{entry.name}")
            for thing in vars(module).values():
                if not self._is_of(thing, module):
                    continue
                name = self._name_of(thing, module)
                if name in found:
                    twins = f"{found[name].__module__} and {thing.__module__}"
                    raise self.error(f"two {self.noun}s are named '{name}': {twins}")
                found[name] = thing
        return dict(sorted(found.items()))

    def _imported(self, name: str) -> ModuleType:
        """The module; what goes wrong in it is told as the file's fault."""
        try:
            return importlib.import_module(name)
        except Exception as error:
            file = getattr(importlib.util.find_spec(name), "origin", None) or name
            words = " ".join(f"{error}".split())
            raise self.error(f"{file} cannot be imported: {type(error).__name__}: {words}") from error

    def _is_of(self, thing: Any, module: ModuleType) -> TypeGuard[type[Kind]]:  # noqa: ANN401  (whatever it holds)
        """Whether a thing is one that this module defines, not one that it imports or an abstract ancestor."""
        if not (inspect.isclass(thing) and issubclass(thing, self.ancestor)):
            return False
        return thing.__module__ == module.__name__ and not inspect.isabstract(thing)

    def _name_of(self, found: type[Kind], module: ModuleType) -> str:
        """The name of a class; refuses one that does not say what it must: abstract attributes cannot be declared."""
        name = getattr(found, "name", None)
        lacking = self.lacks(found)
        if not (isinstance(name, str) and name):
            lacking = 'has no name: it must say name: ClassVar[str] = "its-name"'
        if lacking is not None:
            raise self.error(f"{module.__file__}: {self.noun} {found.__name__} {lacking}")
        return str(name)
