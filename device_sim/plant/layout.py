"""Where things stand in the arrays that the manipulator plant's kernels share."""

from typing import Final

# parameters f
COULOMB: Final = 0  # three [N·m at the joint]
BREAKAWAY: Final = 3
LAG: Final = 6  # [s]
STEP: Final = 7  # longest step [s]
PARAMETERS: Final = 8

# state s
POSITION: Final = 0  # [m]
VELOCITY: Final = 2
TORQUE: Final = 4  # three, at the motor, after the lag [N·m]
DEMAND: Final = 7
SIGN: Final = 10  # three: +1 or -1 slides that way, 0 rests; three zeros: the machine is at rest
ELBOW: Final = 13  # where the elbow of the one resting joint stays while the others slide [m]
ANGLE: Final = 15  # theta of that joint [rad]
STOPS: Final = 16  # times the machine ran into the edge of its workspace
LEANING: Final = 17  # steps for which it still counts as leaning against the edge
EVENTS: Final = 18  # changes of mode since the last whole step
CAUTION: Final = 19  # share of a whole step that the next one may take
ROWS: Final = 20  # S where the machine rests, three rows of two [1/m]
STATE: Final = 26

# what is seen from outside
THETA_RATE: Final = 0  # three [rad/s]
TRUTH: Final = 3  # from here on a row of the truth's log: position [m], velocity [m/s],
THETA: Final = 7  # three [rad],
TORQUE_SEEN: Final = 10  # and three torques [N·m at the motor]
SEEN: Final = 13

# instead of a joint's index
NOBODY: Final = -1
ALL: Final = 3

CROWD: Final = 12.0
"""Events without a whole step between them, after which joints may only come to rest until a step is done."""

CAUTIOUS: Final = 1.0 / 16.0
"""Share of a whole step right after an event; it doubles from step to step. Events come in clusters, and one that a
joint takes back before the step's end is not seen."""

LEAN: Final = 100.0
"""Steps clear of the edge after which meeting it again is another stop, not the same lean."""
