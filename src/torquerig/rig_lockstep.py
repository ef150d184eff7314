"""Simulated drives in simulated time, in the process and the thread of their only master."""

from typing import TYPE_CHECKING, Any, Final

from torquerig.assembly import build_simulation
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.driver.bus.interface import Bus
from torquerig.driver.bus.lockstep import LockstepBus
from torquerig.driver.bus.url import LOCKSTEP, open_bus
from torquerig.driver.wire.nmt import NmtState, decode_heartbeat
from torquerig.errors import ConfigurationError, RigError
from torquerig.rig_host import configuration_of, obey, truth_of
from torquerig.rig_orders import Answer, Begin, Begun, End, GoOn, Order, StandStill, Truth
from torquerig.simulator import SimulatorRecord, begin_record, truth_log

if TYPE_CHECKING:
    import can

BOOT_LIMIT_NS: Final = 1_000_000_000


class LockstepRig:
    """The drives of one rig behind a lockstep bus: time passes only while somebody waits at the bus."""

    def __init__(self) -> None:
        """Simulate nothing yet."""
        self._bus: Bus | None = None
        self._record: SimulatorRecord | None = None

    def ask(self, order: Order[Answer]) -> Answer:
        """Have an order carried out.

        Raises:
            ApplicationError, TorqueRigError: It cannot be.
        """
        answer: Answer = self._carry_out(order)
        return answer

    def member(self, begun: Begun) -> "can.BusABC":
        """The bus itself, whose time is simulated: there is no other member."""
        if not isinstance(self._bus, LockstepBus):
            raise RigError(f"the bus {begun.url} is closed")
        return self._bus

    def close(self) -> None:
        """Close the bus; may be called again."""
        if self._bus is not None:
            self._bus.close()

    def _carry_out(self, order: Order[Any]) -> Any:  # noqa: ANN401  (as the order has it)
        match order:
            case Begin():
                return self._begin(order)
            case End():
                return self._end()
            case StandStill():
                return None  # it does, unless somebody waits at the bus
            case GoOn():
                return 0
        return obey(order, self._simulation, self._network.intervene)

    def _begin(self, begin: Begin) -> Begun:
        """Switch the drives on, and let them boot."""
        url = begin.url or f"{LOCKSTEP}:"
        configuration = configuration_of(begin, url)
        settings = configuration.rig
        if begin.record is not None:
            self._record = begin_record(configuration, begin.record)
        log = self._record.truth if self._record else truth_log(configuration)
        self._simulation = build_simulation(configuration.simulated, log)
        self._network = SimulatedNetwork(self._simulation.devices, settings.bus.bitrate)
        tap = self._record.bus_log.tap if self._record else None
        self._bus = open_bus(url, bitrate=settings.bus.bitrate, tap=tap, wire=lambda: self._network)
        node_ids = tuple(self._simulation.devices.nodes)
        self._await_boot_ups(self._bus, set(node_ids))
        return Begun(url, settings.bus.bitrate, node_ids, 0)

    def _await_boot_ups(self, bus: Bus, missing: set[int]) -> None:
        """Wait until all drives have said their boot-up message."""
        while missing:
            arrival = bus.receive(BOOT_LIMIT_NS)
            if arrival is None:
                raise ConfigurationError(f"drives {sorted(missing)} have not booted after {BOOT_LIMIT_NS / 1e9:g} s")
            heard = decode_heartbeat(arrival.frame)
            if heard is not None and heard.state is NmtState.BOOT_UP:
                missing.discard(heard.node_id)

    def _end(self) -> Truth:
        """Write the record, and tell the whole truth."""
        if self._record is not None:
            self._record.write(origin_ns=0, lost=0)
        return truth_of(self._simulation)
