"""Memory and constants of drives in steady operation, which compiled code works on: see `steady`.

Times are those of the simulation [ns]. The parts of a drive lend their fields in the order in which they stand here.
"""

from typing import Final

import numpy as np

WAITING: Final = 32  # targets that wait for their effect
NEVER_NS: Final = 1 << 62  # as in `devices`: a test compares them
NS_PER_S: Final = 1e9
US: Final = 1_000  # [ns]
LATENCY_MAXIMUM: Final = 0xFFFF  # of object 2100:4 [us]
MISSED_MAXIMUM: Final = 0xFFFF_FFFF  # of object 2120:3
TRIP_LOAD: Final = 1.0  # I2t of the rated torque, flowing for ever

DONE: Final = 0  # all has happened that was to
ADVANCE: Final = 1  # the machine is needed at `wanted_ns`
ASK: Final = 2  # values are needed that must be asked for, at `wanted_ns`
ASIDE: Final = 3  # something beside the cycle happens at `wanted_ns`
ALARM: Final = 4  # a deadline passes, or something happens that is neither of the cycle nor beside it
LEAVE: Final = 5  # what comes next is not regular

CONSTANT: Final = 0  # what a TPDO's number is: one that stays (as in `canopen.tpdo`),
POSITION: Final = 1  # 6064,
EDGES: Final = 2  # 6063,
VELOCITY: Final = 3  # 606C,
RAW_TORQUE: Final = 4  # 2077,
TORQUE: Final = 5  # 6077 and 6078,
ASKED: Final = 6  # or one to be asked for


def _whole(*names: str) -> list[tuple[str, str]]:
    return [(name, "i8") for name in names]


def _real(*names: str) -> list[tuple[str, str]]:
    return [(name, "f8") for name in names]


CLOCK: Final = np.dtype(_whole("power_on_ns", "last_sync_ns", "sample_time", "latency", "controlword"))
ENCODER: Final = np.dtype([*_real("counts_per_radian"), *_whole("edge", "shift")])
PATH: Final = np.dtype(
    [
        *_whole("raw", "permille", "offset", "by_permille"),
        *_real("gain_positive", "gain_negative", "counts_per_permille", "low", "high"),
        *_whole("limited"),
        *_real("demand", "torque"),
    ]
)
PROTECTION: Final = np.dtype(
    [*_real("rated", "overspeed", "overcurrent", "time_constant", "warmth", "load"), *_whole("warmed_ns")]
)
WATCHDOGS: Final = np.dtype(_whole("period_ns", "losses", "missed", "deadline_ns"))
NODE: Final = np.dtype(_whole("reaction_ns", "syncs", "heard_ns", "waiting"))
DRIVE: Final = np.dtype(
    [
        ("clock", CLOCK),
        ("encoder", ENCODER),
        ("path", PATH),
        ("protection", PROTECTION),
        ("watchdogs", WATCHDOGS),
        ("node", NODE),
    ]
)
"""A drive that follows its target."""

RPDO: Final = np.dtype(
    _whole("drive", "can_id", "size", "control_at", "raw_at", "permille_at", "event_ns", "deadline_ns", "received")
)
"""An RPDO that acts when it comes; where in it controlword and targets stand, -1 for nowhere."""

TPDO: Final = np.dtype(
    [*_whole("drive", "can_id", "length", "every", "first", "end", "syncs", "sent"), ("data", "u1", (8,))]
)
"""A TPDO that is sent with every so many SYNCs, which of the fields are its own, and whether it was sent."""

FIELD: Final = np.dtype(_whole("source", "at", "size", "value"))
"""A number in a TPDO: what it is (`CONSTANT` and the others), its place in the data, and the value of
one that is not computed there."""

EFFECT: Final = np.dtype([*_whole("at_ns"), *_real("target")])
"""A target that waits, and when it takes effect."""

HEARD: Final = np.dtype([("waits", "u1"), ("flags", "u1"), ("length", "u2"), ("can_id", "u4"), ("data", "u1", (8,))])
"""A frame that came: whether it is still to be heard, whether it is anything but an 11-bit data frame, its contents."""

SAID: Final = np.dtype([("can_id", "u4"), ("length", "u1"), ("data", "u1", (8,))], align=True)
"""A frame that a drive has sent."""

FLEET: Final = np.dtype(
    [
        *_whole("drives", "rpdos", "tpdos", "sync_id", "sync_length", "is_prompt"),
        *_whole("now_ns", "machine_ns", "asked_ns", "others_ns", "aside_ns", "wanted_ns", "next_ns"),
        *_whole("said"),
        *_real("gear"),
    ]
)
"""What all drives on a bus share: how far time has come, and how many frames they have said."""
