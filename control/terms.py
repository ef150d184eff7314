"""The form that the thesis' laws share, compiled: a law that is of this form says its coefficients, and is fast."""

# ruff: noqa: PLR0917  -- a kernel takes plain numbers and arrays, as many as the equation has

from dataclasses import astuple, dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from torquerig.control.law import Desired, State, Torque
from torquerig.mechanism import Manipulator
from torquerig.mechanism.compiled import compiled
from torquerig.mechanism.kernels import OK, Floats, task_dynamics
from torquerig.mechanism.solvers import distribute
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

    def torque(self, model: Manipulator) -> Torque:
        """The equation as one compiled call, compiled now and not in the first cycle.

        Args:
            model: The manipulator as the controller knows it.

        Returns:
            The torques; what it returns is the same array every time.
        """
        return _CompiledTerms(model, self).torque


class _CompiledTerms:
    """The equation of `Terms` for a model, with its buffers."""

    __slots__ = ("_coefficients", "_model", "_packed", "_scratch", "_tau")

    def __init__(self, model: Manipulator, terms: Terms) -> None:
        self._model = model
        self._packed = model.constants
        self._coefficients = np.array(astuple(terms), dtype=np.float64)
        self._scratch = np.zeros((ROWS, 2))
        self._tau = np.zeros(3)
        plane, joints = np.full(2, np.nan), np.full(3, np.nan)
        self._solve(State(joints, joints, plane, plane), Desired(plane, plane, plane, joints, joints))

    def torque(self, state: State, desired: Desired) -> NDArray[np.float64]:
        """Motor torques, shape (3,) [N·m at the motor]; the same array every time.

        Raises:
            ReachError, SingularPoseError: As `Manipulator.dynamics` at the state's position.
        """
        status = self._solve(state, desired)
        if status != OK:
            require_ok(status, state.position, self._model.bases, self._model.link_length)
        return self._tau

    def _solve(self, state: State, desired: Desired) -> int:
        return torque_of_terms(self._packed, self._coefficients, *state, *desired, self._scratch, self._tau)


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

# layout of the scratch's rows
MT: Final = 0
CT: Final = 2
FT: Final = 4
FORCE: Final = 9  # behind S, which nobody needs here
ROWS: Final = 10


@compiled
def any_of(terms: Floats, begin: int, end: int) -> bool:
    """Whether a range of the coefficients is not all 0."""
    for term in terms[begin:end]:  # noqa: SIM110  (numba has no generator expressions)
        if term != 0.0:
            return True
    return False


@compiled
def force_of_terms(
    p: Floats,
    terms: Floats,
    position: Floats,
    velocity: Floats,
    x_d: Floats,
    v_d: Floats,
    a_d: Floats,
    scratch: Floats,
) -> int:
    """F of `Terms`, into the scratch; a status of the mechanism's."""
    ex, ey = x_d[0] - position[0], x_d[1] - position[1]
    evx, evy = v_d[0] - velocity[0], v_d[1] - velocity[1]
    scratch[FORCE, 0] = terms[KP] * ex + terms[KV] * evx
    scratch[FORCE, 1] = terms[KP] * ey + terms[KV] * evy
    if not any_of(terms, INERTIA, KP):
        return OK
    ax = terms[INERTIA] * a_d[0] + terms[INERTIA_KV] * evx + terms[INERTIA_KP] * ex
    ay = terms[INERTIA] * a_d[1] + terms[INERTIA_KV] * evy + terms[INERTIA_KP] * ey
    status = task_dynamics(p, position, velocity, scratch[:FORCE])
    for j in range(2):
        inertia = scratch[MT + j, 0] * ax + scratch[MT + j, 1] * ay
        coriolis = scratch[CT + j, 0] * v_d[0] + scratch[CT + j, 1] * v_d[1]
        friction = scratch[FT + j, 0] * v_d[0] + scratch[FT + j, 1] * v_d[1]
        scratch[FORCE, j] += inertia + terms[CORIOLIS] * coriolis + terms[FRICTION] * friction
    return status


@compiled
def torque_of_terms(
    p: Floats,
    terms: Floats,
    q: Floats,
    qd: Floats,
    position: Floats,
    velocity: Floats,
    x_d: Floats,
    v_d: Floats,
    a_d: Floats,
    q_d: Floats,
    qd_d: Floats,
    scratch: Floats,
    tau: Floats,
) -> int:
    """The equation of `Terms`: a state and a reference in, motor torques out; a status of the mechanism's."""
    tau[:] = 0.0
    status = OK
    if any_of(terms, INERTIA, JOINT_KP):
        status = force_of_terms(p, terms, position, velocity, x_d, v_d, a_d, scratch)
        if status == OK:
            status = distribute(p, position, scratch[FORCE], tau)
    for i in range(3):
        tau[i] += terms[JOINT_KP] * (q_d[i] - q[i]) + terms[JOINT_KV] * (qd_d[i] - qd[i])
    if qd_d[0] != 0.0:
        tau[0] += terms[STICTION] if qd_d[0] > 0.0 else -terms[STICTION]
    return status
