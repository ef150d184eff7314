"""Estimators, laws, motions, limits and the loop. It sees joints through its own small protocol, and no drive."""

if __name__ == "control":
    raise ImportError("import torquerig.control: this folder is part of torquerig, not a package of its own")

from torquerig.control.circle import Circle
from torquerig.control.errors import (
    ControlError,
    EstimatorFileError,
    LawFileError,
    LimitExceeded,
    UnknownEstimatorError,
    UnknownLawError,
    UnknownMotionError,
)
from torquerig.control.estimators import (
    BackwardDifference,
    Estimator,
    MovingWindow,
    Sampling,
    estimator_named,
    load_estimators,
    make_estimator,
)
from torquerig.control.joints import Joints, JointSample
from torquerig.control.law import THESIS_STICTION, Desired, Gains, Law, Published, State
from torquerig.control.laws import law_named, load_laws
from torquerig.control.limits import Limits
from torquerig.control.log import Column, LoopLog
from torquerig.control.loop import Controller, Pace, Progress, run_loop
from torquerig.control.motions import Hold, Motion, OutAndBack, Reference, SmoothMove, thesis_motion
from torquerig.control.polyline import Polyline
from torquerig.control.reference import Piece, ReferenceTable, Surroundings, experiment_table, tabulate
from torquerig.control.trajectory import Trajectory

__all__ = [
    "THESIS_STICTION",
    "BackwardDifference",
    "Circle",
    "Column",
    "ControlError",
    "Controller",
    "Desired",
    "Estimator",
    "EstimatorFileError",
    "Gains",
    "Hold",
    "JointSample",
    "Joints",
    "Law",
    "LawFileError",
    "LimitExceeded",
    "Limits",
    "LoopLog",
    "Motion",
    "MovingWindow",
    "OutAndBack",
    "Pace",
    "Piece",
    "Polyline",
    "Progress",
    "Published",
    "Reference",
    "ReferenceTable",
    "Sampling",
    "SmoothMove",
    "State",
    "Surroundings",
    "Trajectory",
    "UnknownEstimatorError",
    "UnknownLawError",
    "UnknownMotionError",
    "estimator_named",
    "experiment_table",
    "law_named",
    "load_estimators",
    "load_laws",
    "make_estimator",
    "run_loop",
    "tabulate",
    "thesis_motion",
]
