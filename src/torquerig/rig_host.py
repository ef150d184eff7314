"""The process of a simulated rig: it does what it is told over a pipe, until nobody is at the pipe's other end.

python -m torquerig.rig_host DESCRIPTOR
"""

import sys
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final, NoReturn

from torquerig.assembly import Simulation
from torquerig.buses import bus_urls, words_for
from torquerig.configuration import Configuration, load_configuration
from torquerig.device_sim.drive import Injection, SimulatedDrive
from torquerig.driver.errors import TorqueRigError
from torquerig.errors import ApplicationError, ConfigurationError, RigError
from torquerig.mechanism import MechanismError
from torquerig.rig_orders import Begin, Begun, End, GoOn, Inject, Order, PowerCycle, StandStill, TellTruth, Truth
from torquerig.simulator import RunningDrives, running_drives
from torquerig.stopping import Stopped, orderly_stop

ORIGIN: Final = "SimulatedRig"
ATTENTION_NS: Final = 10_000_000
"""How long the drives live between two looks at the pipe."""

_TOLD: Final = (ApplicationError, TorqueRigError, MechanismError)

Intervene = Callable[[int, Callable[[int], None]], None]
"""Does something to the drive of this node-id, which is told the time; as `RealTimeDevices.intervene`."""


def obey(order: Order[Any], simulation: Simulation, intervene: Intervene) -> object:
    """Carry out an order that is for the drives or the machine.

    Args:
        order: The order.
        simulation: The machine and its drives.
        intervene: How something is done to a drive.

    Returns:
        The answer.

    Raises:
        ConfigurationError: There is no such drive, or no such fault.
    """
    match order:
        case PowerCycle(node_ids):
            for drive in [_drive(simulation, each) for each in node_ids or simulation.devices.nodes]:
                intervene(drive.node_id, drive.power_cycle)
            return None
        case Inject(node_id, name):
            drive, fault = _drive(simulation, node_id), _fault(name)
            intervene(node_id, lambda at_ns: drive.inject(fault, at_ns))
            return None
        case TellTruth():
            return truth_of(simulation)
    raise RigError(f"the drives cannot {type(order).__name__} now")


def truth_of(simulation: Simulation) -> Truth:
    """What the machine really did so far."""
    assert simulation.machine.log is not None  # noqa: S101  (a rig always keeps one)
    return Truth(*simulation.machine.log.rows())


def configuration_of(begin: Begin, url: str) -> Configuration:
    """The configuration of a rig on a bus.

    Raises:
        ConfigurationError: It cannot be used, or has several buses.
    """
    configuration = load_configuration(begin.config, begin.settings(url), origin=ORIGIN)
    if len(urls := bus_urls(configuration.rig)) > 1:
        raise ConfigurationError(
            f"{ORIGIN} puts its drives on one bus, and axes.N.bus names {words_for(urls[1:])} beside it: leave that"
            " out, or use `torquerig sim`"
        )
    return configuration


class RigHost:
    """One rig after another, for whoever is at the other end of a pipe."""

    def __init__(self, connection: "Connection[Any, Any]") -> None:
        """Take a pipe's end."""
        self._connection = connection
        self._orders_are_open = False

    def serve(self) -> NoReturn:
        """Serve until nobody is there any more.

        Raises:
            EOFError, OSError: Then.
        """
        while True:
            order = self._connection.recv()
            if isinstance(order, Begin):
                self._serve_rig(order)
            else:
                self._connection.send(RigError(f"no drives are running: they cannot {type(order).__name__}"))

    def _serve_rig(self, begin: Begin) -> None:
        """Be the drives of one rig; what hinders them is told once at the beginning, or to every order after it."""
        self._orders_are_open = False
        try:
            self._connection.send(self._run(begin))
        except _TOLD as error:
            while self._orders_are_open and not isinstance(self._connection.recv(), End):
                self._connection.send(error)
            self._connection.send(error)

    def _run(self, begin: Begin) -> Truth:
        """Be the drives of one rig until the order to end, and return the answer to it."""
        with ExitStack() as stack:
            url = begin.url or f"unix:{_own_folder(stack)}"
            configuration = configuration_of(begin, url)
            running = stack.enter_context(running_drives(configuration, record=begin.record, keep_truth=True))
            running.devices.serve(ATTENTION_NS)
            if running.devices.lost:
                raise RigError(f"{url} takes no frames: the drives' boot-up messages are lost")
            node_ids = tuple(running.simulation.devices.nodes)
            begun = Begun(url, configuration.rig.bus.bitrate, node_ids, running.devices.origin_ns)
            self._orders_are_open = True
            self._connection.send(begun)
            self._attend(running)
            self._orders_are_open = False
        return truth_of(running.simulation)

    def _attend(self, running: RunningDrives) -> None:
        """Let the drives live, and do what is ordered, until the order to end."""
        while True:
            running.devices.serve(running.devices.now_ns + ATTENTION_NS)
            while self._connection.poll():
                order = self._connection.recv()
                if isinstance(order, End):
                    return
                if isinstance(order, StandStill):
                    self._stand_still(running)
                else:
                    self._connection.send(_answer(order, running))

    def _stand_still(self, running: RunningDrives) -> None:
        """Do what is ordered while the drives' time stands still, until the order to go on."""
        with running.devices.standing_still():
            self._connection.send(None)
            while not isinstance(order := self._connection.recv(), GoOn):
                self._connection.send(_answer(order, running))
        self._connection.send(running.devices.origin_ns)


def main(descriptor: int) -> int:
    """Serve at a pipe's end.

    Args:
        descriptor: Of the pipe's end, which is duplex and carries pickles.

    Returns:
        The exit code, 0: to be left alone is how this ends.
    """
    try:
        with orderly_stop():
            RigHost(Connection(descriptor)).serve()
    except (EOFError, BrokenPipeError, ConnectionResetError, Stopped):
        return 0


def _answer(order: Order[Any], running: RunningDrives) -> object:
    """What carrying out an order gives, be it an error of who gave it."""
    try:
        return obey(order, running.simulation, running.devices.intervene)
    except ApplicationError as error:
        return error


def _own_folder(stack: ExitStack) -> Path:
    """A folder for a bus, which is gone with the rig also when who ordered the rig was killed."""
    folder = tempfile.TemporaryDirectory(prefix="torquerig-", ignore_cleanup_errors=True)
    return Path(stack.enter_context(folder)) / "bus"


def _drive(simulation: Simulation, node_id: int) -> SimulatedDrive:
    """The drive with this node-id."""
    node = simulation.devices.nodes.get(node_id)
    if not isinstance(node, SimulatedDrive):
        raise ConfigurationError(f"there is no drive {node_id}: {', '.join(map(str, simulation.devices.nodes))}")
    return node


def _fault(name: str) -> Injection:
    """The fault of this name, hyphens for underscores."""
    names = {fault.name.lower().replace("_", "-"): fault for fault in Injection}
    if name not in names:
        raise ConfigurationError(f"there is no fault {name!r}: {', '.join(names)}")
    return names[name]


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1])))
