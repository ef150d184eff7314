"""The control laws, one file a law: whatever `Law` a module of this package defines is found by its name."""

from collections.abc import Mapping
from typing import Final

from torquerig.control.errors import LawFileError, UnknownLawError
from torquerig.control.law import Gains, Law
from torquerig.control.scan import Scan

__all__ = ["law_named", "load_laws"]


def load_laws() -> dict[str, type[Law]]:
    """Find the laws by scanning this package.

    Returns:
        Law classes by name, in alphabetical order.

    Raises:
        LawFileError: If a file cannot be imported, a law has no name or no gains, or two have the same name.
    """
    return _SCAN.of(__name__, __path__)


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


def _lacks(law: type[Law]) -> str | None:
    """What a law lacks beside a name."""
    gains = getattr(law, "gains", None)
    if isinstance(gains, Mapping) and gains and all(map(_is_pair, gains.values())):
        return None
    return "has no gains: it must say gains: ClassVar = {motion: Gains(kp, kv)}"


def _is_pair(gains: object) -> bool:
    """Whether something can be kp and kv."""
    return isinstance(gains, tuple) and len(gains) == len(Gains._fields)


_SCAN: Final[Scan[Law]] = Scan(Law, "law", LawFileError, _lacks)
