"""What every service of a node stands on."""

from collections.abc import Callable
from dataclasses import dataclass

from torquerig.device_sim.canopen.object_store import ObjectStore
from torquerig.device_sim.canopen.timers import Timers
from torquerig.driver.wire.frame import Frame


@dataclass(frozen=True, slots=True)
class NodeTiming:
    """How long a node takes.

    Attributes:
        boot_ns: From a reset to the boot-up message.
        answer_ns: From an SDO or guarding request until the answer is ready.
        sample_ns: From SYNC (or another occasion) until the TPDO sampled then is ready.
        reaction_ns: From a write that SYNC did not release until the device acts on it.
        sdo_patience_ns: How long a client may be silent inside a block download before it is asked for the rest;
            below the 300 ms after which common masters give up.
    """

    boot_ns: int = 1_000_000
    answer_ns: int = 20_000
    sample_ns: int = 20_000
    reaction_ns: int = 50_000
    sdo_patience_ns: int = 200_000_000


@dataclass(frozen=True, slots=True)
class NodeCore:
    """The parts of a node that its services share.

    Attributes:
        node_id: CANopen node-id.
        store: The objects.
        timers: The alarms.
        send: Takes a frame and the time at which it is ready.
        timing: How long the node takes.
    """

    node_id: int
    store: ObjectStore
    timers: Timers
    send: Callable[[Frame, int], None]
    timing: NodeTiming
