"""What the loop needs of a machine: samples of its joints in, motor torques out."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class JointSample(Protocol):
    """The joints at one instant: whatever has these five."""

    @property
    def at_ns(self) -> int:
        """The instant of the sample (the SYNC), on the clock of `Joints.now_ns`."""
        ...

    @property
    def q(self) -> NDArray[np.float64]:
        """Joint angles, shape (3,) [rad]."""
        ...

    @property
    def torque(self) -> NDArray[np.float64]:
        """Actual motor torques, shape (3,) [N·m at the motor]."""
        ...

    @property
    def complete(self) -> bool:
        """Whether all axes answered in time; what is missing repeats the sample before."""
        ...

    @property
    def answered_ns(self) -> NDArray[np.float64] | None:
        """When each axis answered, after `at_ns`, shape (3,) [ns]; NaN where it did not; None where nobody looked."""
        ...


class Joints(Protocol):
    """A group of torque-controlled joints, and the clock that they share with the loop."""

    def now_ns(self) -> int:
        """The clock's time now [ns], monotonic."""
        ...

    def sample(self, due_ns: int) -> JointSample:
        """Wait until `due_ns`, sample all joints at once and return when all answered or the deadline passed."""
        ...

    def command(self, tau_m: NDArray[np.float64], due_ns: int) -> None:
        """Wait until `due_ns` (at once when it is past), then send motor torques, shape (3,) [N·m at the motor]."""
        ...
