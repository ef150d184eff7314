"""Opens several buses as one: simulated wires that share a time, or real-time buses that can be waited for together."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Final

from torquerig.device_sim.devices import SimulatedDevices
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.device_sim.wires import SimulatedWires
from torquerig.driver.bus.interface import Bus, Tap
from torquerig.driver.bus.lockstep import LockstepBus
from torquerig.driver.bus.merged import Waitable, WaitForAny
from torquerig.driver.bus.patient import PatientBus
from torquerig.driver.bus.several import SeveralBuses
from torquerig.driver.bus.url import open_bus
from torquerig.driver.errors import BusUrlError
from torquerig.driver.wire.frame import Frame

ELSEWHERE: Final = 0
"""The bus of what is no drive of a leg, such as the torque transducer: that of `bus.url`."""

TapOf = Callable[[int], Tap | None]
"""Gives the tap of a bus, by its place."""


@dataclass(slots=True)
class PatientTaps:
    """Taps of several buses in the time of the patient bus that stands before them all, and is made after them.

    Attributes:
        tap_of: Gives each bus's tap.
        bus: The patient bus; None while there is none.
    """

    tap_of: TapOf
    bus: PatientBus | None = None

    def of(self, place: int) -> Tap | None:
        """A tap that is told a bus's own time, and tells the patient one."""
        tap = self.tap_of(place)

        def shifted(at_ns: int, frame: Frame) -> None:
            assert tap is not None  # noqa: S101  (or nobody calls this)
            tap(at_ns - (self.bus.stood_still_ns if self.bus else 0), frame)

        return None if tap is None else shifted


def devices_by_bus(devices: SimulatedDevices, homes: Mapping[int, int], buses: int) -> list[SimulatedDevices]:
    """Simulated devices in a group for each bus; they are no longer to be used together.

    Args:
        devices: All of them.
        homes: The place of each drive's bus, by node-id.
        buses: How many there are.
    """
    nodes = devices.nodes.values()
    return [
        SimulatedDevices(node for node in nodes if homes.get(node.node_id, ELSEWHERE) == place)
        for place in range(buses)
    ]


def open_wires(
    groups: Sequence[SimulatedDevices], homes: Mapping[int, int], bitrate: int, tap_of: TapOf
) -> SeveralBuses:
    """The master's ends of a simulated wire for each group of devices, as one bus.

    Args:
        groups: The devices on each wire; they may share a machine.
        homes: The place of each drive's wire, by node-id.
        bitrate: Of each wire [bit/s].
        tap_of: Gives each wire's tap.
    """
    wires = SimulatedWires([SimulatedNetwork(group, bitrate) for group in groups])
    members = [LockstepBus(end, tap_of(place)) for place, end in enumerate(wires.ends)]
    return SeveralBuses(members, homes, wires.advance)


def open_real_time(
    urls: Sequence[str], homes: Mapping[int, int], bitrate: int, tap_of: TapOf, *, spin_ns: int
) -> SeveralBuses:
    """Real-time buses as one.

    Args:
        urls: The buses.
        homes: The place of each drive's bus, by node-id.
        bitrate: As for `open_bus` [bit/s].
        tap_of: Gives each bus's tap.
        spin_ns: As for `open_bus` [ns].

    Raises:
        BusUrlError: A URL names nothing that can be opened, or not as one of several.
        BusError: An interface is down.
    """
    with ExitStack() as stack:
        members: list[Bus] = []
        for place, url in enumerate(urls):
            member = open_bus(url, bitrate=bitrate, tap=tap_of(place), spin_ns=spin_ns)
            stack.callback(member.close)
            members.append(member)
        waitable = waitable_ones(members, urls)
        several = SeveralBuses(members, homes, WaitForAny(waitable, members[0].now_ns, spin_ns=spin_ns))
        stack.pop_all()
    return several


def waitable_ones(members: Sequence[Bus], urls: Sequence[str]) -> list[Waitable]:
    """The buses as what can be waited for together.

    Raises:
        BusUrlError: One cannot be.
    """
    found: list[Waitable] = []
    for member, url in zip(members, urls, strict=True):
        try:
            if isinstance(member, Waitable) and member.fileno() >= 0:
                found.append(member)
                continue
        except NotImplementedError:  # how python-can's interfaces say so
            pass
        raise BusUrlError(
            f"{url!r} cannot be one of several buses: its interface cannot be waited for together with others, which"
            " unix: and socketcan: can"
        )
    return found
