"""M and C derived anew: three two-link arms from their links' kinetic energies, without a formula of ours.

T is quadratic in the rates, so M comes by polarisation without any step; its derivatives by angle are taken with a
complex step, exact to rounding; C follows by Christoffel's symbols.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from torquerig.mechanism import Manipulator

THESIS = Manipulator.thesis()
STEP = 1e-30

angles = st.tuples(*[st.floats(-3.0, 3.0)] * 3)
rates = st.tuples(*[st.floats(-10.0, 10.0)] * 6)


def kinetic_energy(leg: int, phi: complex, theta_rate: float, phi_rate: float) -> complex:
    """Of one arm and its actuator, with theta = 0; the centres' velocities written out."""
    near, far, length = THESIS.proximal[leg], THESIS.distal[leg], THESIS.link_length
    turn = theta_rate + phi_rate
    vx = -far.centre * np.sin(phi) * turn
    vy = length * theta_rate + far.centre * np.cos(phi) * turn
    first = (near.inertia + near.mass * near.centre**2 + THESIS.actuator_inertia) * theta_rate**2
    return complex(0.5 * (first + far.mass * (vx * vx + vy * vy) + far.inertia * turn**2))


def inertia(leg: int, phi: complex) -> NDArray[np.complex128]:
    one, other, both = (kinetic_energy(leg, phi, *rate) for rate in ((1.0, 0.0), (0.0, 1.0), (1.0, 1.0)))
    return np.array([[2.0 * one, both - one - other], [both - one - other, 2.0 * other]])


def coriolis(leg: int, phi: float, theta_rate: float, phi_rate: float) -> NDArray[np.float64]:
    """Christoffel's symbols of the first kind, contracted with the rates; M depends on phi alone."""
    by_phi = inertia(leg, phi + 1j * STEP).imag / STEP
    gradient = np.stack([np.zeros((2, 2)), by_phi], axis=2)  # [row, column, by which angle]
    qd = np.array([theta_rate, phi_rate])
    symbols = 0.5 * (gradient + gradient.transpose(0, 2, 1) - gradient.transpose(2, 0, 1))
    matrix: NDArray[np.float64] = symbols @ qd
    return matrix


@given(angles)
def test_joint_inertia_is_the_hessian_of_kinetic_energy(phi: tuple[float, float, float]) -> None:
    M = THESIS.joint_inertia(phi)
    for leg in range(3):
        block = M[np.ix_([leg, leg + 3], [leg, leg + 3])]
        assert block == pytest.approx(inertia(leg, phi[leg]).real, rel=1e-12)


@given(angles, rates)
def test_joint_coriolis_is_made_of_christoffel_symbols(phi: tuple[float, float, float], qd: tuple[float, ...]) -> None:
    C = THESIS.joint_coriolis(phi, qd)
    for leg in range(3):
        block = C[np.ix_([leg, leg + 3], [leg, leg + 3])]
        expected = coriolis(leg, phi[leg], qd[leg], qd[leg + 3])
        assert block == pytest.approx(expected, rel=1e-9, abs=1e-15)


def test_legs_do_not_act_on_each_other() -> None:
    phi, qd = (-1.0, 0.5, 2.0), (1.0, 2.0, 3.0, -1.0, -2.0, -3.0)
    coupled = np.tile(np.eye(3, dtype=bool), (2, 2))
    for matrix in (THESIS.joint_inertia(phi), THESIS.joint_coriolis(phi, qd)):
        assert (matrix[~coupled] == 0.0).all()
