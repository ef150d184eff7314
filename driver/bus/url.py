"""Bus URLs: one string chooses what the frames go over.

lockstep:           simulated time inside this process; needs nothing
unix:FOLDER         real time between processes of this machine
socketcan:vcan0     the kernel's CAN
slcan-adapter:LINK  plays a serial CAN adapter itself; LINK becomes the serial port that a program or kernel opens
INTERFACE:CHANNEL   any other interface of python-can; what it needs besides a channel and a bit rate stands in
                    python-can's own configuration (~/.canrc, CAN_CONFIG)
"""

import difflib
from collections.abc import Callable
from pathlib import Path
from typing import Final

import can
from can.interfaces import VALID_INTERFACES
from can.interfaces.socketcan import SocketcanBus

from torquerig.driver.bus.clock import SPIN_NS, RealClock
from torquerig.driver.bus.cyclic_memory import SUPPORTED
from torquerig.driver.bus.interface import Bus, Tap
from torquerig.driver.bus.kernel_can import KernelCanBus
from torquerig.driver.bus.lockstep import LockstepBus, SimulatedWire
from torquerig.driver.bus.python_can import PythonCanBus
from torquerig.driver.bus.slcan import SlcanBus
from torquerig.driver.bus.socketcan import check_interface
from torquerig.driver.bus.unix import UnixBus
from torquerig.driver.bus.unix_member import UnixMemberBus
from torquerig.driver.errors import BusUrlError

LOCKSTEP: Final = "lockstep"
SLCAN_ADAPTER: Final = "slcan-adapter"
_EXAMPLES: Final = "lockstep:, unix:FOLDER, socketcan:vcan0 or another of python-can's as INTERFACE:CHANNEL"


def open_bus(
    url: str,
    *,
    bitrate: int,
    tap: Tap | None = None,
    wire: Callable[[], SimulatedWire] | None = None,
    spin_ns: int = SPIN_NS,
) -> Bus:
    """Return the bus that a URL names.

    Args:
        url: `lockstep:` or `INTERFACE:CHANNEL`; the channel may hold further colons.
        bitrate: For interfaces that set their own bit rate [bit/s]; the kernel's is set when it is brought up.
        tap: Is told every frame with its time [ns].
        wire: Makes what `lockstep:` simulates; without it that URL is refused.
        spin_ns: In real time, how long before its deadline a wait stops sleeping and spins [ns].

    Raises:
        BusUrlError: The URL names nothing that can be opened.
        BusError: The interface is down.
    """
    interface, colon, channel = url.partition(":")
    if not colon:
        raise BusUrlError(f"{url!r} is no bus URL, for want of a colon: {_EXAMPLES}")
    if interface == LOCKSTEP:
        if channel:
            raise BusUrlError(f"{url!r}: the lockstep bus has no channels; its URL is {LOCKSTEP}:")
        if wire is None:
            raise BusUrlError(
                f"{url!r} simulates inside one process, and there is nothing to simulate here: unix:FOLDER"
            )
        return LockstepBus(wire(), tap)
    if interface == SLCAN_ADAPTER and channel:
        return SlcanBus(Path(channel), bitrate=bitrate, tap=tap)
    opened = open_python_can(url, bitrate=bitrate)
    clock = RealClock(spin_ns)
    if isinstance(opened, SocketcanBus) and SUPPORTED:
        return KernelCanBus(opened, clock, tap, spin_ns=spin_ns)
    if isinstance(opened, UnixBus) and SUPPORTED:
        return UnixMemberBus(opened, clock, tap, spin_ns=spin_ns)
    return PythonCanBus(opened, clock, tap, spin_ns=spin_ns)


def open_python_can(url: str, *, bitrate: int) -> can.BusABC:
    """Return the bus that a URL of a real-time bus names, as python-can's programs use it.

    Args:
        url: `INTERFACE:CHANNEL`; the channel may hold further colons.
        bitrate: For interfaces that set their own bit rate [bit/s].

    Raises:
        BusUrlError: The URL names nothing that can be opened.
        BusError: The interface is down.
    """
    interface, _, channel = url.partition(":")
    known = VALID_INTERFACES | {"unix", SLCAN_ADAPTER}
    if interface not in known:
        near = ", ".join(difflib.get_close_matches(interface, [LOCKSTEP, *sorted(known)], n=3))
        hint = f"did you mean {near}?" if near else _EXAMPLES
        raise BusUrlError(f"{url!r}: there is no bus interface {interface!r}: {hint}")
    if not channel:
        raise BusUrlError(f"{url!r} names no channel: {interface}:CHANNEL")
    if interface == "socketcan":
        check_interface(channel, bitrate)
    try:
        if interface == "unix":
            return UnixBus(channel)
        return can.Bus(channel=channel, interface=interface, bitrate=bitrate)
    except Exception as error:  # makers' libraries raise what they like
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise BusUrlError(f"{url!r} cannot be opened: {reason}") from error
