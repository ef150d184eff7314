"""A cycle's work on the connections of the unix bus, compiled; records are `unix_connections.UNIX_WIRE`."""

from typing import Any, Final

import numpy as np

from torquerig.driver.bus.compiled import brief, compiled
from torquerig.driver.bus.cyclic_kernels import (
    BATCH,
    CHANGED,
    CLOCK_MONOTONIC,
    EAGAIN,
    EARLY,
    ECONNRESET,
    EINTR,
    EPIPE,
    HEADER_SIZE,
    MSG_DONTWAIT,
    MSG_NOSIGNAL,
    NOT_A_NUMBER,
    ODD,
    OTHER,
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

# as in `unix_packet`: a test compares them
MAGIC: Final = 0x014E4143
PACKET_HEAD: Final = 24
EXTENDED: Final = 1
REMOTE: Final = 2
ERROR: Final = 4
SEQUENCE_MASK: Final = 0xFFFF_FFFF
UNKNOWN: Final = -1

PROCESS: Final = 0  # kinds of what is logged: process data, handled already
FOREIGN: Final = 1  # and other frames


@compiled
def is_frame(packet: Any, size: int) -> bool:  # noqa: ANN401
    """Whether a packet is one of this format, as `unix_packet.decode` sees it."""
    if size < PACKET_HEAD or packet.magic != MAGIC or packet.length > packet.data.size:
        return False
    flags = packet.flags
    if flags > ERROR | EXTENDED or flags == ERROR | REMOTE:
        return False
    highest = 0x1FFF_FFFF if flags & EXTENDED else 0x7FF
    carried = 0 if flags & REMOTE else packet.length
    return size == PACKET_HEAD + carried and packet.can_id <= highest


@compiled
def log_packet(wire: Any, packet: Any, at_ns: int, kind: int) -> None:  # noqa: ANN401
    """Keep a frame for whoever has more time."""
    entry = wire.log[wire.logged]
    entry.at_ns, entry.kind, entry.can_id = at_ns, kind, packet.can_id
    entry.flags, entry.length = packet.flags, packet.length
    for byte in range(packet.data.size):
        entry.data[byte] = packet.data[byte]
    wire.logged += 1


@compiled
def hear_packet(cycle: Any, wire: Any, peer: int, packet: Any, now_ns: int) -> None:  # noqa: ANN401
    """Take a frame of a peer: process data into the cycle, others into the log."""
    if wire.expected[peer] != UNKNOWN:
        wire.missed += (np.int64(packet.sequence) - wire.expected[peer]) & SEQUENCE_MASK
    wire.expected[peer] = (np.int64(packet.sequence) + 1) & SEQUENCE_MASK
    sent_ns = min(np.int64(packet.sent_ns), now_ns)
    at_ns = max(wire.latest_ns, sent_ns)
    wire.latest_ns = at_ns
    process = packet.flags == 0 and hear(cycle, at_ns, packet.can_id, packet.length, packet.data)
    if not process:
        wire.pending += 1
    if wire.tapped or not process:
        log_packet(wire, packet, sent_ns, PROCESS if process else FOREIGN)  # peers' are put in order later


@compiled
def unix_hear(cycles: Any, wires: Any) -> int:  # noqa: ANN401
    """Take what waits in all connections, as far as the log has room; in a cycle, until all have answered."""
    cycle, wire = cycles[0], wires[0]
    now_ns = read_clock(wire, CLOCK_MONOTONIC)
    for peer in range(wire.peers):
        most = batch_of(cycle)
        got = most
        while got == most and most and wire.logged + BATCH <= wire.log.size and not wire.gone[peer]:
            got = recvmmsg(wire.polled[1 + peer].descriptor, wire.headers_in_at, most, MSG_DONTWAIT, 0)
            if got < 0 and errno() not in (EAGAIN, EINTR):
                wire.gone[peer] = 1
            for k in range(got):
                packet, size = wire.packet_in[k], wire.header_in[k].size
                if size == 0:
                    wire.gone[peer] = 1
                    break
                if is_frame(packet, size):
                    hear_packet(cycle, wire, peer, packet, now_ns)
                else:
                    wire.malformed += 1
            if got == most:
                most = got = batch_of(cycle)
        wire.pending += wire.gone[peer]
    wire.pending += wire.logged + BATCH > wire.log.size
    flags = told(cycle)
    return flags | OTHER if wire.pending else flags


@brief
def unix_take(cycles: Any, wires: Any, until_ns: int) -> int:  # noqa: ANN401
    """Take answers; if nothing is new, wait for frames until a time, first by spinning, and take what has come then."""
    wire = wires[0]
    spins_until_ns = min(read_clock(wire, CLOCK_MONOTONIC) + wire.spin_ns, until_ns)
    flags = unix_hear(cycles, wires)
    while not flags and read_clock(wire, CLOCK_MONOTONIC) < spins_until_ns:
        flags = unix_hear(cycles, wires)
    if flags:
        return flags
    ready = wait_aside(wire, until_ns)
    if ready <= 0:
        return ready
    flags = unix_hear(cycles, wires)
    return flags | OTHER if wire.polled[0].revents else flags


@compiled
def unix_send(wire: Any, first: int, count: int, tapped: int) -> None:  # noqa: ANN401
    """Send packets to all peers, and log them if tapped. What a peer cannot take is counted, and that it left."""
    now_ns = read_clock(wire, CLOCK_MONOTONIC)
    for k in range(first, first + count):
        packet = wire.packet_out[k]
        packet.sequence, packet.sent_ns = wire.sent & SEQUENCE_MASK, now_ns
        wire.sent = (wire.sent + 1) & SEQUENCE_MASK
        if tapped and wire.logged < wire.log.size:
            log_packet(wire, packet, now_ns, PROCESS)
    for peer in range(wire.peers):
        descriptor = wire.polled[1 + peer].descriptor
        if count == 1:  # `send` costs a fifth less then
            vector = wire.vector_out[first]
            done = min(send(descriptor, vector.base, vector.size, MSG_DONTWAIT | MSG_NOSIGNAL), 1)
        else:
            done = sendmmsg(descriptor, wire.headers_out_at + first * HEADER_SIZE, count, MSG_DONTWAIT | MSG_NOSIGNAL)
        if done < 0 and errno() in (EPIPE, ECONNRESET):
            wire.gone[peer] = 1
        else:
            wire.not_taken[peer] += count - max(done, 0)


@brief
def unix_sync(cycles: Any, wires: Any, due_ns: int, look: bool) -> int:  # noqa: ANN401, FBT001
    """Send the SYNC, unless it is too early or frames or newcomers wait that are no process data."""
    cycle, wire = cycles[0], wires[0]
    now_ns = read_clock(wire, CLOCK_MONOTONIC)
    if now_ns < due_ns:
        return EARLY
    cycle.open = 0
    if poll(wire.polled_at, wire.polled_count, 0) > 0:
        others = unix_hear(cycles, wires) & OTHER or wire.polled[0].revents
        if others and look:
            return OTHER
    begin(cycle, now_ns)
    unix_send(wire, wire.packet_out.size - 1, 1, wire.tapped)
    return 0


@brief
def unix_command(cycles: Any, wires: Any, first: int, look: bool) -> int:  # noqa: ANN401, FBT001
    """Send the commands from the first on, unless frames or newcomers wait that are no process data.

    Returns:
        What has been heard meanwhile, too.
    """
    cycle, wire = cycles[0], wires[0]
    heard = 0
    if look and poll(wire.polled_at, wire.polled_count, 0) > 0:
        heard = unix_hear(cycles, wires) & (OTHER | CHANGED | ODD)
        if heard & OTHER or wire.polled[0].revents:
            return heard | OTHER
    if not encode(cycle):
        return NOT_A_NUMBER
    for k in range(first, cycle.commands):
        for byte in range(8):
            wire.packet_out[k].data[byte] = cycle.command[k].data[byte]
    unix_send(wire, first, cycle.commands - first, wire.tapped)
    return int(heard)
