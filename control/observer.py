"""From samples of the joints to the state that laws and limits see: in every cycle, and nothing allocated."""

import numpy as np

from torquerig.control.estimator import Estimator
from torquerig.control.joints import JointSample
from torquerig.control.law import State
from torquerig.mechanism import Manipulator
from torquerig.mechanism.kernels import OK
from torquerig.mechanism.solvers import end_effector
from torquerig.mechanism.status import require_ok


class Observer:
    """Joint rates by an estimator, the end-effector by forward kinematics, its velocity by least squares.

    Attributes:
        state: The latest state; its arrays are the same for ever.
    """

    def __init__(self, model: Manipulator, estimator: Estimator) -> None:
        """Reserve room, and have the kinematics compiled now, not in the first cycle.

        Args:
            model: The manipulator as the controller knows it.
            estimator: Joint rates from joint angles, for three joints.
        """
        self._model = model
        self._packed = model.constants
        self._estimator = estimator
        self._residuals = np.zeros(3)
        self.state = State(estimator.q, estimator.rate, np.zeros(2), np.zeros(2))
        self._locate()

    def observe(self, sample: JointSample) -> State:
        """Take the next sample.

        Args:
            sample: The joints now.

        Returns:
            `state`, which holds until the next sample.

        Raises:
            SingularPoseError: The elbows stand in a line, or a leg is stretched or folded.
            ValueError: The sample is not later than the one before.
        """
        self._estimator.update(sample.q, sample.at_ns)
        status = self._locate()
        if status != OK:
            require_ok(status, self.state.position, self._model.bases, self._model.link_length)
        return self.state

    def _locate(self) -> int:
        """Where the end-effector is and how fast, from the joints; a status of the mechanism's."""
        return end_effector(self._packed, *self.state, self._residuals)
