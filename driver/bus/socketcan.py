"""Whether a SocketCAN interface can be opened, told before python-can tries: its own words are a number."""

import socket
from pathlib import Path
from typing import Final

from torquerig.driver.errors import BusError, BusUrlError

_TYPE_CAN: Final = 280  # ARPHRD_CAN, linux/if_arp.h
_FLAG_UP: Final = 1  # IFF_UP, linux/if.h
_INTERFACES: Final = Path("/sys/class/net")


def check_interface(name: str, bitrate: int, interfaces: Path = _INTERFACES) -> None:
    """Return if the kernel has CAN and an interface of that name that is up.

    Args:
        name: The interface, such as `vcan0`.
        bitrate: For the advice how to bring it up [bit/s].
        interfaces: Where the kernel tells about its interfaces.

    Raises:
        BusUrlError: There is no such interface, or no CAN in the kernel.
        BusError: The interface is down.
    """
    make_vcan = (
        f"sudo modprobe vcan && sudo ip link add dev {name} type vcan && sudo ip link set up {name} "
        "makes a virtual one, and lockstep: needs nothing"
    )
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except (OSError, AttributeError):
        raise BusUrlError(f"socketcan:{name}: this machine's kernel has no CAN: {make_vcan}") from None
    about = interfaces / name
    if not about.exists():
        raise BusUrlError(f"socketcan:{name}: there is no CAN interface {name}: {make_vcan}")
    if int((about / "type").read_text(encoding="ascii")) != _TYPE_CAN:
        raise BusUrlError(f"socketcan:{name}: {name} is a network interface, but not for CAN: {make_vcan}")
    if not int((about / "flags").read_text(encoding="ascii"), 16) & _FLAG_UP:
        settings = "" if name.startswith("vcan") else f" type can bitrate {bitrate}"
        raise BusError(f"socketcan:{name}: {name} is down: sudo ip link set {name} up{settings} brings it up")
