"""A cycle's work on the sockets of the kernel's CAN, compiled; records are `kernel_can_port.CAN_WIRE`."""

from typing import Any, Final

from torquerig.driver.bus.compiled import brief, compiled
from torquerig.driver.bus.cyclic_kernels import (
    BATCH,
    CLOCK_MONOTONIC,
    CLOCK_REALTIME,
    EAGAIN,
    EARLY,
    EINTR,
    HEADER_SIZE,
    MSG_DONTWAIT,
    NOT_A_NUMBER,
    NS_PER_S,
    OFFSET_AGE_NS,
    OTHER,
    SO_TIMESTAMPNS,
    STAMP_SIZE,
    batch_of,
    begin,
    encode,
    errno,
    hear,
    poll,
    read_clock,
    recvmmsg,
    send,
    sendmmsg,
    told,
    wait_aside,
)

FRAME_SIZE: Final = 16  # struct can_frame


@compiled
def can_receive(wires: Any, most: int) -> int:  # noqa: ANN401
    """Take `most` frames or fewer from a socket of the kernel's CAN, with times on the monotonic clock; how many."""
    wire = wires[0]
    room = min(most, BATCH)
    for k in range(room):
        wire.header_in[k].control_size = STAMP_SIZE
    got = recvmmsg(wire.process, wire.headers_in_at, room, MSG_DONTWAIT, 0)
    if got < 0:
        return 0 if errno() in (EAGAIN, EINTR) else -errno()
    for k in range(got):
        stamp = wire.stamp[k]
        if wire.header_in[k].control_size >= STAMP_SIZE and stamp.kind == SO_TIMESTAMPNS:
            at_ns = stamp.seconds * NS_PER_S + stamp.nanoseconds - wire.offset_ns
            wire.latest_ns = max(wire.latest_ns, at_ns)  # on a wire times never run backwards
        wire.at_ns[k] = wire.latest_ns
    return got


@compiled
def can_hear(cycles: Any, wires: Any) -> int:  # noqa: ANN401
    """Take what waits in the socket of process data, of the kernel's CAN; in a cycle, until all have answered."""
    cycle, wire = cycles[0], wires[0]
    most = batch_of(cycle)
    got = most
    while got == most and most:
        got = can_receive(wires, most)
        if got < 0:
            return got
        for k in range(got):
            frame = wire.frame_in[k]
            known = frame.can_id < cycle.row_of.size and frame.length <= frame.data.size
            if not known or not hear(cycle, wire.at_ns[k], frame.can_id, frame.length, frame.data):
                cycle.malformed += 1
        if got == most:
            most = got = batch_of(cycle)
    return told(cycle)


@brief
def can_take(cycles: Any, wires: Any, until_ns: int) -> int:  # noqa: ANN401
    """Take answers; if nothing is new, wait for frames until a time, and take what has come then."""
    flags = can_hear(cycles, wires)
    wire = wires[0]
    if flags:
        return flags
    if wire.pending:
        return OTHER
    ready = wait_aside(wire, until_ns)
    if ready <= 0:
        return ready
    if wire.polled[1].revents:
        flags = can_hear(cycles, wires)
    return flags | OTHER if wire.polled[0].revents and flags >= 0 else flags


@brief
def can_sync(cycles: Any, wires: Any, due_ns: int, look: bool) -> int:  # noqa: ANN401, FBT001
    """Send the SYNC, unless it is too early or frames wait that are no process data."""
    cycle, wire = cycles[0], wires[0]
    now_ns = read_clock(wire, CLOCK_MONOTONIC)
    if now_ns < due_ns:
        return EARLY
    cycle.open = 0
    if wire.pending and look:
        return OTHER
    if poll(wire.polled_at, wire.polled_count, 0) > 0:
        if wire.polled[0].revents and look:
            return OTHER
        if wire.polled[1].revents:
            late = can_hear(cycles, wires)
            if late < 0:
                return late
    if now_ns > wire.offset_until_ns:
        wire.offset_ns = read_clock(wire, CLOCK_REALTIME) - read_clock(wire, CLOCK_MONOTONIC)
        wire.offset_until_ns = now_ns + OFFSET_AGE_NS
        now_ns = read_clock(wire, CLOCK_MONOTONIC)
    begin(cycle, now_ns)
    return 0 if send(wire.other, wire.sync_at, FRAME_SIZE, MSG_DONTWAIT) > 0 else -errno()


@brief
def can_command(cycles: Any, wires: Any, first: int, look: bool) -> int:  # noqa: ANN401, FBT001
    """Send the commands from the first on, unless frames wait that are no process data."""
    cycle, wire = cycles[0], wires[0]
    if look and (wire.pending or poll(wire.polled_at, 1, 0) > 0):
        return OTHER
    if not encode(cycle):
        return NOT_A_NUMBER
    for k in range(first, cycle.commands):
        for byte in range(8):
            wire.frame_out[k].data[byte] = cycle.command[k].data[byte]
    while first < cycle.commands:
        sent = sendmmsg(wire.other, wire.headers_out_at + first * HEADER_SIZE, cycle.commands - first, MSG_DONTWAIT)
        if sent <= 0:
            return -errno()
        first += sent
    return 0
