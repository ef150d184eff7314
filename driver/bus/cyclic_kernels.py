"""A cycle's work, compiled, whatever the wire: system calls, numbers in and out of frames, without an object made.

Layouts of records come with the arguments' types. The C library's functions are called by name, with addresses as plain
integers. A signal ends a wait. Numbers are Linux's for 64 bits (bits/socket.h, bits/time.h, errno.h).
"""

from typing import Any, Final

import numba
import numpy as np

from torquerig.driver.bus.compiled import compiled

_numba: Final[Any] = numba  # it has no types
carray: Final = _numba.carray
_INT: Final = _numba.types.int32
_ADDRESS: Final = _numba.types.uintp
_external: Final = _numba.types.ExternalFunction
recvmmsg: Final[Any] = _external("recvmmsg", _INT(_INT, _ADDRESS, _numba.types.uint32, _INT, _ADDRESS))
sendmmsg: Final[Any] = _external("sendmmsg", _INT(_INT, _ADDRESS, _numba.types.uint32, _INT))
send: Final[Any] = _external("send", _numba.types.intp(_INT, _ADDRESS, _ADDRESS, _INT))
poll: Final[Any] = _external("poll", _INT(_ADDRESS, _numba.types.uint64, _INT))
ppoll: Final[Any] = _external("ppoll", _INT(_ADDRESS, _numba.types.uint64, _ADDRESS, _ADDRESS))
clock_gettime: Final[Any] = _external("clock_gettime", _INT(_INT, _ADDRESS))
errno_location: Final[Any] = _external("__errno_location", _numba.types.CPointer(_INT)())
_let_python_go: Final[Any] = _external("PyEval_SaveThread", _ADDRESS())
_have_python_back: Final[Any] = _external("PyEval_RestoreThread", _numba.types.void(_ADDRESS))

MSG_DONTWAIT: Final = 0x40
MSG_NOSIGNAL: Final = 0x4000
CLOCK_REALTIME: Final = 0
CLOCK_MONOTONIC: Final = 1
SOL_SOCKET: Final = 1
SO_TIMESTAMPNS: Final = 35  # asm-generic/socket.h
EINTR: Final = 4
EAGAIN: Final = 11
EPIPE: Final = 32
ECONNRESET: Final = 104
NS_PER_S: Final = 10**9
OFFSET_AGE_NS: Final = NS_PER_S  # NTP moves the epoch by ppm, or steps it
BATCH: Final = 16  # frames taken with one call
HEADER_SIZE: Final = 64  # struct mmsghdr
STAMP_SIZE: Final = 32  # struct cmsghdr and struct timespec
NO_ROW: Final = -1

# as in `cyclic`; here for the cache, which looks at files of kernels only: a test compares them
DONE: Final = 1
CHANGED: Final = 2
ODD: Final = 4
OTHER: Final = 8
NOT_A_NUMBER: Final = 16
EARLY: Final = 32
TAU: Final = 1
ANSWERED_NS: Final = 2


@compiled
def errno() -> int:
    """The C library's error number of this thread."""
    return int(carray(errno_location(), 1)[0])


@compiled
def read_clock(wire: Any, clock: int) -> int:  # noqa: ANN401
    """A clock [ns]."""
    clock_gettime(clock, wire.now_at)
    return int(wire.now[0] * NS_PER_S + wire.now[1])


@compiled
def rest(wire: Any, left_ns: int) -> int:  # noqa: ANN401
    """Wait until one of the polled descriptors has something, or some time; how many have, or less than 0: an error."""
    wire.now[0] = max(left_ns, 0) // NS_PER_S
    wire.now[1] = max(left_ns, 0) % NS_PER_S
    ready = ppoll(wire.polled_at, wire.polled_count, wire.now_at, 0)
    return -errno() if ready < 0 else int(ready)


@compiled
def rest_aside(wire: Any, left_ns: int) -> int:  # noqa: ANN401
    """As `rest`, from a kernel that is `brief`: others may run Python meanwhile."""
    thread = _let_python_go()
    ready = rest(wire, left_ns)
    _have_python_back(thread)
    return ready


@compiled
def wait_aside(wire: Any, until_ns: int) -> int:  # noqa: ANN401
    """As `rest_aside`, until a time, and a signal is no error."""
    ready = rest_aside(wire, until_ns - read_clock(wire, CLOCK_MONOTONIC))
    return 0 if ready == -EINTR else ready


@compiled
def batch_of(cycle: Any) -> int:  # noqa: ANN401
    """How many frames to ask for: those that are still to come, and any while nobody is to answer."""
    return min(cycle.unanswered + cycle.besides, BATCH) if cycle.open else BATCH


@compiled
def number(data: Any, place: Any) -> int:  # noqa: ANN401
    """A little-endian number in the data of a frame."""
    value = 0
    for k in range(place.size):
        value |= int(data[place.at + k]) << (8 * k)
    if place.signed and value >> (8 * place.size - 1) & 1:
        value -= 1 << (8 * place.size)
    return value


@compiled
def put_number(data: Any, at: int, size: int, value: int) -> None:  # noqa: ANN401
    """Write a little-endian number into the data of a frame."""
    for k in range(size):
        data[at + k] = value >> (8 * k) & 0xFF


@compiled
def hear(cycle: Any, at_ns: int, can_id: int, length: int, data: Any) -> bool:  # noqa: ANN401
    """Take an answer; False if it is none."""
    row = cycle.row_of[can_id]
    if row == NO_ROW:
        return False
    answer = cycle.answer[row]
    if length < answer.size:
        cycle.malformed += 1
        return True
    axis = answer.axis
    if answer.status.size:
        word = number(data, answer.status)
        if word != cycle.statusword[axis]:
            cycle.changed += 1
            cycle.news[axis] = 1
        cycle.statusword[axis] = word
    if answer.position.size:
        cycle.position[axis] = number(data, answer.position)
    if answer.torque.size:
        cycle.torque[axis] = number(data, answer.torque)
    if answer.answers:
        if not cycle.open:
            cycle.late += 1
        elif not cycle.answered[axis]:
            cycle.answered[axis] = 1
            cycle.told[ANSWERED_NS * cycle.axes + axis] = at_ns - cycle.sync_ns
            cycle.unanswered -= 1
    return True


@compiled
def begin(cycle: Any, now_ns: int) -> None:  # noqa: ANN401
    """Begin a cycle, whose SYNC is to go out now."""
    cycle.open = 1
    cycle.sync_ns = now_ns
    cycle.unanswered = cycle.axes
    for axis in range(cycle.axes):
        cycle.answered[axis] = 0
        cycle.told[ANSWERED_NS * cycle.axes + axis] = np.nan


@compiled
def told(cycle: Any) -> int:  # noqa: ANN401
    """What has been heard, in SI units, and as flags; ends the cycle when all have answered."""
    for axis in range(cycle.axes):
        scale = cycle.scale[axis]
        counts = cycle.torque[axis]
        cycle.told[axis] = cycle.position[axis] * scale.rad_per_count + scale.zero
        cycle.told[TAU * cycle.axes + axis] = scale.sign * counts / (scale.positive if counts >= 0 else scale.negative)
    flags = 0
    if cycle.open and cycle.unanswered == 0:
        cycle.open = 0
        flags |= DONE
    if cycle.changed:
        flags |= CHANGED
    if cycle.late or cycle.malformed:
        flags |= ODD
    return flags


@compiled
def encode(cycle: Any) -> bool:  # noqa: ANN401
    """Write wanted torques and controlwords into the commands; False, and nothing written, if one is no number."""
    for axis in range(cycle.axes):
        if np.isnan(cycle.wanted[axis]):
            return False
    for axis in range(cycle.axes):
        scale, target = cycle.scale[axis], cycle.target[axis]
        directed = scale.sign * cycle.wanted[axis]
        exact = directed * (scale.positive if directed >= 0 else scale.negative)
        counts = np.int64(min(max(np.rint(exact), scale.low), scale.high))
        put_number(cycle.command[target.torque_frame].data, target.torque.at, target.torque.size, counts)
        put_number(cycle.command[target.control_frame].data, target.control_at, 2, cycle.controlword[axis])
    return True
