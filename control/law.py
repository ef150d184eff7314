"""What a control law is: a small frozen object that turns a state and a reference into motor torques."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from torquerig.control.errors import UnknownMotionError
from torquerig.mechanism import Manipulator

THESIS_STICTION: Final = 0.02
"""Stiction feed-forward on joint 1 [N·m at the motor]: "the least torque to drive the motor" (thesis 6.2)."""
NS_PER_MS: Final = 1e6


class State(NamedTuple):
    """The manipulator as measured.

    Attributes:
        q: Joint angles, shape (3,) [rad].
        qd: Estimated joint rates, shape (3,) [rad/s].
        position: X, the end-effector by forward kinematics, shape (2,) [m].
        velocity: Xdot, the least-squares solution of S Xdot = qd, shape (2,) [m/s].
    """

    q: NDArray[np.float64]
    qd: NDArray[np.float64]
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]


class Desired(NamedTuple):
    """What the reference table asks for in one cycle.

    Attributes:
        position: X_d, shape (2,) [m].
        velocity: v_d, shape (2,) [m/s].
        acceleration: a_d, shape (2,) [m/s²].
        q: q_d, joint angles at X_d, shape (3,) [rad].
        qd: Joint rates at X_d and v_d, shape (3,) [rad/s].
    """

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    q: NDArray[np.float64]
    qd: NDArray[np.float64]


Torque = Callable[[State, Desired], NDArray[np.float64]]
"""From a state and a reference to motor torques, shape (3,) [N·m at the motor]."""


class Gains(NamedTuple):
    """Gains of a law, in the units of its equation.

    Attributes:
        kp: On the position error.
        kv: On the velocity error.
    """

    kp: float
    kv: float


class Published(NamedTuple):
    """A result to compare with.

    Attributes:
        position_rmse_mm: Root mean square of the position error [mm].
        velocity_rmse_m_s: Root mean square of the velocity error [m/s].
        source: Where it stands; of the thesis' own results it begins with "thesis".
    """

    position_rmse_mm: float
    velocity_rmse_m_s: float
    source: str

    @property
    def is_of_thesis(self) -> bool:
        """Whether it is one of the thesis' own results, and not somebody else's."""
        return self.source.startswith("thesis")


@dataclass(frozen=True, slots=True)
class Law(ABC):
    """A control law: its equation in `torque`, what is known of it in class attributes.

    A new law is one file in `torquerig.control.laws` with one subclass; nothing has to be registered. `name` and
    `gains` must be given, the other class attributes may.

    Attributes:
        name: Its name on the command line and in records.
        gains: Gains for each test motion.
        published: A result to compare with for each test motion, if there is one. Only those whose source begins with
            "thesis" count among the thesis' sixteen numbers (`torquerig.control.comparison.published_runs`).
        running_time_ns: Its running time on the thesis' computer, which was the delay from sample to torque there.
        friction_by_default: Whether viscous friction is fed forward unless asked otherwise.
        model: The manipulator as the controller knows it.
        kp: Gain on the position error.
        kv: Gain on the velocity error.
        friction: Whether to feed viscous friction Ft v_d forward.
        stiction: Torque fed forward on joint 1 in the direction of its desired rate [N·m at the motor].
    """

    name: ClassVar[str]
    gains: ClassVar[Mapping[int, Gains]]
    published: ClassVar[Mapping[int, Published]] = MappingProxyType({})
    running_time_ns: ClassVar[int | None] = None
    friction_by_default: ClassVar[bool] = False

    model: Manipulator
    kp: float
    kv: float
    friction: bool = False
    stiction: float = 0.0

    def __init_subclass__(cls) -> None:
        """Give a law that says another equation than its parent nothing of the parent's faster form."""
        if "torque" in vars(cls) and "in_loop" not in vars(cls):
            cls.in_loop = Law.in_loop  # type: ignore[method-assign]

    @classmethod
    def for_motion(
        cls, model: Manipulator, motion: int, *, friction: bool | None = None, stiction: float = 0.0
    ) -> Self:
        """The law with its gains for a test motion.

        Args:
            model: The manipulator as the controller knows it.
            motion: Number of the test motion.
            friction: Whether to feed viscous friction forward; the law's own default when None.
            stiction: Torque fed forward on joint 1 [N·m at the motor].

        Returns:
            The law.

        Raises:
            UnknownMotionError: If the law has no gains for this motion.
        """
        kp, kv = cls.gains_for(motion)
        return cls(model, kp, kv, cls.friction_by_default if friction is None else friction, stiction)

    @classmethod
    def gains_for(cls, motion: int) -> Gains:
        """The gains for a test motion.

        Args:
            motion: Number of the test motion.

        Returns:
            The gains.

        Raises:
            UnknownMotionError: If the law has none for this motion.
        """
        if motion not in cls.gains:
            known = ", ".join(map(str, cls.gains))
            raise UnknownMotionError(f"{cls.name} has no gains for motion {motion}, only for {known}")
        return cls.gains[motion]

    @classmethod
    def thesis_ms(cls) -> float | None:
        """Its running time on the thesis' computer [ms]; None for a law that the thesis does not have."""
        is_of_thesis = any(result.is_of_thesis for result in cls.published.values())
        return cls.running_time_ns / NS_PER_MS if cls.running_time_ns is not None and is_of_thesis else None

    @abstractmethod
    def torque(self, state: State, desired: Desired) -> NDArray[np.float64]:
        """The law's equation.

        Args:
            state: The manipulator as measured.
            desired: What the reference asks for.

        Returns:
            Motor torques, shape (3,) [N·m at the motor], not yet limited.
        """

    def in_loop(self) -> Torque:
        """The law as the loop calls it, in every cycle: `torque` itself, unless the law has a faster form of it.

        A faster form gives the same torques within rounding, and may give them in the same array every time. A law of
        the thesis' form has one by telling its coefficients (`torquerig.control.terms`).
        """
        return self.torque

    def friction_force(self, F: NDArray[np.float64], desired: Desired) -> NDArray[np.float64]:
        """The viscous friction to feed forward.

        Args:
            F: Ft, viscous friction in task coordinates, shape (2, 2) [N·s/m].
            desired: What the reference asks for.

        Returns:
            Ft v_d, or zero when the option is off, shape (2,) [N].
        """
        return F @ desired.velocity if self.friction else np.zeros(2)

    def stiction_torque(self, desired: Desired) -> NDArray[np.float64]:
        """The stiction to feed forward: on joint 1, in the direction of its desired rate (thesis 6.2).

        Args:
            desired: What the reference asks for.

        Returns:
            Motor torques, shape (3,) [N·m at the motor]; zero when the option is off or joint 1 is to stand.
        """
        tau = np.zeros(3)
        if self.stiction:
            tau[0] = self.stiction * np.sign(desired.qd[0])
        return tau
