"""Pushes on a mechanism that may be wired in any way, and which of their answers are the mechanism's motion."""

from collections.abc import Sequence
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration.installation import JOINTS
from torquerig.mechanism import Manipulator

Vector = NDArray[np.float64]

ALONE: Final = 0.05
"""Share of an axis' motion that the others may seem to make while it turns alone; the legs' closing asks a fifth."""
SPINS: Final = 0.3
"""[rad/s] at its end of a push that spins a loose rotor: of 0.098e-4 kg·m² (thesis, Table A.1) it has 0.6 at 0.2 N·m/s.
A gear that winds up, which moves one axis alone too, follows the torque: 0.05 of 1.4e-3 rad/(N·m) at 0.4 N·m/s."""
_STEP: Final = 1e-5  # [m] of the difference that stands for a derivative by the place


class Push(NamedTuple):
    """A push and its answer, as the drives tell it.

    Attributes:
        torque: Pattern of the commanded torques, shape (3,).
        moved: How far each joint moved, shape (3,) [rad].
        before: How far each stood from its first place when the push began, shape (3,) [rad].
        work: Sum over the cycles of each axis' torque (rows) times each axis' step (columns), shape (3, 3)
            [N·m rad at the motor].
        rates: Joint rates at its end, shape (3,) [rad/s].
        squares: Integral of rates times rates, shape (3, 3) [rad²/s].
    """

    torque: Vector
    moved: Vector
    before: Vector
    work: Vector
    rates: Vector
    squares: Vector

    @property
    def lone(self) -> int | None:
        """The axis that spun alone, which no joint of the mechanism can; None when others went along."""
        size = np.abs(self.moved)
        most = int(np.argmax(size))
        others = np.delete(size, most)
        spins = bool(abs(self.rates[most]) >= SPINS)
        return most if spins and float(others.max()) < ALONE * float(size[most]) else None


class Place(NamedTuple):
    """The mechanism about the pose of the home fixture.

    Attributes:
        model: The mechanism.
        S: Joint rates per end-effector velocity, shape (3, 2) [1/m].
        Mt: Task inertia, shape (2, 2) [kg].
        Ft: Task viscous friction, shape (2, 2) [N·s/m].
        normal: c of length 1 with c'S = 0: rates with c'qd = 0 close, shape (3,).
        bend: Its derivative by the place, shape (3, 2) [1/m].
    """

    model: Manipulator
    S: Vector
    Mt: Vector
    Ft: Vector
    normal: Vector
    bend: Vector

    @classmethod
    def of(cls, model: Manipulator, position: tuple[float, float]) -> Self:
        """The mechanism with its end-effector at a position [m]."""
        S = model.jacobians(position)[1]
        steps = _STEP * np.eye(2)
        ahead, behind = (
            [_normal(model.jacobians(np.array(position) + sense * step)[1]) for step in steps] for sense in (1, -1)
        )
        bend = (np.column_stack(ahead) - np.column_stack(behind)) / (2 * _STEP)
        return cls(model, S, model.task_inertia(position), model.task_viscous(position), _normal(S), bend)


class Evidence(NamedTuple):
    """Pushes, sorted.

    Attributes:
        pushes: Those that the mechanism answered, without any by motors that turned alone.
        torque, moved, before, work, rates, squares: Of these, one a row.
        lone: Those that one axis answered alone.
        loose: Axes whose motor turned alone when it pushed alone, or is suspected to slip.
    """

    torque: Vector
    moved: Vector
    before: Vector
    work: Vector
    rates: Vector
    squares: Vector
    lone: tuple[Push, ...]
    loose: tuple[int, ...]

    @classmethod
    def of(cls, pushes: Sequence[Push], suspect: int | None = None) -> Self:
        """Sort pushes; one that nothing answered is no help and is left out, and so are all by a suspect axis."""
        answered = [push for push in pushes if np.any(push.moved)]
        lone = tuple(push for push in answered if push.lone is not None)
        loose = {int(np.flatnonzero(push.torque)[0]) for push in lone if np.count_nonzero(push.torque) == 1}
        loose |= set() if suspect is None else {suspect}
        kept = [push for push in answered if push.lone is None and not np.any(push.torque[sorted(loose)])]
        torque, moved, before, rates = (
            _stacked([getattr(push, name) for push in kept], (JOINTS,))
            for name in ("torque", "moved", "before", "rates")
        )
        work, squares = (
            _stacked([getattr(push, name) for push in kept], (JOINTS, JOINTS)) for name in ("work", "squares")
        )
        return cls(torque, moved, before, work, rates, squares, lone, tuple(sorted(loose)))

    def __len__(self) -> int:
        return len(self.moved)

    @property
    def spun(self) -> tuple[int, ...]:
        """Axes whose encoders tell of a motor that turned alone."""
        return tuple(sorted({push.lone for push in self.lone if push.lone is not None}))


def _normal(S: Vector) -> Vector:
    normal: Vector = np.cross(S[:, 0], S[:, 1])
    normal /= np.linalg.norm(normal)
    return normal


def _stacked(rows: Sequence[Vector], shape: tuple[int, ...]) -> Vector:
    """Rows of a shape on top of each other, also none."""
    stacked: Vector = np.array(rows, dtype=np.float64).reshape(len(rows), *shape)
    return stacked
