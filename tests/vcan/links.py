"""Network links by rtnetlink: makes, deletes and switches CAN links with the standard library alone.

Raises OSError with the kernel's own error number: EOPNOTSUPP where it knows no such kind, EPERM without the right.
"""

import os
import socket
import struct
from typing import Final

NEW_LINK: Final = 16  # RTM_NEWLINK and the rest: linux/rtnetlink.h, linux/netlink.h, linux/if_link.h
DELETE_LINK: Final = 17
REQUEST_WITH_ACKNOWLEDGE: Final = 0x005
EXCLUSIVE_CREATE: Final = 0x600
NAME_ATTRIBUTE: Final = 3
INFO_ATTRIBUTE: Final = 18
INFO_KIND_ATTRIBUTE: Final = 1
FLAG_UP: Final = 1

HEADER: Final = struct.Struct("=IHHII")  # length, type, flags, sequence, port
LINK: Final = struct.Struct("=BxHiII")  # family, device type, index, flags, mask of the flags to change
ATTRIBUTE: Final = struct.Struct("=HH")  # length, type
ERROR: Final = struct.Struct("=i")


def add(name: str, kind: str = "vcan") -> None:
    """Makes the link, down at first; the kernel loads the kind's module by itself where it can."""
    information = _attribute(INFO_ATTRIBUTE, _attribute(INFO_KIND_ATTRIBUTE, kind.encode()))
    body = LINK.pack(0, 0, 0, 0, 0) + _attribute(NAME_ATTRIBUTE, name.encode() + b"\0") + information
    _request(NEW_LINK, EXCLUSIVE_CREATE, body, f"making the {kind} link {name}")


def delete(name: str) -> None:
    """Deletes the link under its users, as pulling an adapter does."""
    _request(DELETE_LINK, 0, LINK.pack(0, 0, socket.if_nametoindex(name), 0, 0), f"deleting the link {name}")


def switch(name: str, *, up: bool) -> None:
    """Takes the link up or down."""
    body = LINK.pack(0, 0, socket.if_nametoindex(name), FLAG_UP if up else 0, FLAG_UP)
    _request(NEW_LINK, 0, body, f"switching the link {name}")


def _attribute(kind: int, data: bytes) -> bytes:
    return ATTRIBUTE.pack(ATTRIBUTE.size + len(data), kind) + data + bytes(-len(data) % 4)


def _request(kind: int, flags: int, body: bytes, doing: str) -> None:
    """Sends one request and reads the kernel's answer, which is an error number, negative, or 0."""
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, socket.NETLINK_ROUTE) as netlink:
        netlink.bind((0, 0))
        netlink.send(HEADER.pack(HEADER.size + len(body), kind, REQUEST_WITH_ACKNOWLEDGE | flags, 1, 0) + body)
        (error,) = ERROR.unpack_from(netlink.recv(4096), HEADER.size)
    if error:
        raise OSError(-error, os.strerror(-error), doing)
