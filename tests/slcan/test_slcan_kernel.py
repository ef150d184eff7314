"""The kernel's own driver for serial adapters makes a CAN link of ours: line discipline, slcand, ip link."""

import errno
import fcntl
import os
import shutil
import signal
import socket
import struct
import subprocess
import termios
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import can
import canopen
import links
import pytest
from adapter_host import PATIENCE_S, look, served, simulated_drives, take
from forward import unavailable

from torquerig.driver.bus.slcan import SlcanBus
from torquerig.driver.bus.slcan_adapter import Channel
from torquerig.driver.wire.frame import Frame

pytestmark = pytest.mark.vcan

N_SLCAN = 17  # linux/tty.h
SIOCGIFNAME = 0x8910  # linux/sockios.h, here of the terminal: the link that its line discipline made
NODE_IDS = [1, 2, 3]
FRAMES = [
    Frame(0x000),
    Frame(0x7FF, bytes(range(0xF8, 0x100))),
    Frame(0x701, bytes(1), remote=True),
    Frame(0x1FFFFFFF, b"\xff" * 8, extended=True),
    Frame(0x18FF0102, bytes(8), remote=True, extended=True),
]


@pytest.fixture(autouse=True)
def _kernel_of_our_own() -> None:
    if "User Mode Linux" not in Path("/proc/cpuinfo").read_text():
        pytest.skip(
            "not run for want of User-Mode Linux: a serial adapter's link appears among the machine's own links"
        )


def program(name: str, package: str) -> str:
    found = shutil.which(name, path=f"{os.environ['PATH']}:/usr/sbin:/sbin")
    return found or unavailable(f"not run for want of {name} (apt install {package})")


def has_link(name: str) -> bool:
    return name in (each for _, each in socket.if_nameindex())


def await_link(name: str, serve: Callable[[], object], *, there: bool) -> None:
    await_true(lambda: has_link(name) is there, serve)


def await_true(condition: Callable[[], object], serve: Callable[[], object]) -> None:
    until = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < until, "waited in vain"
        serve()


@contextmanager
def attached(port: Path, setting_up: bytes = b"C\rS8\rO\r") -> Iterator[str]:
    """The port under the kernel's driver as slcan_attach puts it there; yields the link's name, which is up."""
    descriptor = os.open(port, os.O_RDWR | os.O_NOCTTY)
    try:
        os.write(descriptor, setting_up)
        fcntl.ioctl(descriptor, termios.TIOCSETD, struct.pack("i", N_SLCAN))
        name = fcntl.ioctl(descriptor, SIOCGIFNAME, bytes(40)).partition(b"\0")[0].decode()
        links.switch(name, up=True)
        yield name
    finally:
        os.close(descriptor)


def content(message: can.Message | None) -> Frame:
    assert message is not None, "nothing came"
    data = bytes(message.dlc) if message.is_remote_frame else bytes(message.data)
    return Frame(message.arbitration_id, data, message.is_remote_frame, message.is_extended_id)


def message_of(frame: Frame) -> can.Message:
    return can.Message(
        arbitration_id=frame.can_id,
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        dlc=len(frame.data),
        data=None if frame.remote else frame.data,
    )


def test_frames_of_every_kind_pass_both_ways(bus: SlcanBus, link: Path) -> None:
    with attached(link) as name, can.Bus(interface="socketcan", channel=name) as host:
        for frame in FRAMES:
            host.send(message_of(frame))
        assert take(bus, len(FRAMES)) == FRAMES
        for frame in FRAMES:
            bus.send(frame)
        assert [content(host.recv(PATIENCE_S)) for _ in FRAMES] == FRAMES
    assert bus.counts == {"refused": 1}


def test_the_link_goes_when_the_port_is_closed_and_comes_again(bus: SlcanBus, link: Path) -> None:
    for frame in FRAMES:
        with attached(link) as name, can.Bus(interface="socketcan", channel=name) as host:
            host.send(message_of(frame))
            assert take(bus, 1) == [frame]
        await_link(name, lambda: look(bus), there=False)


def test_pulling_the_adapter_out_takes_the_link_from_under_its_users(bus: SlcanBus, link: Path) -> None:
    with attached(link) as name, can.Bus(interface="socketcan", channel=name) as host:
        bus.close()
        with pytest.raises(can.CanOperationError) as raised:
            host.recv(PATIENCE_S)
        assert raised.value.error_code in {errno.ENETDOWN, errno.ENODEV}
        await_link(name, lambda: time.sleep(0.01), there=False)


def test_ip_link_chooses_the_bit_rate_and_opens_and_closes_the_channel(bus: SlcanBus, link: Path) -> None:
    ip = program("ip", "iproute2")

    def ip_link(*words: str) -> None:
        with served(bus):  # the kernel waits until the adapter has taken its commands
            subprocess.run([ip, "link", "set", name, *words], check=True, timeout=PATIENCE_S)

    with attached(link, b"") as name:
        links.switch(name, up=False)
        ip_link("up", "type", "can", "bitrate", "1000000")
        assert bus.channel is Channel.OPEN
        with can.Bus(interface="socketcan", channel=name) as host:
            host.send(message_of(FRAMES[1]))
            assert take(bus, 1) == [FRAMES[1]]
        ip_link("down")
        assert bus.channel is Channel.CLOSED
        ip_link("up", "type", "can", "bitrate", "500000")
        with can.Bus(interface="socketcan", channel=name) as host:
            host.send(message_of(FRAMES[1]))
            await_true(lambda: bus.counts.get("wrong_bit_rate"), lambda: look(bus))


def catches(pid: int, number: signal.Signals) -> bool:
    """Whether the process has come so far that it handles the signal."""
    lines = Path("/proc", str(pid), "status").read_text().splitlines()
    caught = next(int(line.split()[1], 16) for line in lines if line.startswith("SigCgt:"))
    return bool(caught >> (number - 1) & 1)


def test_slcand_may_be_killed_and_started_again(bus: SlcanBus) -> None:
    slcand = program("slcand", "can-utils")
    for end in (signal.SIGKILL, signal.SIGTERM):
        command = [slcand, "-F", "-o", "-c", "-f", "-s8", bus.port, "rig0"]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL) as daemon:
            await_link("rig0", lambda: look(bus), there=True)
            links.switch("rig0", up=True)
            with can.Bus(interface="socketcan", channel="rig0") as host:
                host.send(message_of(FRAMES[1]))
                assert take(bus, 1) == [FRAMES[1]]
                bus.send(FRAMES[2])
                assert content(host.recv(PATIENCE_S)) == FRAMES[2]
            await_true(lambda: catches(daemon.pid, signal.SIGTERM), lambda: look(bus))
            daemon.send_signal(end)
        await_link("rig0", lambda: look(bus), there=False)
    await_true(lambda: bus.channel is Channel.CLOSED, lambda: look(bus))


def an_ear_for_tpdos(name: str) -> can.BusABC:
    filters = [{"can_id": 0x180, "can_mask": 0x780, "extended": False}]
    return can.Bus(interface="socketcan", channel=name, can_filters=filters)


def test_canopen_finds_the_simulated_drives_on_the_link_and_hears_them_answer_sync(bus: SlcanBus, link: Path) -> None:
    with simulated_drives(bus), attached(link) as name, an_ear_for_tpdos(name) as ear:
        network = canopen.Network()
        network.connect(interface="socketcan", channel=name)
        try:
            for node_id in NODE_IDS:
                node = network.add_node(node_id)
                node.sdo.RESPONSE_TIMEOUT = PATIENCE_S
                assert node.sdo.upload(0x1018, 4) == node_id.to_bytes(4, "little")
        finally:
            network.disconnect()
        ear.send(message_of(Frame(0x000, b"\x01\x00")))
        ear.send(message_of(Frame(0x080)))
        assert [content(ear.recv(PATIENCE_S)).can_id for _ in NODE_IDS] == [0x181, 0x182, 0x183]
