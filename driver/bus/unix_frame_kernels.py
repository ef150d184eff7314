"""Frames in batches through the connections of the unix bus, compiled; records are `unix_connections.UNIX_WIRE`."""

from typing import Any, Final

from torquerig.driver.bus.compiled import brief, compiled
from torquerig.driver.bus.cyclic_kernels import poll, wait_aside
from torquerig.driver.bus.unix_kernels import PACKET_HEAD, REMOTE, unix_hear, unix_send

COMPANY: Final = 1 << 16  # newcomers are at the door, or members have left; nothing was sent
PARTED: Final = 1 << 17  # members have left; what was to be sent was


@compiled
def someone_left(wire: Any) -> bool:  # noqa: ANN401
    """Whether a peer has closed its end."""
    left = False
    for peer in range(wire.peers):
        left |= wire.gone[peer] != 0
    return left


@brief
def unix_frames_take(no_cycles: Any, wires: Any, until_ns: int) -> int:  # noqa: ANN401
    """Read what has come into the log; if there is nothing, wait for it until a time. How many frames, or COMPANY.

    The cycle is one without answers, so no frame is process data.
    """
    unix_hear(no_cycles, wires)
    wire = wires[0]
    if wire.logged:
        poll(wire.polled_at, 1, 0)  # newcomers must be let in also if the frames never end
    else:
        ready = wait_aside(wire, until_ns)
        if ready <= 0:
            return ready
        unix_hear(no_cycles, wires)
    return COMPANY if wire.polled[0].revents or someone_left(wire) else wire.logged


@brief
def unix_frames_send(wires: Any, first: int, count: int, look: bool) -> int:  # noqa: ANN401, FBT001
    """Send packets to all peers; COMPANY, and nothing sent, if newcomers wait and `look` is set; else 0 or PARTED."""
    wire = wires[0]
    if look and poll(wire.polled_at, 1, 0) > 0:
        return COMPANY
    for k in range(first, first + count):
        packet = wire.packet_out[k]
        wire.vector_out[k].size = PACKET_HEAD + (0 if packet.flags & REMOTE else packet.length)
    unix_send(wire, first, count, 0)
    return PARTED if someone_left(wire) else 0
