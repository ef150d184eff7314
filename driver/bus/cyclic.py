"""Process data past the frame objects: what a bus may offer beside `Bus`, and the memory it shares with the master.

A cycle's frames are the same every time but for a few numbers. So whoever leads the cycle lays out once where these
stand (`Cycle`), and a bus that can (`CyclicBus`) moves them between the wire and that memory in compiled code, without
making an object: SYNC out, answers in and decoded, commands encoded and out. What is no process data stays frames, and
comes through the bus as always.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import MAX_DATA_LENGTH, Arrival, Frame

MOST_AXES: Final = 127
"""Node-ids that CANopen has."""
MOST_ANSWERS: Final = 2 * MOST_AXES
"""Two TPDOs a drive, as with the group RPDO."""
MOST_COMMANDS: Final = MOST_AXES + 1
"""An RPDO a drive, and one for all."""
BASE_IDS: Final = 0x800
"""How many identifiers of 11 bits there are."""
NOBODY: Final = -1

# what a port's methods return: any of these, together
DONE: Final = 1  # every axis has answered
CHANGED: Final = 2  # a statusword is another one
ODD: Final = 4  # frames were late or malformed: the memory counts them
OTHER: Final = 8  # frames wait that are no process data
NOT_A_NUMBER: Final = 16  # a target torque is none: nothing was sent
EARLY: Final = 32  # it is not yet time: nothing was sent

PLACE: Final = np.dtype([("at", "i8"), ("size", "i8"), ("signed", "i8")], align=True)
"""Where a number stands in the data of a frame: first byte, bytes (0: it is not there), whether it has a sign."""
ANSWER: Final = np.dtype(
    [("size", "i8"), ("axis", "i8"), ("answers", "i8"), ("status", PLACE), ("position", PLACE), ("torque", PLACE)],
    align=True,
)
"""A TPDO: its least length, whose it is, whether it is the answer to SYNC, and what it carries."""
COMMAND: Final = np.dtype([("can_id", "u4"), ("length", "i8"), ("data", "u1", (MAX_DATA_LENGTH,))], align=True)
"""An RPDO, whole."""
TARGET: Final = np.dtype(
    [("torque_frame", "i8"), ("torque", PLACE), ("control_frame", "i8"), ("control_at", "i8")], align=True
)
"""In which RPDOs, and where there, an axis' target torque and its controlword of 16 bits stand."""
SCALE: Final = np.dtype(
    [(name, "f8") for name in ("rad_per_count", "zero", "sign", "positive", "negative", "low", "high")], align=True
)
"""As `master.scale.AxisScale`."""
CYCLE: Final = np.dtype(
    [
        *((name, "i8") for name in ("axes", "besides", "commands", "open", "unanswered", "sync_ns")),
        *((name, "i8") for name in ("changed", "late", "malformed")),
        ("row_of", "i2", (BASE_IDS,)),
        ("answer", ANSWER, (MOST_ANSWERS,)),
        ("command", COMMAND, (MOST_COMMANDS,)),
        ("target", TARGET, (MOST_AXES,)),
        ("scale", SCALE, (MOST_AXES,)),
        *(
            (name, "i8", (MOST_AXES,))
            for name in ("answered", "news", "statusword", "controlword", "position", "torque")
        ),
        ("told", "f8", (3 * MOST_AXES,)),
        ("wanted", "f8", (MOST_AXES,)),
    ],
    align=True,
)
"""All of a cycle. Of the TPDOs that it takes `besides` are no answers to SYNC. `answer` is found by `row_of` its
COB-ID. By axis are what `answered` holds, whether it answered this SYNC, and the fields below: whether its statusword
is another one; its words and counts; what it told; and its wanted motor torque [N·m at the motor]. `told` is an array
of shape (3, axes), with rows Q, TAU and ANSWERED_NS: joint angle [rad], actual motor torque [N·m at the motor], how
long after SYNC [ns]. `changed` (how many have news), `news`, `late` and `malformed` count until they are cleared."""
Q: Final = 0
TAU: Final = 1
ANSWERED_NS: Final = 2


@dataclass(frozen=True, slots=True)
class Cycle:
    """A cycle's memory.

    Attributes:
        block: One record of `CYCLE`, shape (1,).
        sync: The SYNC frame.
        answer_ids: COB-IDs of the TPDOs that it takes.
    """

    block: NDArray[np.void]
    sync: Frame
    answer_ids: tuple[int, ...]

    def field(self, name: str, count: int | None = None) -> NDArray[Any]:
        """A field as a view, of its first entries where it has many."""
        view: NDArray[Any] = self.block[name]
        return view if count is None else view[0, :count]


class CyclicPort(Protocol):
    """A bus's end of a cycle. What its methods return are flags of this module, or less than 0: an error."""

    def sync(self, due_ns: int, look: bool, /) -> int:  # noqa: FBT001  (compiled code knows no keywords)
        """Send the SYNC and begin the cycle; only EARLY before `due_ns`, only OTHER if frames wait and `look` is set.

        Answers that came before the SYNC are counted as late. Never waits.
        """
        ...

    def take(self, until_ns: int, /) -> int:
        """Take answers; if nothing is new, wait for any frame until a time, and take what has come then."""
        ...

    def command(self, first: int, look: bool, /) -> int:  # noqa: FBT001
        """Encode wanted torques and controlwords and send the commands from the `first` on.

        Nothing is sent, and OTHER returned, if frames wait and `look` is set; NOT_A_NUMBER for a torque that is none.
        CHANGED and ODD tell of answers that came before.
        """
        ...

    def others(self) -> Sequence[Arrival]:
        """Return frames that wait and are no process data: some of them, none when there are none.

        Raises:
            BusError: The link is gone.
        """
        ...

    def error(self, flags: int) -> BusError:
        """What an error among the flags means."""
        ...


@runtime_checkable
class CyclicBus(Protocol):
    """What a `Bus` may be able to do besides."""

    def open_cyclic(self, cycle: Cycle) -> CyclicPort | None:
        """Return a port for a cycle, None if this bus has none; a port that was open before is closed.

        The cycle's answers may still come as frames, through `Bus.receive`: whatever waits there is handed out.

        Raises:
            BusError: The link is gone.
        """
        ...

    def close_cyclic(self) -> None:
        """Have all frames come through `Bus.receive` again; nothing if there is no port."""
        ...
