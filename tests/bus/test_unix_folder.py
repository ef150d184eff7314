"""The unix bus's folder: what it may be, what else may be in it, and strangers that find its doors."""

from __future__ import annotations

import fcntl
import os
import resource
import socket
from pathlib import Path

import can
import pytest

from torquerig.driver.bus.unix import UnixBus

PATIENCE_S = 20.0  # real time on a shared machine: order and content are asserted, never speed


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "bus"


def numbered(number: int) -> can.Message:
    return can.Message(arbitration_id=0x181, data=number.to_bytes(4, "little"), is_extended_id=False)


def heard(bus: UnixBus) -> int:
    message = bus.recv(PATIENCE_S)
    assert message is not None
    return int.from_bytes(message.data, "little")


def stranger_at(folder: Path, bus: UnixBus) -> socket.socket:
    stranger = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    stranger.connect(str(folder / bus._place.name))
    return stranger


def test_garbage_from_a_stranger_is_counted_and_harms_nobody(folder):
    with UnixBus(folder) as bus:
        stranger = stranger_at(folder, bus)
        for garbage in (
            b"x",
            b"hello there, is this a bus?",
            b"CAN\x01",
            bytes(24),
            bytes(70_000),
            b"CAN\x01" + b"\xff" * 28,
        ):
            stranger.send(garbage)
        with UnixBus(folder) as other:
            other.send(numbered(1))
            assert heard(bus) == 1
            assert bus.counts["malformed"] == 6
            stranger.close()
            bus.send(numbered(2))
            assert heard(other) == 2


def test_a_connection_of_the_wrong_kind_is_refused_by_the_kernel(folder):
    with UnixBus(folder):
        (door,) = folder.glob("member-*.sock")
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as stream, pytest.raises(OSError, match="Protocol"):
            stream.connect(str(door))


def test_a_folder_of_any_depth_will_do(folder):
    deep = folder / ("deep" * 20) / ("er" * 40)
    assert len(str(deep)) > 108  # sun_path
    with UnixBus(deep) as one, UnixBus(deep) as two:
        one.send(numbered(1))
        assert heard(two) == 1


def test_a_new_folder_is_the_users_alone(folder):
    with UnixBus(folder):
        assert folder.stat().st_mode & 0o777 == 0o700


def test_what_else_is_in_the_folder_stays_there(folder):
    folder.mkdir()
    (folder / "notes.txt").write_text("mine")
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as other:
        other.bind(str(folder / "somebody.sock"))
    with UnixBus(folder):
        pass
    assert {path.name for path in folder.iterdir()} == {"notes.txt", "somebody.sock", "members.lock"}


def test_a_file_in_place_of_the_folder_is_one_sentence(folder):
    folder.write_text("not a folder")
    with pytest.raises(can.CanInitializationError, match=rf"^no unix bus in {folder}: File exists$"):
        UnixBus(folder)


def test_a_lock_that_nobody_lets_go_is_one_sentence(folder, monkeypatch):
    monkeypatch.setattr("torquerig.driver.bus.unix_folder.PATIENCE_S", 0.01)
    folder.mkdir()
    with (folder / "members.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(can.CanInitializationError, match=r"another process has held .*members\.lock for 0\.01 s$"):
            UnixBus(folder)
    UnixBus(folder).shutdown()


def test_a_newcomer_waits_at_the_door_while_no_descriptor_is_left(folder):
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with UnixBus(folder) as bus, UnixBus(folder) as other:
        assert bus.recv(0) is None  # looks, and lets the other in
        with stranger_at(folder, bus):
            os.close(lowest := os.dup(0))
            resource.setrlimit(resource.RLIMIT_NOFILE, (lowest, hard))
            try:
                other.send(numbered(1))
                assert heard(bus) == 1
                bus.send(numbered(2))
                assert heard(other) == 2
                assert bus.counts["refused"] > 0
            finally:
                resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
            assert bus.members == 1
            assert bus.recv(0) is None
            assert bus.members == 2
