"""The settings of the thesis' experiments: which are pinned, and what a file of the user's changes beside them."""

from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Final, NamedTuple

from torquerig.building import THESIS_RATE_HZ
from torquerig.configuration import DEFAULT, Configuration, Setting, load_configuration

ORIGIN: Final = "reproduce"
"""Who sets what is pinned, in messages and records."""
_AS_SHIPPED: Final = (
    "motion.1.", "motion.2.", "approach.hold_before", "approach.hold_after", "loop.gains", "loop.group_rpdo",
)  # fmt: skip
"""Beginnings of keys: the motions, the samples beside them that differences and delays need, whose gains, and that
drives tell their torque every cycle: what it is made of could not be said otherwise."""
_GAINS: Final = "laws."
_CHOSEN: Final = ("bus.url", "simulator.plant", "loop.law", "loop.motion", "loop.rate_hz", "loop.repeat")
"""Keys that make a run one of the thesis'."""


class Departures(NamedTuple):
    """How a file departs from what is shipped.

    Attributes:
        changed: What differs in the runs.
        put_aside: What the file says and the experiments do not follow.
    """

    changed: tuple[Setting, ...]
    put_aside: tuple[Setting, ...]


def departures(config_file: Path | None) -> Departures:
    """What a file says that is not as shipped.

    Args:
        config_file: A TOML file with what differs from the shipped configuration.

    Returns:
        Its settings, those that hold and those that are put aside.

    Raises:
        ConfigurationError: The file cannot be used.
    """
    if config_file is None:
        return Departures((), ())
    settings = load_configuration(config_file).settings
    differing = [each for each in settings if each.source != DEFAULT and each.value != each.default]
    return Departures(
        tuple(each for each in differing if not _is_pinned(each.key)),
        tuple(each for each in differing if _is_pinned(each.key)),
    )


def configuration_of(config_file: Path | None, plant: str, law: str, motion: int) -> Configuration:
    """The configuration of one experiment.

    Args:
        config_file: As for `departures`.
        plant: Name of the plant.
        law: Name of the law.
        motion: Number of the test motion.

    Returns:
        The configuration, what is pinned pinned.

    Raises:
        ConfigurationError: The file cannot be used, or there is no such plant.
    """
    return load_configuration(config_file, dict(_pins(plant, law, motion)), origin=ORIGIN)


def _pins(plant: str, law: str, motion: int) -> Iterator[tuple[str, object]]:
    """What makes a configuration that of a thesis' experiment."""
    yield from zip(_CHOSEN, ("lockstep:", plant, law, motion, THESIS_RATE_HZ, 1), strict=True)
    yield _GAINS.rstrip("."), {}
    yield from _shipped().items()


@cache
def _shipped() -> Mapping[str, object]:
    """The values that are pinned as they are shipped."""
    return {each.key: each.value for each in load_configuration().settings if each.key.startswith(_AS_SHIPPED)}


def _is_pinned(key: str) -> bool:
    """Whether the experiments have their own value for a key."""
    return key in _CHOSEN or key.startswith((*_AS_SHIPPED, _GAINS))
