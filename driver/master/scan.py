"""Who is on the bus: node-ids, states, identities and names, without knowing anybody beforehand."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from torquerig.driver.bus.interface import Bus
from torquerig.driver.errors import NoAnswer
from torquerig.driver.master.pump import MILLISECOND_NS, SECOND_NS, Pump, PumpCounts, heartbeat_cob
from torquerig.driver.master.sdo_jobs import NUMBER_BYTES, Job, Patience, Pause, SdoService, Upload
from torquerig.driver.wire import cob, nmt
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.nmt import NmtState
from torquerig.driver.wire.sdo import SdoAbort

_SPACING_NS: Final = MILLISECOND_NS // 2  # 127 questions at once would overflow a send queue; CAN's is often 10 frames
_NAME_BYTES: Final = 1024  # far more than a table can show


@dataclass(frozen=True, slots=True)
class Identity:
    """What a node says it is; None for what it does not say.

    Attributes:
        device_type: 1000; the lower half 402 (0x192) marks a drive.
        vendor: 1018:1.
        product: 1018:2.
        revision: 1018:3.
        serial: 1018:4.
        name: Manufacturer device name, 1008.
    """

    device_type: int | None
    vendor: int | None
    product: int | None
    revision: int | None
    serial: int | None
    name: str | None


@dataclass(frozen=True, slots=True)
class ScannedNode:
    """A node that was heard.

    Attributes:
        node_id: Its node-id.
        state: Its NMT state by its heartbeat; None when it sends none.
        identity: What it says it is; None when it does not answer SDOs.
    """

    node_id: int
    state: NmtState | None
    identity: Identity | None


def scan(bus: Bus, *, answer_s: float = 0.2) -> list[ScannedNode]:
    """All nodes that answer SDOs or send a heartbeat, by rising node-id.

    Every node-id is asked at once, so that the answer takes no longer than one silent node.

    Args:
        bus: The bus.
        answer_s: How long a node may take to answer [s]; for as long heartbeats are listened for at least.

    Raises:
        BusError: The bus is gone.
    """
    return scan_with(Pump(bus), answer_s=answer_s)


def scan_with(pump: Pump, *, answer_s: float = 0.2) -> list[ScannedNode]:
    """As `scan`, with a pump that the caller keeps, and whose counts he may read."""
    states: dict[int, NmtState] = {}
    for node_id in cob.NODE_IDS:
        pump.handlers[heartbeat_cob(node_id)] = _listener(node_id, states, pump.counts)
    patience = Patience(answer_ns=round(answer_s * SECOND_NS), attempts=1)
    identities = SdoService(pump).run({node_id: _ask(node_id * _SPACING_NS) for node_id in cob.NODE_IDS}, patience)
    return [
        ScannedNode(node_id, states.get(node_id), identities[node_id])
        for node_id in cob.NODE_IDS
        if node_id in states or identities[node_id] is not None
    ]


def _listener(node_id: int, states: dict[int, NmtState], counts: PumpCounts) -> Callable[[int, bytes], None]:
    def hear(_at_ns: int, data: bytes) -> None:
        heartbeat = nmt.decode_heartbeat(Frame(heartbeat_cob(node_id), data))
        if heartbeat is None:
            counts.malformed += 1
        else:
            states[node_id] = heartbeat.state

    return hear


def _ask(delay_ns: int) -> Job[Identity | None]:
    """A job: what a node says it is, None when it is not there."""
    yield Pause(delay_ns)
    try:
        return Identity(
            device_type=(yield from _number(0x1000)),
            vendor=(yield from _number(0x1018, 1)),
            product=(yield from _number(0x1018, 2)),
            revision=(yield from _number(0x1018, 3)),
            serial=(yield from _number(0x1018, 4)),
            name=(yield from _name()),
        )
    except NoAnswer:
        return None


def _number(index: int, subindex: int = 0) -> Job[int | None]:
    try:
        return int.from_bytes((yield Upload(index, subindex, NUMBER_BYTES)), "little")
    except SdoAbort:
        return None


def _name() -> Job[str | None]:
    try:
        return (yield Upload(0x1008, max_bytes=_NAME_BYTES)).decode("latin-1").rstrip("\0")
    except SdoAbort:
        return None
