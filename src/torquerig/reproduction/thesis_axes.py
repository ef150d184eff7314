"""The panels of the thesis' Figures 6.2 to 6.10: titles, units and the ranges of their axes, as printed.

The thesis' curves are not to be had as numbers; these ranges are. Figures 6.6 to 6.10 call their abscissa "time (ms)",
but it counts samples of 4 ms as that of Figures 6.2 to 6.5 does (see misprints.py).
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

SAMPLES: Final[Mapping[int, int]] = MappingProxyType({1: 50, 2: 40})
"""Where the abscissa ends, motion by motion [samples of 4 ms]."""


class Panel(NamedTuple):
    """One panel of a figure.

    Attributes:
        title: What it shows.
        ordinate: Its quantity and unit.
        samples: Where its abscissa ends, which begins at 0.
        low: Where its ordinate begins.
        high: Where it ends.
    """

    title: str
    ordinate: str
    samples: int
    low: float
    high: float


def _joints(motion: int, name: str, ordinate: str, *ranges: tuple[float, float]) -> tuple[Panel, ...]:
    """One panel a joint or motor."""
    return tuple(
        Panel(f"{name} {joint}", ordinate, SAMPLES[motion], *ends) for joint, ends in enumerate(ranges, start=1)
    )


def _profiles(motion: int, *ranges: tuple[float, float]) -> tuple[Panel, ...]:
    """The six panels of Figures 6.2 and 6.3."""
    titles = (
        ("Desired acceleration along x and y", "acceleration [m/s²]"),
        ("Desired velocity along x and y", "velocity [m/s]"),
        ("Desired position along x", "x [m]"),
        ("Desired position along y", "y [m]"),
        ("Velocity of the actuated joints", "velocity [rad/s]"),
        ("Acceleration of the actuated joints", "acceleration [rad/s²]"),
    )
    return tuple(Panel(*words, SAMPLES[motion], *ends) for words, ends in zip(titles, ranges, strict=True))


def _errors(motion: int, position: float, velocity: float) -> tuple[Panel, Panel]:
    """Half of Figure 6.6."""
    return (
        Panel(f"Position, motion {motion}", "position error [mm]", SAMPLES[motion], 0.0, position),
        Panel(f"Velocity, motion {motion}", "velocity error [m/s]", SAMPLES[motion], 0.0, velocity),
    )


PROFILES: Final = MappingProxyType(
    {
        1: _profiles(1, (-8, 8), (-0.25, 0.25), (0.092, 0.106), (0.062, 0.076), (-2.5, 2.5), (-100, 100)),
        2: _profiles(2, (-15, 15), (-0.4, 0.3), (0.092, 0.108), (0.062, 0.078), (-4, 4), (-200, 250)),
    }
)
"""Figures 6.2 and 6.3."""
COMPONENTS: Final = MappingProxyType(
    {
        1: _joints(1, "Motor", "torque [N·m]", (-0.06, 0.08), (-0.2, 0.25), (-0.2, 0.25)),
        2: _joints(2, "Motor", "torque [N·m]", (-0.1, 0.15), (-0.4, 0.4), (-0.4, 0.5)),
    }
)
"""Figures 6.4 and 6.5."""
ERRORS: Final = MappingProxyType({1: _errors(1, 2.5, 0.16), 2: _errors(2, 4.0, 0.25)})
"""Figure 6.6."""
JOINT_ERRORS: Final = MappingProxyType(
    {
        1: _joints(1, "Joint", "position error [deg]", (-0.5, 0.4), (-1.0, 1.5), (-2.0, 2.0)),
        2: _joints(2, "Joint", "position error [deg]", (-0.8, 0.6), (-2.5, 1.5), (-2.0, 2.0)),
    }
)
"""Figures 6.7 and 6.8."""
TORQUES: Final = MappingProxyType(
    {
        1: _joints(1, "Motor", "torque [N·m]", (-0.2, 0.25), (-0.4, 0.3), (-0.4, 0.3)),
        2: _joints(2, "Motor", "torque [N·m]", (-0.2, 0.15), (-0.4, 0.4), (-0.4, 0.5)),
    }
)
"""Figures 6.9 and 6.10."""
