"""Kernels of a bare rotor: J dw/dt = tau - K w - friction, with friction that holds at rest."""

from math import copysign
from typing import Final

from torquerig.device_sim.plant.motor import crossing_time, remaining_share, step_length
from torquerig.mechanism.compiled import compiled
from torquerig.mechanism.kernels import Floats

# parameters f
INERTIA: Final = 0  # [kg·m²]
VISCOUS: Final = 1  # [N·m·s/rad]
COULOMB: Final = 2  # [N·m]
BREAKAWAY: Final = 3  # [N·m]
LAG: Final = 4  # [s]
STEP: Final = 5  # [s]

# a rotor's state r
ANGLE: Final = 0  # [rad]
RATE: Final = 1  # [rad/s]
TORQUE: Final = 2  # [N·m]
DEMAND: Final = 3  # [N·m]
SIGN: Final = 4  # +1 or -1: turns that way; 0: friction holds it
STATE: Final = 5

TRIALS: Final = 60


@compiled
def spun(f: Floats, r: Floats, h: float) -> tuple[float, float]:
    """Angle and rate after `h`, classic Runge-Kutta; the torques at the stages are exact."""
    change = r[TORQUE] - r[DEMAND]
    half = remaining_share(0.5 * h, f[LAG])
    drag = r[SIGN] * f[COULOMB]
    w1 = r[RATE]
    a1 = (r[TORQUE] - drag - f[VISCOUS] * w1) / f[INERTIA]
    w2 = r[RATE] + 0.5 * h * a1
    a2 = (r[DEMAND] + half * change - drag - f[VISCOUS] * w2) / f[INERTIA]
    w3 = r[RATE] + 0.5 * h * a2
    a3 = (r[DEMAND] + half * change - drag - f[VISCOUS] * w3) / f[INERTIA]
    w4 = r[RATE] + h * a3
    a4 = (r[DEMAND] + half * half * change - drag - f[VISCOUS] * w4) / f[INERTIA]
    angle = r[ANGLE] + h * (w1 + 2.0 * w2 + 2.0 * w3 + w4) / 6.0
    return angle, r[RATE] + h * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0


@compiled
def standstill(f: Floats, r: Floats, h: float, end: float) -> float:
    """When, within `h`, a rate that ends at `end` on the wrong side passes zero (Illinois' false position)."""
    before = 0.0
    after = h
    left = r[SIGN] * r[RATE]
    right = r[SIGN] * end
    for _ in range(TRIALS):
        trial = after - (after - before) * right / (right - left) if left > 0.0 else 0.5 * (before + after)
        if not before < trial < after:
            break
        here = r[SIGN] * spun(f, r, trial)[1]
        if here < 0.0:
            after, right, left = trial, here, 0.5 * left
        else:
            before, left, right = trial, here, 0.5 * right
    return after


@compiled
def spin(f: Floats, r: Floats, duration: float) -> None:
    """Carries a rotor's state over `duration` [s] at constant demand."""
    while duration > 0.0:
        breaks = False
        if r[SIGN] == 0.0:
            h = crossing_time(f[LAG], r[TORQUE], r[DEMAND], f[BREAKAWAY])
            breaks = h < duration
            h = min(duration, h)
        else:
            h = min(duration, step_length(f[STEP], f[LAG], abs(r[DEMAND] - r[TORQUE])))
            angle, rate = spun(f, r, h)
            if f[BREAKAWAY] > 0.0 and r[SIGN] * rate < 0.0:
                h = standstill(f, r, h, rate)
                angle = spun(f, r, h)[0]
                rate = r[SIGN] = 0.0
            r[ANGLE] = angle
            r[RATE] = rate
        r[TORQUE] = r[DEMAND] + remaining_share(h, f[LAG]) * (r[TORQUE] - r[DEMAND])
        duration -= h
        if breaks:
            r[SIGN] = copysign(1.0, r[TORQUE])


@compiled
def spin_all(f: Floats, rotors: Floats, duration: float) -> None:
    """Carries the states of several rotors, one a row, over `duration` [s] at constant demands."""
    for i in range(len(rotors)):
        spin(f, rotors[i], duration)
