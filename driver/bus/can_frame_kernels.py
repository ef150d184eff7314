"""Frames in batches through a socket of the kernel's CAN, compiled; records are `kernel_can_frames.FRAMES_WIRE`.

System calls are most of the cost where there is no vDSO, as in a User-Mode Linux, and reading a clock is one there. So
nothing is asked that is known: what a wait's end tells about the time, and that frames follow each other.
"""

from typing import Any, Final

from torquerig.driver.bus.compiled import brief, compiled
from torquerig.driver.bus.cyclic_kernels import (
    CLOCK_MONOTONIC,
    CLOCK_REALTIME,
    EAGAIN,
    EINTR,
    HEADER_SIZE,
    MSG_DONTWAIT,
    NS_PER_S,
    OFFSET_AGE_NS,
    SO_TIMESTAMPNS,
    STAMP_SIZE,
    errno,
    poll,
    read_clock,
    recvmmsg,
    rest_aside,
    sendmmsg,
)

FRAME_SIZE: Final = 16  # struct can_frame
ERROR: Final = 0x2000_0000  # CAN_ERR_FLAG, linux/can.h
SO_RXQ_OVFL: Final = 40  # asm-generic/socket.h
EXTRAS_SIZE: Final = STAMP_SIZE + 24  # and struct cmsghdr with a count


@compiled
def believe(wire: Any, now_ns: int) -> None:  # noqa: ANN401
    """Measure anew what the epoch's clock is ahead of the monotonic one, if that was long ago or it was set back."""
    if now_ns > wire.offset_until_ns or now_ns < wire.latest_ns - OFFSET_AGE_NS:
        wire.offset_ns = read_clock(wire, CLOCK_REALTIME) - read_clock(wire, CLOCK_MONOTONIC)
        wire.offset_until_ns = read_clock(wire, CLOCK_MONOTONIC) + OFFSET_AGE_NS


@compiled
def look_at_clock(wire: Any) -> int:  # noqa: ANN401
    """The monotonic clock [ns]."""
    wire.seen_ns = read_clock(wire, CLOCK_MONOTONIC)
    believe(wire, wire.seen_ns)
    return int(wire.seen_ns)


@compiled
def time_of(wire: Any, k: int) -> int:  # noqa: ANN401
    """When a frame came, on the monotonic clock [ns]; on a wire times never run backwards."""
    extras, size = wire.extras[k], wire.header_in[k].control_size
    if size >= STAMP_SIZE and extras.stamp.kind == SO_TIMESTAMPNS:
        epoch_ns = extras.stamp.seconds * NS_PER_S + extras.stamp.nanoseconds
        believe(wire, epoch_ns - wire.offset_ns)  # whoever never waits looks at no clock
        wire.latest_ns = max(wire.latest_ns, epoch_ns - wire.offset_ns)
    if size >= EXTRAS_SIZE and extras.lost.kind == SO_RXQ_OVFL:
        wire.missed = extras.lost.count
    return int(wire.latest_ns)


@compiled
def read(wire: Any, descriptor: int) -> None:  # noqa: ANN401
    """Take what waits in a socket into the log; what is no frame is counted, and an error kept."""
    room = wire.most - wire.logged
    for k in range(room):
        wire.header_in[k].control_size = EXTRAS_SIZE
    got = recvmmsg(descriptor, wire.headers_in_at, room, MSG_DONTWAIT, 0)
    if got < 0 and errno() != EAGAIN and errno() != EINTR:
        wire.error = errno()
    for k in range(got):
        frame, at_ns = wire.frame_in[k], time_of(wire, k)
        if wire.header_in[k].size == FRAME_SIZE and frame.can_id & ERROR:
            wire.errors += 1
        elif wire.header_in[k].size != FRAME_SIZE or frame.length > frame.data.size:
            wire.malformed += 1
        else:
            entry = wire.log[wire.logged]
            entry.at_ns, entry.can_id, entry.length = at_ns, frame.can_id, frame.length
            for byte in range(frame.data.size):
                entry.data[byte] = frame.data[byte]
            wire.logged += 1


@compiled
def read_all(wire: Any, only_ready: bool) -> None:  # noqa: ANN401, FBT001
    """Take what waits in the sockets, in their order."""
    for place in range(wire.first, wire.polled_count):
        polled = wire.polled[place]
        if wire.logged < wire.most and (polled.revents or not only_ready):
            read(wire, polled.descriptor)


@compiled
def spin(wire: Any, until_ns: int) -> int:  # noqa: ANN401
    """Look until a socket has something, or a time has come; how many have."""
    ready = poll(wire.polled_at, wire.polled_count, 0)
    while ready == 0 and look_at_clock(wire) < until_ns:
        ready = poll(wire.polled_at, wire.polled_count, 0)
    return int(ready)


@compiled
def await_frames(wire: Any, until_ns: int) -> int:  # noqa: ANN401
    """Wait until a socket has something, or a time has come; how many have, or less than 0: an error."""
    ready = rest_aside(wire, until_ns - wire.spin_ns - wire.seen_ns)
    if ready == 0 and wire.spin_ns:
        ready = spin(wire, until_ns)
    elif ready == 0:
        wire.seen_ns = until_ns  # or later
    return int(ready)


@brief
def can_frames_take(wires: Any, until_ns: int) -> int:  # noqa: ANN401
    """Take what waits into the log; if there is nothing, wait for it until a time.

    Returns:
        How many frames; 0 once the time has come; less than 0: an error, also when a signal ended the wait.
    """
    wire = wires[0]
    wire.logged = 0
    while not wire.logged:
        if wire.error:
            number, wire.error = wire.error, 0
            return -int(number)
        is_past = until_ns <= wire.seen_ns or until_ns <= look_at_clock(wire)
        ready = 0 if is_past else await_frames(wire, until_ns)
        if ready < 0:
            return ready
        if is_past or ready > 0:
            read_all(wire, not is_past)
        if ready == 0 and not wire.logged and not wire.error:
            break
    return int(wire.logged)


@brief
def can_frames_send(wires: Any, count: int) -> int:  # noqa: ANN401
    """Send the first frames that are laid out; how many were, or less than 0: an error, and none was."""
    wire = wires[0]
    sent = 0
    while sent < count:
        more = sendmmsg(wire.sender, wire.headers_out_at + sent * HEADER_SIZE, count - sent, MSG_DONTWAIT)
        if more <= 0:
            return int(sent) if sent else -errno()
        sent += more
    return int(sent)
