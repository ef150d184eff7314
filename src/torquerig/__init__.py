"""Torque-mode servo loops over CANopen: the driver, the simulated drives and the machine behind them.

The names below are the public interface; each is imported when it is first used, so that a part can be used without
waiting for the whole.
"""

import importlib
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from torquerig.assembly import open_rig
    from torquerig.configuration import load_configuration
    from torquerig.experiment import Outcome, run_experiment
    from torquerig.mechanism import Manipulator
    from torquerig.picture import draw
    from torquerig.records import open_record
    from torquerig.simulated_rig import SimulatedRig
    from torquerig.summary import Summary

__all__ = [
    "Manipulator",
    "Outcome",
    "SimulatedRig",
    "Summary",
    "draw",
    "load_configuration",
    "open_record",
    "open_rig",
    "run_experiment",
]

_HOMES: Final = {
    "Manipulator": "torquerig.mechanism",
    "Outcome": "torquerig.experiment",
    "SimulatedRig": "torquerig.simulated_rig",
    "Summary": "torquerig.summary",
    "draw": "torquerig.picture",
    "load_configuration": "torquerig.configuration",
    "open_record": "torquerig.records",
    "open_rig": "torquerig.assembly",
    "run_experiment": "torquerig.experiment",
}


def __getattr__(name: str) -> object:
    """Import a public name from where it lives (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """The public names."""
    return sorted(__all__)
