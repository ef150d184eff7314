"""The kernel's own CAN, met with python-can and can-utils alone: what our bus over SocketCAN may rely on."""

import errno
import fcntl
import shutil
import socket
import struct
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import can
import links
import pytest
from forward import unavailable

pytestmark = pytest.mark.vcan

PATIENCE_S = 20.0
SIOCGIFFLAGS, SIOCGIFHWADDR = 0x8913, 0x8927  # linux/sockios.h
IFF_UP = 1
ARPHRD_CAN = 280
FRAMES = [can.Message(arbitration_id=0x181 + n, is_extended_id=False, data=bytes(range(n))) for n in range(9)]


def open_bus(channel: str = "vcan0") -> can.BusABC:
    return can.Bus(interface="socketcan", channel=channel)


def content(message: can.Message | None) -> tuple[int, bytes]:
    assert message is not None, "nothing came"
    return message.arbitration_id, bytes(message.data)


@pytest.fixture
def pair() -> Iterator[tuple[can.BusABC, can.BusABC]]:
    with open_bus() as sender, open_bus() as receiver:
        yield sender, receiver


@pytest.fixture
def link() -> Iterator[str]:
    """A link of the test's own, up, to be broken."""
    name = "broken0"
    links.add(name)
    links.switch(name, up=True)
    yield name
    if name in (each for _, each in socket.if_nameindex()):
        links.delete(name)


@pytest.mark.parametrize("name", ["vcan0", "vcan1"])
def test_link_is_a_can_and_up(name: str) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        flags = fcntl.ioctl(any_socket, SIOCGIFFLAGS, name.encode().ljust(32, b"\0"))
        address = fcntl.ioctl(any_socket, SIOCGIFHWADDR, name.encode().ljust(32, b"\0"))
    assert struct.unpack_from("H", flags, 16)[0] & IFF_UP
    assert struct.unpack_from("H", address, 16)[0] == ARPHRD_CAN


def test_frames_arrive_through_the_kernel_as_they_were_sent(pair: tuple[can.BusABC, can.BusABC]) -> None:
    sender, receiver = pair
    for frame in FRAMES:
        sender.send(frame)
    assert [content(receiver.recv(PATIENCE_S)) for _ in FRAMES] == [content(frame) for frame in FRAMES]


def test_remote_and_extended_frames_keep_their_kind(pair: tuple[can.BusABC, can.BusABC]) -> None:
    sender, receiver = pair
    sender.send(can.Message(arbitration_id=0x701, is_extended_id=False, is_remote_frame=True, dlc=1))
    sender.send(can.Message(arbitration_id=0x1ABCDEF5, is_extended_id=True, data=b"\x01"))
    remote, extended = receiver.recv(PATIENCE_S), receiver.recv(PATIENCE_S)
    assert remote is not None
    assert (remote.is_remote_frame, remote.is_extended_id, remote.dlc) == (True, False, 1)
    assert extended is not None
    assert (extended.is_remote_frame, extended.is_extended_id, extended.arbitration_id) == (False, True, 0x1ABCDEF5)


def test_sender_does_not_hear_itself_unless_it_asks(pair: tuple[can.BusABC, can.BusABC]) -> None:
    sender, receiver = pair
    with can.Bus(interface="socketcan", channel="vcan0", receive_own_messages=True) as vain:
        sender.send(FRAMES[1])
        vain.send(FRAMES[2])
        assert [content(vain.recv(PATIENCE_S)) for _ in range(2)] == [content(FRAMES[1]), content(FRAMES[2])]
        assert [content(receiver.recv(PATIENCE_S)) for _ in range(2)] == [content(FRAMES[1]), content(FRAMES[2])]
    assert content(sender.recv(PATIENCE_S)) == content(FRAMES[2])
    assert sender.recv(0) is None


def test_links_do_not_hear_each_other(pair: tuple[can.BusABC, can.BusABC]) -> None:
    sender, receiver = pair
    with open_bus("vcan1") as elsewhere:
        sender.send(FRAMES[1])
        assert content(receiver.recv(PATIENCE_S)) == content(FRAMES[1])
        assert elsewhere.recv(0) is None


def test_kernel_stamps_frames_in_order_between_sending_and_now(pair: tuple[can.BusABC, can.BusABC]) -> None:
    sender, receiver = pair
    stamps = [time.time()]
    for frame in FRAMES:
        sender.send(frame)
    sent = time.time()
    for _ in FRAMES:
        message = receiver.recv(PATIENCE_S)
        assert message is not None
        stamps.append(message.timestamp)
    stamps.append(sent)  # the kernel stamps a frame while it is sent, not when it is fetched
    assert stamps == sorted(stamps)


def test_filter_lets_through_what_it_names_and_nothing_else(pair: tuple[can.BusABC, can.BusABC]) -> None:
    sender, receiver = pair
    receiver.set_filters([{"can_id": 0x180, "can_mask": 0x7FC, "extended": False}])
    for frame in FRAMES:
        sender.send(frame)
    wanted = [content(frame) for frame in FRAMES if frame.arbitration_id & 0x7FC == 0x180]
    assert [content(receiver.recv(PATIENCE_S)) for _ in wanted] == wanted
    assert receiver.recv(0) is None


def listeners(link: str) -> int:
    """Number of sockets that hear the whole link, as the kernel counts them."""
    return sum(line.split()[0] == link for line in Path("/proc/net/can/rcvlist_all").read_text().splitlines() if line)


def test_candump_sees_what_is_sent() -> None:
    if shutil.which("candump") is None:
        unavailable("not run for want of candump (apt install can-utils)")
    before = listeners("vcan0")
    with ExitStack() as stack:
        bus = stack.enter_context(open_bus("vcan0"))
        bus.set_filters([{"can_id": 0, "can_mask": 0x7FF, "extended": False}])  # no listener to the whole link itself
        command = ["candump", "-L", "-n", str(len(FRAMES)), "vcan0"]
        dump = stack.enter_context(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
        stack.callback(dump.kill)
        until = time.monotonic() + PATIENCE_S
        while listeners("vcan0") == before:
            assert time.monotonic() < until, "candump does not listen"
            time.sleep(0.01)
        for frame in FRAMES:
            bus.send(frame)
        output, _ = dump.communicate(timeout=PATIENCE_S)
    seen = [line.split()[1:] for line in output.splitlines()]
    assert seen == [["vcan0", f"{frame.arbitration_id:03X}#{frame.data.hex().upper()}"] for frame in FRAMES]


def test_sending_on_a_link_that_is_down_raises_error_100_every_time(link: str) -> None:
    with open_bus(link) as bus:
        links.switch(link, up=False)
        for _ in range(3):
            with pytest.raises(can.CanOperationError) as raised:
                bus.send(FRAMES[1])
            assert raised.value.error_code == errno.ENETDOWN == 100


def test_receiving_on_a_link_that_is_down_raises_error_100_once_and_then_brings_nothing(link: str) -> None:
    with open_bus(link) as bus:
        links.switch(link, up=False)
        with pytest.raises(can.CanOperationError) as raised:
            bus.recv(PATIENCE_S)
        assert raised.value.error_code == errno.ENETDOWN
        assert bus.recv(0.1) is None  # so that a receiver which missed the one error waits for ever


def test_link_that_is_up_again_carries_frames_for_sockets_that_have_heard_of_it(link: str) -> None:
    with open_bus(link) as sender, open_bus(link) as receiver:
        links.switch(link, up=False)
        links.switch(link, up=True)
        with pytest.raises(can.CanOperationError):
            receiver.recv(PATIENCE_S)
        with pytest.raises(can.CanOperationError):
            sender.send(FRAMES[1])  # the error of a link that is down no more
        sender.send(FRAMES[2])
        assert content(receiver.recv(PATIENCE_S)) == content(FRAMES[2])


def test_sending_on_a_link_that_is_gone_raises_error_6_and_receiving_error_19(link: str) -> None:
    with open_bus(link) as bus:
        links.delete(link)
        with pytest.raises(can.CanOperationError) as raised:
            bus.recv(PATIENCE_S)
        assert raised.value.error_code == errno.ENODEV == 19
        with pytest.raises(can.CanOperationError) as raised:
            bus.send(FRAMES[1])
        assert raised.value.error_code == errno.ENXIO == 6
