"""The cycle's own way through the unix bus: its connections, read and written by compiled code.

There are no filters here: process data and all the rest come through the same connections. So what is no process data
is kept, in its order and with its time, for whoever handles frames; and if somebody wants the log, process data too.
"""

from collections.abc import Callable, Sequence

from torquerig.driver.bus import unix_kernels
from torquerig.driver.bus.compiled import bind
from torquerig.driver.bus.cyclic import Cycle
from torquerig.driver.bus.unix_connections import SYNC_PLACE, UnixConnections
from torquerig.driver.errors import BusError
from torquerig.driver.wire.frame import Arrival


class UnixPort:
    """A cycle's port on a member of the unix bus; satisfies `CyclicPort`.

    Attributes:
        others: Returns frames that are no process data; takes in newcomers, and lets go who left.
    """

    def __init__(
        self, connections: UnixConnections, cycle: Cycle, *, tapped: bool, others: Callable[[], Sequence[Arrival]]
    ) -> None:
        """Lay the packets out; nothing is sent.

        Args:
            connections: The member's connections, with no other port on them.
            cycle: The cycle.
            tapped: Whether somebody wants the log.
            others: As the attribute.
        """
        self.others = others
        self._member = connections.member
        self._wire = connections.wire
        self._wire["tapped"] = tapped
        self._address(SYNC_PLACE, cycle.sync.can_id, 0)
        for number, command in enumerate(cycle.field("command")[0]):
            self._address(number, command["can_id"], int(command["length"]))
        records = cycle.block, self._wire
        self.sync = bind(unix_kernels.unix_sync, *records, scalars=("int64", "boolean"))
        self.take = bind(unix_kernels.unix_take, *records, scalars=("int64",))
        self.command = bind(unix_kernels.unix_command, *records, scalars=("int64", "boolean"))

    def error(self, flags: int) -> BusError:
        """What an error among the flags means: nothing that can come from a connection; waiting may fail."""
        return BusError(f"cannot wait on the {self._member.channel_info}: error {-flags}")

    def close(self) -> None:
        """Have nothing logged any more that frames are not made of."""
        self._wire["tapped"] = 0

    def _address(self, number: int, can_id: int, length: int) -> None:
        """Lay out a packet to be sent."""
        record = self._wire[0]
        packet = record["packet_out"][number]
        packet["can_id"], packet["length"] = can_id, length
        record["vector_out"][number]["size"] = unix_kernels.PACKET_HEAD + length
