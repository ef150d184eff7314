"""A machine in virtual time, and the mechanism's formulas typed again from the specification."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from torquerig.control import Controller, Desired, Law, Limits, State, make_estimator
from torquerig.mechanism import HOME, Manipulator, warm_up

PERIOD_NS = 4_000_000
Array = NDArray[np.float64]


@pytest.fixture(scope="session")
def model() -> Manipulator:
    warm_up()
    return Manipulator.thesis()


class Textbook:
    """Mt, Ct, Ft, S by the formulas of the mechanism's specification, with numpy and nothing of ours."""

    length = 0.070
    gear = 25.0
    bases = np.array([[0.0, 0.062], [0.184, 0.0], [0.184, 0.124]])
    m2, r2, i2 = (
        np.array([0.504, 0.376, 0.125]),
        np.array([0.0508, 0.0512, 0.035]),
        np.array([3.08, 3.065, 1.001]) * 1e-4,
    )
    alpha = 6.214e-4 + i2 + 0.55 * 0.045**2 + m2 * (0.070**2 + r2**2) + 0.0289
    beta, gamma = m2 * r2 * 0.070, i2 + m2 * r2**2
    viscous = np.diag([0.8315] * 3 + [0.0938] * 3)

    def angles(self, position: Array) -> tuple[Array, Array]:
        d = position - self.bases
        h = np.arccos(np.hypot(d[:, 0], d[:, 1]) / (2 * self.length))
        theta = np.arctan2(d[:, 1], d[:, 0]) + h
        return np.where(theta < 0, theta + 2 * np.pi, theta), -2 * h

    def dynamics(self, position: Array, velocity: Array) -> tuple[Array, Array, Array, Array]:
        theta, phi = self.angles(position)
        d = position - self.bases
        b = self.length * np.column_stack((np.cos(theta + phi), np.sin(theta + phi)))
        e = (self.length**2 * np.sin(phi))[:, None]
        W = np.vstack((b / e, -d / e))
        td, pd = (W @ velocity).reshape(2, 3)
        b_dot = (td + pd)[:, None] * np.column_stack((-b[:, 1], b[:, 0]))
        e_dot = (self.length**2 * np.cos(phi) * pd)[:, None]
        W_dot = np.vstack((b_dot / e - b * e_dot / e**2, -velocity / e + d * e_dot / e**2))
        c, s = np.diag(self.beta * np.cos(phi)), self.beta * np.sin(phi)
        g = np.diag(self.gamma)
        M = np.block([[np.diag(self.alpha) + 2 * c, g + c], [g + c, g]])
        C = np.block([[np.diag(-s * pd), np.diag(-s * (td + pd))], [np.diag(s * td), np.zeros((3, 3))]])
        return W.T @ M @ W, W.T @ M @ W_dot + W.T @ C @ W, W.T @ self.viscous @ W, W[:3]


@pytest.fixture(scope="session")
def textbook() -> Textbook:
    return Textbook()


@pytest.fixture(scope="session")
def situation(model):
    """A state and a reference beside it, from offsets of the plane's quantities."""

    def build(x=0.095, y=0.065, vx=0.2, vy=-0.1, ex=0.001, ey=-0.002, evx=0.03, evy=0.01, ax=5.0, ay=-3.0):
        position, velocity = np.array((x, y)), np.array((vx, vy))
        state = State(
            model.inverse_kinematics(position).theta, model.joint_rates(position, velocity)[:3], position, velocity
        )
        x_d, v_d = position + np.array((ex, ey)), velocity + np.array((evx, evy))
        q_d, qd_d = model.inverse_kinematics(x_d).theta, model.joint_rates(x_d, v_d)[:3]
        return state, Desired(x_d, v_d, np.array((ax, ay)), q_d, qd_d)

    return build


class Sample(NamedTuple):
    at_ns: int
    q: Array
    torque: Array
    complete: bool
    answered_ns: Array | None = None


class VirtualMachine:
    """Joints in virtual time: the model's own dynamics, exact encoders, an answer `answer_ns` after each sample.

    Torques keep acting until the next command. `stall` makes the clock jump once: {cycle: ns}.
    """

    def __init__(self, model: Manipulator, position: tuple[float, float] = HOME, *, answer_ns: int = 500_000) -> None:
        self.model = model
        self.position = np.array(position)
        self.velocity = np.zeros(2)
        self.torque = np.zeros(3)
        self.answer_ns = answer_ns
        self.now = 1_000_000_007
        self.stall: dict[int, int] = {}
        self.incomplete: set[int] = set()
        self.sampled: list[int] = []
        self.commanded: list[tuple[int, Array]] = []

    def now_ns(self) -> int:
        return self.now

    def sample(self, due_ns: int) -> Sample:
        k = len(self.sampled)
        self._advance(max(due_ns, self.now))
        at = self.now
        q = self.model.inverse_kinematics(self.position).theta
        self.sampled.append(at)
        self._advance(at + self.answer_ns + self.stall.pop(k, 0))
        first = np.nan if k in self.incomplete else self.answer_ns / 4
        answered = np.array([first, self.answer_ns / 2, self.answer_ns])
        return Sample(at, q, self.torque.copy(), k not in self.incomplete, answered)

    def command(self, tau_m: Array, due_ns: int) -> None:
        self._advance(max(due_ns, self.now))
        self.torque = tau_m.copy()
        self.commanded.append((self.now, self.torque))

    def _advance(self, to_ns: int) -> None:
        steps = -(-(to_ns - self.now) // 250_000)
        h = (to_ns - self.now) * 1e-9 / max(steps, 1)
        for _ in range(steps):
            self.position, self.velocity = self._runge_kutta(h)
        self.now = to_ns

    def _runge_kutta(self, h: float) -> tuple[Array, Array]:
        def rate(x: Array, v: Array) -> tuple[Array, Array]:
            return v, self.model.forward_dynamics(x, v, self.torque)

        x, v = self.position, self.velocity
        v1, a1 = rate(x, v)
        v2, a2 = rate(x + h / 2 * v1, v + h / 2 * a1)
        v3, a3 = rate(x + h / 2 * v2, v + h / 2 * a2)
        v4, a4 = rate(x + h * v3, v + h * a3)
        return x + h / 6 * (v1 + 2 * v2 + 2 * v3 + v4), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


@pytest.fixture
def machine(model: Manipulator) -> VirtualMachine:
    return VirtualMachine(model)


@pytest.fixture
def limits() -> Limits:
    return Limits(
        x=(0.07, 0.13),
        y=(0.04, 0.09),
        conditioning=0.1,
        joint_speed=15.0,
        position_error=0.010,
        torque=0.98,
        torque_stop=5.0,
    )


@pytest.fixture
def controller(model: Manipulator, limits: Limits) -> Callable[..., Controller]:
    """Puts a controller together: a law, and anything else than the defaults by keyword."""

    def build(law: Law, **other: Any) -> Controller:
        parts = {"model": model, "estimator": make_estimator("backward-difference", 3), "limits": limits} | other
        return Controller(law=law, **parts)

    return build


class Stopwatch:
    """Counts 1000 ns at every look."""

    def __init__(self) -> None:
        self.now = 0

    def __call__(self) -> int:
        self.now += 1000
        return self.now


@pytest.fixture
def stopwatch() -> Stopwatch:
    return Stopwatch()
