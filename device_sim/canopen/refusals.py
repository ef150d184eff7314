"""What a node did not take from the bus, counted for all to see: object 2140 (of the manufacturer's range)."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final

from torquerig.device_sim.canopen.emergency import EmergencyConsumer
from torquerig.device_sim.canopen.error_control import ErrorControl
from torquerig.device_sim.canopen.object_store import ObjectStore, Source
from torquerig.device_sim.canopen.sdo_server import SdoServer

if TYPE_CHECKING:
    from torquerig.device_sim.canopen.node import CanopenNode

REFUSALS: Final = 0x2140
_MOST: Final = 0xFFFF_FFFF  # where the counters of the object stop

Count = Callable[[], int]


class Refusals:
    """The counters of one node since it was switched on first; no reset over the bus hides what came over the bus.

    In the object 2140 they stand in this order from sub-index 1 on. A dictionary without it does without it.
    """

    __slots__ = ("_counts",)

    def __init__(self, store: ObjectStore, counts: Mapping[str, Count]) -> None:
        self._counts = counts
        held = {entry.subindex for entry in store if entry.index == REFUSALS}
        for subindex, count in enumerate(counts.values(), start=1):
            if subindex in held:
                store.source(_source(count), REFUSALS, subindex)

    def counts(self) -> dict[str, int]:
        """How much was refused, ignored or malformed, by kind."""
        return {name: count() for name, count in self._counts.items()}


def refusals_of(
    node: "CanopenNode", sdo: SdoServer, error_control: ErrorControl, siblings: EmergencyConsumer
) -> Refusals:
    """The counters of a node and its services."""
    rpdos = node.pdos.rpdos
    return Refusals(
        node.store,
        {
            "refused in the NMT state": lambda: node.refused,
            "remote or extended": lambda: node.ignored + error_control.unanswered,
            "NMT malformed": lambda: node.nmt.malformed,
            "SDO malformed": lambda: sdo.malformed,
            "SDO refused": lambda: sdo.refused,
            "SDO aborted by the client": lambda: sdo.aborted,
            "SDO segment skipped": lambda: sdo.skipped,
            "SYNC of wrong length": lambda: node.sync.wrong_length,
            "heartbeat malformed": lambda: error_control.consumer.malformed,
            "emergency malformed": lambda: siblings.malformed,
            "RPDO too short": lambda: sum(rpdo.too_short for rpdo in rpdos),
            "RPDO too late": lambda: node.pdos.too_late,
            "RPDO value refused": lambda: sum(rpdo.refused for rpdo in rpdos),
            "emergency dropped": lambda: node.emergency.dropped,
        },
    )


def _source(count: Count) -> Source:
    return lambda _at_ns: min(count(), _MOST)
