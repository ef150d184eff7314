"""python-can's own serial interface judges the adapter, over a real pseudo-terminal."""

import os
import random
from collections.abc import Iterator
from pathlib import Path

import can
import canopen
import pytest
from adapter_host import PATIENCE_S, look, served, simulated_drives, take

from torquerig.driver.bus.slcan import SlcanBus
from torquerig.driver.wire.frame import Frame

FRAMES = [
    Frame(0x000),
    Frame(0x7FF, bytes(range(0xF8, 0x100))),
    Frame(0x181, b"\x37\x06\x00\x00\xff\x7f"),
    Frame(0x701, bytes(1), remote=True),
    Frame(0x080, remote=True),
    Frame(0x1FFFFFFF, b"\xff" * 8, extended=True),
    Frame(0x00000000, extended=True),
    Frame(0x18FF0102, bytes(8), remote=True, extended=True),
]
NODE_IDS = [1, 2, 3]


def plug_in(port: str | os.PathLike[str], bitrate: int | None = 1_000_000, *, listen_only: bool = False) -> can.BusABC:
    return can.Bus(interface="slcan", channel=str(port), bitrate=bitrate, listen_only=listen_only, sleep_after_open=0.0)


def message_of(frame: Frame) -> can.Message:
    return can.Message(
        arbitration_id=frame.can_id,
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        dlc=len(frame.data),
        data=None if frame.remote else frame.data,
    )


def frame_of(message: can.Message | None) -> Frame:
    assert message is not None, "nothing came"
    data = bytes(message.dlc) if message.is_remote_frame else bytes(message.data)
    return Frame(message.arbitration_id, data, message.is_remote_frame, message.is_extended_id)


@pytest.fixture
def host(bus: SlcanBus, link: Path) -> Iterator[can.BusABC]:
    with plug_in(link) as host:
        assert look(bus) is None  # it was set up, and says nothing yet
        yield host


def test_frames_of_every_kind_arrive_as_they_were_sent_both_ways(bus: SlcanBus, host: can.BusABC) -> None:
    for frame in FRAMES:
        host.send(message_of(frame))
    assert take(bus, len(FRAMES)) == FRAMES
    for frame in FRAMES:
        bus.send(frame)
    assert [frame_of(host.recv(PATIENCE_S)) for _ in FRAMES] == FRAMES
    assert bus.counts == {"refused": 2}  # it closes what is closed, and opens what is open


def test_a_burst_arrives_whole_and_in_order_both_ways(bus: SlcanBus, host: can.BusABC) -> None:
    burst = [Frame(0x181 + number % 3, number.to_bytes(8, "little")) for number in range(150)]
    for frame in burst:
        host.send(message_of(frame))
    assert take(bus, len(burst)) == burst
    for frame in burst:
        bus.send(frame)
    assert [frame_of(host.recv(PATIENCE_S)) for _ in burst] == burst


def test_it_reads_versions_and_serial_number(bus: SlcanBus, link: Path) -> None:
    with served(bus), plug_in(link) as host:
        assert host.get_version(PATIENCE_S) == (10, 10)
        assert host.get_serial_number(PATIENCE_S) == "TRIG"


def test_time_stamps_do_not_disturb_it(bus: SlcanBus, host: can.BusABC) -> None:
    host._write("C")
    host._write("Z1")
    host._write("O")
    assert look(bus) is None
    for frame in FRAMES:
        bus.send(frame)
    assert [frame_of(host.recv(PATIENCE_S)) for _ in FRAMES] == FRAMES


def test_a_closed_channel_hears_nothing_and_an_opened_one_what_comes_then(bus: SlcanBus, host: can.BusABC) -> None:
    host.close()
    host.send(message_of(FRAMES[1]))
    assert look(bus) is None
    bus.send(FRAMES[1])
    host.open()
    assert look(bus) is None
    bus.send(FRAMES[2])
    assert frame_of(host.recv(PATIENCE_S)) == FRAMES[2]
    assert bus.counts["unheard"] == 1


def test_it_may_unplug_and_plug_in_again(bus: SlcanBus, link: Path) -> None:
    for frame in FRAMES:
        with plug_in(link) as host:
            host.send(message_of(frame))
            assert take(bus, 1) == [frame]
            bus.send(frame)
            assert frame_of(host.recv(PATIENCE_S)) == frame
        assert look(bus) is None


def test_a_listener_hears_all_and_sends_nothing(bus: SlcanBus, link: Path) -> None:
    with plug_in(link, listen_only=True) as host:
        host.send(message_of(FRAMES[1]))
        assert look(bus) is None
        bus.send(FRAMES[2])
        assert frame_of(host.recv(PATIENCE_S)) == FRAMES[2]


def test_at_a_wrong_bit_rate_nothing_passes(bus: SlcanBus, link: Path) -> None:
    with plug_in(link, bitrate=500_000) as host:
        host.send(message_of(FRAMES[1]))
        assert look(bus) is None
        bus.send(FRAMES[2])
        assert host.recv(0.05) is None
    assert bus.counts["wrong_bit_rate"] == 2


def test_garbage_before_and_between_frames_does_them_no_harm(bus: SlcanBus, host: can.BusABC) -> None:
    noise = random.Random(3)
    for frame in FRAMES:
        garbage = noise.randbytes(60).replace(b"t", b"").replace(b"T", b"").replace(b"r", b"").replace(b"R", b"")
        host.serialPortOrig.write(garbage + b"\r")
        host.send(message_of(frame))
        bus.send(frame)
    assert take(bus, len(FRAMES)) == FRAMES
    assert bus.counts["garbage"] >= len(FRAMES)
    assert [frame_of(host.recv(PATIENCE_S)) for _ in FRAMES] == FRAMES


def test_canopen_finds_the_simulated_drives_behind_the_adapter_and_reads_them(bus: SlcanBus, link: Path) -> None:
    network = canopen.Network()
    with simulated_drives(bus):
        network.connect(interface="slcan", channel=str(link), bitrate=1_000_000, sleep_after_open=0.0)
        try:
            for node_id in NODE_IDS:
                node = network.add_node(node_id)
                node.sdo.RESPONSE_TIMEOUT = PATIENCE_S
                assert node.sdo.upload(0x1018, 4) == node_id.to_bytes(4, "little")
                assert node.sdo.upload(0x1008, 0) == b"torquerig simulated torque drive"  # in segments
        finally:
            network.disconnect()
