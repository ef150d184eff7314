"""Whether a run of a test motion is the thesis' experiment, and in what it departs from it."""

from collections.abc import Iterator
from typing import Final

from torquerig import building
from torquerig.configuration import Configuration
from torquerig.control.errors import UnknownMotionError
from torquerig.control.laws import law_named
from torquerig.toml_text import write

_KEYS: Final = (
    "loop.rate_hz",
    "loop.command_after",
    "loop.rpdo_type",
    "loop.repeat",
    "loop.estimator",
    "loop.friction_feedforward",
    "loop.stiction_feedforward",
    "loop.coulomb_feedforward",
    "loop.delay_compensation",
    "limits.torque",
)
"""Settings of which the errors depend, beside the motion, the gains and the controller's model."""


def departures(configuration: Configuration) -> tuple[str, ...]:
    """What makes a run of a test motion another experiment than the thesis' own of its law and motion.

    Args:
        configuration: Of the run, `loop.motion` a number.

    Returns:
        A few words each: what is set, and what it is in the thesis; none where it is the thesis' experiment. On what
        machine it is run does not count: that is never the thesis' own.
    """
    return (*_gains(configuration), *_settings(configuration))


def _gains(configuration: Configuration) -> Iterator[str]:
    """Gains that are not the law's own for this motion."""
    rig = configuration.rig
    try:
        own = law_named(rig.loop.law).gains_for(int(rig.loop.motion))
    except UnknownMotionError:
        return
    for name, used, thesis in zip(own._fields, building.gains(rig), own, strict=True):
        if used != thesis:
            yield f"{name} = {used:g} (thesis: {thesis:g})"


def _settings(configuration: Configuration) -> Iterator[str]:
    """Other settings that are not as shipped, which is as in the thesis."""
    loop = configuration.rig.loop
    tables = (f"motion.{loop.motion}.", f"estimators.{loop.estimator}.", "model.")
    for each in configuration.settings:
        if (each.key in _KEYS or each.key.startswith(tables)) and each.value != each.default:
            yield f"{each.key} = {write(each.value)} (thesis: {write(each.default)})"
