"""What a bus URL may be, and the one sentence that anything else gets."""

from __future__ import annotations

from pathlib import Path

import pytest

from torquerig.driver.bus.python_can import PythonCanBus
from torquerig.driver.bus.socketcan import check_interface
from torquerig.driver.bus.url import open_bus
from torquerig.driver.errors import BusError, BusUrlError, TorqueRigError


def sentence(url: str) -> str:
    with pytest.raises(BusUrlError) as raised:
        open_bus(url, bitrate=1_000_000)
    text = str(raised.value)
    assert "\n" not in text
    assert isinstance(raised.value, TorqueRigError)
    assert isinstance(raised.value, ValueError)
    return text


def test_a_channel_may_hold_colons():
    bus = open_bus("virtual:a:b:c", bitrate=1_000_000)
    assert isinstance(bus, PythonCanBus)
    assert bus._bus.channel_id == "a:b:c"
    bus.close()


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("vcan0", "want of a colon: lockstep:, unix:FOLDER, socketcan:vcan0"),
        ("", "want of a colon"),
        ("sockecan:vcan0", "no bus interface 'sockecan': did you mean socketcan"),
        ("lockstp:", "did you mean lockstep"),
        ("zzzzzz:0", "lockstep:, unix:FOLDER"),
        ("unix:", "names no channel: unix:CHANNEL"),
        ("socketcan:", "names no channel"),
        ("lockstep:0", "has no channels"),
        ("lockstep:", "nothing to simulate here"),
        ("unix:/dev/null", "no unix bus in /dev/null: File exists"),
        ("slcan:/dev/no-such-adapter", "cannot be opened"),
    ],
)
def test_a_bad_url_is_one_sentence(url, words):
    assert words in sentence(url)


@pytest.fixture
def interfaces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a fake /sys/class/net on a kernel that has CAN: vcan0 up, vcan1 and can0 down, and an Ethernet card."""
    monkeypatch.setattr("socket.socket", lambda *_: (tmp_path / "socket").open("w"))
    for name, kind, flags in (("vcan0", 280, 0xC1), ("vcan1", 280, 0x80), ("can0", 280, 0x80), ("eth0", 1, 0x1003)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "type").write_text(f"{kind}\n")
        (tmp_path / name / "flags").write_text(f"{flags:#x}\n")
    return tmp_path


def test_an_interface_that_is_up_passes(interfaces):
    check_interface("vcan0", 1_000_000, interfaces)


@pytest.mark.parametrize("name", ["vcan7", "eth0"])
def test_a_missing_interface_says_how_to_make_one(interfaces, name):
    with pytest.raises(BusUrlError) as raised:
        check_interface(name, 1_000_000, interfaces)
    assert f"sudo ip link add dev {name} type vcan && sudo ip link set up {name} makes a virtual one" in str(
        raised.value
    )
    assert "lockstep: needs nothing" in str(raised.value)


@pytest.mark.parametrize(
    ("name", "command"),
    [
        ("vcan1", "sudo ip link set vcan1 up brings"),
        ("can0", "sudo ip link set can0 up type can bitrate 500000 brings"),
    ],
)
def test_an_interface_that_is_down_says_how_to_bring_it_up(interfaces, name, command):
    with pytest.raises(BusError, match=f"{name} is down: {command}"):
        check_interface(name, 500_000, interfaces)


def test_a_kernel_without_can_says_so(monkeypatch):
    def refuse(*_):
        raise OSError(97, "Address family not supported by protocol")

    monkeypatch.setattr("socket.socket", refuse)
    with pytest.raises(BusUrlError, match="kernel has no CAN: sudo modprobe vcan"):
        check_interface("vcan0", 1_000_000)
