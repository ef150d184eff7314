"""The plant's parameters that a fit may move: what each is, how far it may go, and why no farther."""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.complaints import suggestion
from torquerig.errors import ConfigurationError
from torquerig.schema_machines import Plant

MOST: Final = 5
"""Free parameters of one fit at most: there are sixteen numbers to explain."""


class PlantParameter(NamedTuple):
    """One number of a plant, or one that several joints share.

    Attributes:
        name: Its name on the command line.
        unit: Its unit.
        lowest: Its lower bound.
        highest: Its upper bound.
        words: What it is, and where the bounds come from.
    """

    name: str
    unit: str
    lowest: float
    highest: float
    words: str


_DRY = "4 N·m is 0.16 N·m at the motor, half its rated torque"
PARAMETERS: Final = {
    parameter.name: parameter
    for parameter in (
        PlantParameter("coulomb", "N·m", 0.0, 4.0, f"dry friction, the same at all joints; {_DRY}"),
        PlantParameter("coulomb_1", "N·m", 0.0, 4.0, f"dry friction of joint 1 alone; {_DRY}"),
        PlantParameter("coulomb_2", "N·m", 0.0, 4.0, f"dry friction of joint 2 alone; {_DRY}"),
        PlantParameter("coulomb_3", "N·m", 0.0, 4.0, f"dry friction of joint 3 alone; {_DRY}"),
        PlantParameter("breakaway", "N·m", 0.0, 1.5, "what a joint at rest holds beyond dry friction; 3 x the thesis'"),
        PlantParameter(
            "actuator_inertia", "kg·m²", 0.006125, 0.0578, "I1, from the bare rotor through the gear to 2 x the thesis'"
        ),
        PlantParameter("active_viscous", "N·m·s/rad", 0.0, 2.5, "K1, viscous, actuated joints; 3 x the thesis'"),
        PlantParameter("passive_viscous", "N·m·s/rad", 0.0, 0.28, "K2, viscous, elbows; 3 x the thesis'"),
        PlantParameter("torque_limit", "N·m", 0.25, 0.95, "at the motor; object 6072 lets no more than 0.95 through"),
        PlantParameter(
            "gear_compliance",
            "rad/(N·m)",
            0.0,
            0.0025,
            "wind-up of each gear, at the joint; from rigid to 400 N·m/rad, our choice: harmonic gears are stiffer",
        ),
        PlantParameter("current_lag", "s", 0.0, 1.5e-3, "of the current loop; a third of the sampling period"),
    )
}
"""By name. Beside `coulomb_3`, `coulomb` is that of joints 1 and 2."""

DEFAULT: Final = ("coulomb", "actuator_inertia", "active_viscous", "torque_limit", "gear_compliance")
"""The five that came nearest to the thesis of those tried (docs/fit-plant.md)."""

_JOINTS: Final = tuple(f"coulomb_{joint}" for joint in (1, 2, 3))


def chosen_parameters(names: Sequence[str]) -> tuple[PlantParameter, ...]:
    """The parameters of these names.

    Args:
        names: One to five, each once.

    Returns:
        The parameters, in the order of `PARAMETERS`.

    Raises:
        ConfigurationError: There are none or too many, one is unknown or named twice, or one would change nothing.
    """
    if not 1 <= len(names) <= MOST:
        raise ConfigurationError(
            f"{len(names)} parameters cannot be fitted to the thesis' 16 numbers:"
            f" name 1 to {MOST} of {', '.join(PARAMETERS)}"
        )
    for place, name in enumerate(names):
        if name not in PARAMETERS:
            raise ConfigurationError(f"{name!r} is not a parameter of a plant{suggestion(name, PARAMETERS)}")
        if name in names[:place]:
            raise ConfigurationError(f"the parameter {name!r} is named twice")
    if "coulomb" in names and set(_JOINTS) <= set(names):
        raise ConfigurationError("coulomb would change nothing beside coulomb_1, coulomb_2 and coulomb_3: leave it out")
    return tuple(parameter for name, parameter in PARAMETERS.items() if name in names)


def value_in(plant: Plant, name: str) -> float:
    """The value that a plant has of a parameter.

    Args:
        plant: The plant; joints that share a parameter may differ in it, then it is their mean.
        name: The parameter's name.

    Returns:
        The value in the parameter's unit.
    """
    if name == "coulomb":
        return float(np.mean(plant.coulomb))
    if name in _JOINTS:
        return plant.coulomb[_JOINTS.index(name)]
    if name == "breakaway":
        return float(np.mean(_excess(plant)))
    return float(getattr(plant, name))


def changed(plant: Plant, parameters: Sequence[PlantParameter], values: Sequence[float]) -> Plant:
    """A plant with some of its parameters changed; joints keep what they hold at rest beyond their dry friction.

    Args:
        plant: What is not changed.
        parameters: What is.
        values: Their new values, each in its unit.

    Returns:
        The new plant.
    """
    wanted = dict(zip((parameter.name for parameter in parameters), map(float, values), strict=True))
    common = wanted.pop("coulomb", None)
    dry = [
        wanted.pop(name, old if common is None else common) for name, old in zip(_JOINTS, plant.coulomb, strict=True)
    ]
    beyond = wanted.pop("breakaway", None)
    hold = [moving + (old if beyond is None else beyond) for moving, old in zip(dry, _excess(plant), strict=True)]
    return Plant.model_validate(plant.model_dump() | {"coulomb": tuple(dry), "breakaway": tuple(hold)} | wanted)


def to_unit(parameters: Sequence[PlantParameter], values: Sequence[float]) -> NDArray[np.float64]:
    """Values as shares of the way from lower to upper bound, held within them, shape (k,) [1]."""
    lowest, highest = bounds(parameters)
    return np.clip((np.asarray(values) - lowest) / (highest - lowest), 0.0, 1.0)


def from_unit(parameters: Sequence[PlantParameter], shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """What `to_unit` has made shares of, shape (k,) [each in its unit]."""
    lowest, highest = bounds(parameters)
    return np.clip(lowest + shares * (highest - lowest), lowest, highest)


def bounds(parameters: Sequence[PlantParameter]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper bounds, shape (k,) each [each in its unit]."""
    return np.array([each.lowest for each in parameters]), np.array([each.highest for each in parameters])


def _excess(plant: Plant) -> list[float]:
    """What each joint holds at rest beyond its dry friction [N·m]."""
    return [resting - moving for moving, resting in zip(plant.coulomb, plant.breakaway, strict=True)]
