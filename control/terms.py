"""The form that the thesis' laws share, compiled: a law that is of this form says its coefficients, and is fast."""

# ruff: noqa: PLR0917  -- a kernel takes plain numbers and arrays, as many as the equation has

from dataclasses import astuple, dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from torquerig.control.law import Desired, State
from torquerig.control.reference import ACCELERATION, ASKED, in_row
from torquerig.control.row import POSITION, QD, STATE, VELOCITY, Q
from torquerig.mechanism import Manipulator
from torquerig.mechanism.compiled import bind, compiled
from torquerig.mechanism.kernels import OK, AllRows, Floats, Legs, Plane, leg_force, legs_at, rows_at, status_of
from torquerig.mechanism.solvers import torques_of
from torquerig.mechanism.status import require_ok


@dataclass(frozen=True, slots=True, kw_only=True)
class Terms:
    """Coefficients of a law, what is not told being 0; e = X_d - X.

        tau_m = S(S'S)^-1 F / n + joint_kp (q_d - q) + joint_kv (qd_d - qd) + stiction sign(qd_d) on motor 1,
        F = Mt (inertia a_d + inertia_kp e + inertia_kv edot) + coriolis Ct v_d + friction Ft v_d + kp e + kv edot

    Attributes:
        inertia: On the desired acceleration [1].
        inertia_kp: On the position error [1/s²].
        inertia_kv: On the velocity error [1/s].
        coriolis: On Ct v_d [1].
        friction: On Ft v_d [1].
        kp: On the position error [N/m].
        kv: On the velocity error [N·s/m].
        joint_kp: On the joint angles' error [N·m/rad at the motor].
        joint_kv: On the joint rates' error [N·m·s/rad at the motor].
        stiction: On motor 1 [N·m].
    """

    inertia: float = 0.0
    inertia_kp: float = 0.0
    inertia_kv: float = 0.0
    coriolis: float = 0.0
    friction: float = 0.0
    kp: float = 0.0
    kv: float = 0.0
    joint_kp: float = 0.0
    joint_kv: float = 0.0
    stiction: float = 0.0

    def torque(self, model: Manipulator) -> "TermsTorque":
        """The equation as one compiled call, compiled now and not in the first cycle.

        Args:
            model: The manipulator as the controller knows it.

        Returns:
            The torques; what it returns is the same array every time. The loop knows it, and works it out together
            with all else of a cycle (`torquerig.control.cycle_kernel`).
        """
        return TermsTorque(model, self)


class TermsTorque:
    """The equation of `Terms` for a model, with its buffers: a law's `Torque`.

    Attributes:
        coefficients: The terms, as kernels take them.
    """

    __slots__ = ("_asked", "_model", "_solve", "_state", "_tau", "coefficients")

    def __init__(self, model: Manipulator, terms: Terms) -> None:
        """Reserve room, and have the equation compiled.

        Args:
            model: The manipulator as the controller knows it.
            terms: The coefficients.
        """
        self._model = model
        self.coefficients: Final = np.array(astuple(terms), dtype=np.float64)
        self._state = np.zeros(STATE)
        self._asked = np.zeros((1, ASKED))
        self._tau = np.zeros(3)
        arrays = (model.constants, self.coefficients, np.zeros(3), self._state, self._asked)
        self._solve = bind(torque_of_terms, *arrays, scalars=("int64",))

    def __call__(self, state: State, desired: Desired) -> NDArray[np.float64]:
        """Motor torques, shape (3,) [N·m at the motor]; the same array every time.

        Raises:
            ReachError, SingularPoseError: As `Manipulator.dynamics` at the state's position.
        """
        np.concatenate(state, out=self._state)
        np.concatenate(in_row(desired), out=self._asked[0])
        status, *torques = self._solve(0)
        if status != OK:
            require_ok(status, state.position, self._model.bases, self._model.link_length)
        self._tau[:] = torques
        return self._tau


# layout of the coefficients: the order of Terms
INERTIA: Final = 0
INERTIA_KP: Final = 1
INERTIA_KV: Final = 2
CORIOLIS: Final = 3
FRICTION: Final = 4
KP: Final = 5
KV: Final = 6
JOINT_KP: Final = 7
JOINT_KV: Final = 8
STICTION: Final = 9


@compiled
def any_of(terms: Floats, begin: int, end: int) -> bool:
    """Whether a range of the coefficients is not all 0."""
    for i in range(begin, end):  # noqa: SIM110  (numba has no generator expressions)
        if terms[i] != 0.0:
            return True
    return False


@compiled
def force_of_terms(p: Floats, terms: Floats, legs: Legs, rows: AllRows, state: Floats, asked: Floats, k: int) -> Plane:
    """F of `Terms` [N]."""
    vx, vy = state[VELOCITY], state[VELOCITY + 1]
    ex, ey = asked[k, POSITION] - state[POSITION], asked[k, POSITION + 1] - state[POSITION + 1]
    dx, dy = asked[k, VELOCITY], asked[k, VELOCITY + 1]
    evx, evy = dx - vx, dy - vy
    fx = terms[KP] * ex + terms[KV] * evx
    fy = terms[KP] * ey + terms[KV] * evy
    if not any_of(terms, INERTIA, KP):
        return fx, fy
    acceleration = (
        terms[INERTIA] * asked[k, ACCELERATION] + terms[INERTIA_KV] * evx + terms[INERTIA_KP] * ex,
        terms[INERTIA] * asked[k, ACCELERATION + 1] + terms[INERTIA_KV] * evy + terms[INERTIA_KP] * ey,
    )
    turning, resisted = terms[CORIOLIS], terms[FRICTION]
    for i in range(3):
        along, across = leg_force(
            p,
            i,
            legs[i],
            rows[i],
            (vx, vy),
            acceleration,
            (turning * dx, turning * dy),
            (resisted * dx, resisted * dy),
        )
        fx += along
        fy += across
    return fx, fy


@compiled
def task_torque(p: Floats, terms: Floats, state: Floats, asked: Floats, k: int) -> tuple[int, float, float, float]:
    """A status of the mechanism's, and S(S'S)^-1 F / n."""
    legs = legs_at(p, state[POSITION], state[POSITION + 1])
    status = status_of(p, legs)
    if status != OK:
        return status, 0.0, 0.0, 0.0
    rows = rows_at(p, legs)
    return torques_of(p, rows, force_of_terms(p, terms, legs, rows, state, asked, k))


@compiled
def joint_torque(terms: Floats, coulomb: float, state: Floats, asked: Floats, k: int, i: int) -> float:
    """What `Terms` asks for at joint i by itself, with Coulomb friction [N·m at the motor]."""
    rate = asked[k, QD + i]
    tau: float = terms[JOINT_KP] * (asked[k, Q + i] - state[Q + i]) + terms[JOINT_KV] * (rate - state[QD + i])
    dry = terms[STICTION] if i == 0 else 0.0
    if rate != 0.0:
        tau += dry + coulomb if rate > 0.0 else -dry - coulomb
    return tau


@compiled
def torque_of_terms(
    p: Floats, terms: Floats, coulomb: Floats, state: Floats, asked: Floats, k: int
) -> tuple[int, float, float, float]:
    """The equation of `Terms`: a state and a reference in, a status of the mechanism's and motor torques out.

    Args:
        p: The manipulator's packed constants.
        terms: The coefficients.
        coulomb: Torque on each joint in the direction of its desired rate, shape (3,) [N·m at the motor].
        state: q, qd, position, velocity, shape (10,) or more.
        asked: Rows of the reference table, in its layout.
        k: The row.
    """
    status, tau_1, tau_2, tau_3 = OK, 0.0, 0.0, 0.0
    if any_of(terms, INERTIA, JOINT_KP):
        status, tau_1, tau_2, tau_3 = task_torque(p, terms, state, asked, k)
    tau_1 += joint_torque(terms, coulomb[0], state, asked, k, 0)
    tau_2 += joint_torque(terms, coulomb[1], state, asked, k, 1)
    tau_3 += joint_torque(terms, coulomb[2], state, asked, k, 2)
    return status, tau_1, tau_2, tau_3
