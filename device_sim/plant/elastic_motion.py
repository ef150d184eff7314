"""Kernels of the manipulator behind elastic gears: motors, springs and links apart, velocity Verlet from step to step.

Motor i stands at theta_m [rad at the joint] and turns with w; its gear is a spring and a damper to the joint angle
theta(X) of the links. Spring torque ts = K (theta_m - theta) + D (w - S v):

    I1 dw/dt = n tau_m - K1 w - f(w) - ts         each motor by itself
    Mt a + Ct v + Ft v = S' ts                    the links, without motor inertia and without K1
"""

from math import ceil, copysign
from typing import Final

from torquerig.device_sim.plant.motion import inside
from torquerig.device_sim.plant.motor import remaining_share
from torquerig.mechanism.compiled import compiled
from torquerig.mechanism.kernels import (
    GEAR,
    Floats,
    leg_angles,
    leg_at,
    leg_bias,
    leg_inertia,
    row_rates_of,
    rows_of,
)

Pair = tuple[float, float]
Triple = tuple[float, float, float]
Pulled = tuple[float, float, Triple]

# parameters e
INERTIA: Final = 0  # of a motor with its gear [kg·m² at the joint]
VISCOUS: Final = 1  # of a motor [N·m·s/rad at the joint]
COULOMB: Final = 2  # three [N·m at the joint]
BREAKAWAY: Final = 5
LAG: Final = 8  # [s]
STIFFNESS: Final = 9  # of a gear [N·m/rad at the joint]
DAMPING: Final = 10  # of a gear [N·m·s/rad at the joint]
STEP: Final = 11  # longest step [s]
PARAMETERS: Final = 12

# state s
ANGLE: Final = 0  # three motors [rad at the joint]
RATE: Final = 3  # exactly 0 while friction holds a motor
POSITION: Final = 6  # [m]
VELOCITY: Final = 8
TORQUE: Final = 10  # three, at the motor, after the lag [N·m]
DEMAND: Final = 13
STOPS: Final = 16  # times the links ran into the edge of their workspace
LEANING: Final = 17  # steps for which they still count as leaning against it
STATE: Final = 18

# a row of the truth's log: position, velocity, the links' theta, torque
SEEN: Final = 10

LEAN: Final = 100.0
"""Steps clear of the edge after which meeting it again is another stop, not the same lean."""


@compiled
def mean_torque(e: Floats, s: Floats, motor: int, h: float) -> float:
    """The mean of a motor's torque while it runs towards its demand for `h`, exact, which it then has run [N·m]."""
    change = s[TORQUE + motor] - s[DEMAND + motor]
    left = remaining_share(h, e[LAG])
    s[TORQUE + motor] = s[DEMAND + motor] + left * change
    mean: float = s[DEMAND + motor] + change * (1.0 - left) * e[LAG] / h
    return mean


@compiled
def rubbed(e: Floats, motor: int, rate: float, net: float, h: float) -> float:
    """A motor's rate after a torque [N·m at the joint] and dry friction for `h`; 0 is exact, and is left by breakaway.

    Friction never turns a motor round: it takes at most the rate that there is.
    """
    limit = e[BREAKAWAY + motor] if rate == 0.0 else e[COULOMB + motor]
    if rate == 0.0 and abs(net) <= limit:
        return 0.0
    free = rate + h * net / e[INERTIA]
    slowed: float = copysign(max(abs(free) - h * e[COULOMB + motor] / e[INERTIA], 0.0), free)
    return slowed


@compiled
def pull(p: Floats, e: Floats, s: Floats, rates: Triple, velocity: Pair) -> Pulled:
    """Acceleration of the links [m/s²] and torques of the springs [N·m], where everything is, at some velocities."""
    x, y = s[POSITION], s[POSITION + 1]
    vx, vy = velocity
    mxx = mxy = myy = fx = fy = 0.0
    springs = (0.0, 0.0, 0.0)
    for i in range(3):
        leg = leg_at(p, i, x, y)
        rows = rows_of(p, leg)
        xx, xy, yy = leg_inertia(p, i, leg, rows)
        bx, by = leg_bias(p, i, leg, rows, row_rates_of(p, leg, rows, vx, vy), vx, vy)
        wound = s[ANGLE + i] - leg_angles(p, i, x, y)[0]
        spring = e[STIFFNESS] * wound + e[DAMPING] * (rates[i] - (rows[0] * vx + rows[1] * vy))
        springs = (springs[1], springs[2], spring)
        mxx += xx
        mxy += xy
        myy += yy
        fx += spring * rows[0] - bx
        fy += spring * rows[1] - by
    determinant = mxx * myy - mxy * mxy
    return (myy * fx - mxy * fy) / determinant, (mxx * fy - mxy * fx) / determinant, springs


@compiled
def net_torques(p: Floats, e: Floats, torques: Triple, rates: Triple, springs: Triple) -> Triple:
    """What turns the motors but for dry friction [N·m at the joint]."""
    a = p[GEAR] * torques[0] - e[VISCOUS] * rates[0] - springs[0]
    b = p[GEAR] * torques[1] - e[VISCOUS] * rates[1] - springs[1]
    c = p[GEAR] * torques[2] - e[VISCOUS] * rates[2] - springs[2]
    return a, b, c


@compiled
def kick(p: Floats, e: Floats, s: Floats, h: float) -> None:
    """Changes the velocities of motors and links by what acts on them where they are, for `h`: the midpoint rule."""
    torques = (mean_torque(e, s, 0, h), mean_torque(e, s, 1, h), mean_torque(e, s, 2, h))
    a, b, c = s[RATE], s[RATE + 1], s[RATE + 2]
    vx, vy = s[VELOCITY], s[VELOCITY + 1]
    rates, velocity = (a, b, c), (vx, vy)
    for stage in range(2):  # a loop keeps the compiler's work half the size
        span = 0.5 * h if stage == 0 else h
        ax, ay, springs = pull(p, e, s, rates, velocity)
        net = net_torques(p, e, torques, rates, springs)
        rates = (rubbed(e, 0, a, net[0], span), rubbed(e, 1, b, net[1], span), rubbed(e, 2, c, net[2], span))
        velocity = (vx + span * ax, vy + span * ay)
    s[RATE], s[RATE + 1], s[RATE + 2] = rates
    s[VELOCITY], s[VELOCITY + 1] = velocity


@compiled
def drift(p: Floats, s: Floats, h: float) -> None:
    """Moves motors and links for `h`; at the edge of the workspace the links meet a rigid inelastic stop."""
    for i in range(3):
        s[ANGLE + i] += h * s[RATE + i]
    x, y = s[POSITION] + h * s[VELOCITY], s[POSITION + 1] + h * s[VELOCITY + 1]
    if inside(p, (x, y, s[VELOCITY], s[VELOCITY + 1])):
        s[POSITION], s[POSITION + 1] = x, y
        s[LEANING] = max(s[LEANING] - 1.0, 0.0)
    else:
        s[VELOCITY] = 0.0
        s[VELOCITY + 1] = 0.0
        s[STOPS] += 1.0 if s[LEANING] == 0.0 else 0.0
        s[LEANING] = LEAN


@compiled
def advance(p: Floats, e: Floats, s: Floats, seen: Floats, duration: float) -> None:
    """Carries the state over `duration` [s] at constant demands, and fills in the row that the truth's log gets."""
    if duration > 0.0:
        steps = ceil(duration / e[STEP])
        h = duration / steps
        for half in range(2 * steps):
            kick(p, e, s, 0.5 * h)
            if half % 2 == 0:
                drift(p, s, h)
    for i in range(4):
        seen[i] = s[POSITION + i]
    for i in range(3):
        seen[4 + i] = leg_angles(p, i, s[POSITION], s[POSITION + 1])[0]
        seen[7 + i] = s[TORQUE + i]
