"""The drive on the plant's bare rotor: a commanded torque turns the shaft as Newton says, and the encoder tells it."""

from __future__ import annotations

import math
import struct

import pytest

from torquerig.device_sim.drive.drive import SimulatedDrive
from torquerig.device_sim.plant.rotor import BareRotor, RotorParameters
from torquerig.driver.wire.frame import Frame

MS = 1_000_000
INERTIA = 0.0289 / 25**2  # the thesis' motor and gear on the motor's side [kg·m²]
LAG = 1e-4


@pytest.fixture
def drive() -> SimulatedDrive:
    drive = SimulatedDrive(1, 0, BareRotor(RotorParameters(inertia=INERTIA, lag=LAG)))
    drive.advance(0)
    drive.receive(Frame(0x000, b"\x01\x01"), 0)
    for controlword in (0x06, 0x07, 0x0F):
        drive.receive(Frame(0x201, struct.pack("<Hh", controlword, 0)), 0)
    drive.take()
    return drive


def sample(drive: SimulatedDrive, at_ns: int) -> tuple[int, int]:
    """Return position and raw torque at a SYNC."""
    drive.receive(Frame(0x080), at_ns)
    data = next(e.frame.data for e in drive.take() if e.frame.can_id == 0x181)
    return struct.unpack("<Hih", data)[1:]


@pytest.mark.parametrize(("counts", "torque"), [(2067, 0.1), (-2067, -2067 / 19528)])
def test_the_encoder_counts_what_the_torque_does(drive, counts, torque):
    """A step of torque through the lag T: angle = torque / J (t²/2 - T t + T² (1 - exp(-t/T)))."""
    drive.receive(Frame(0x201, struct.pack("<Hh", 0x0F, counts)), 1 * MS)
    t = 19e-3 - 50e-6
    angle = torque / INERTIA * (t * t / 2 - LAG * t + LAG * LAG * (1 - math.exp(-t / LAG)))
    position, actual = sample(drive, 20 * MS)
    assert position == pytest.approx(math.floor(angle * 8000 / math.tau), abs=1)
    assert actual == counts


def test_the_actual_torque_lags_behind_the_command(drive):
    drive.receive(Frame(0x201, struct.pack("<Hh", 0x0F, 2067)), 1 * MS)
    assert sample(drive, 1 * MS + 50_000)[1] == 0
    assert sample(drive, 1 * MS + 150_000)[1] == pytest.approx(2067 * (1 - math.exp(-1)), abs=1)


def test_sampling_in_between_does_not_change_the_motion(drive):
    other = SimulatedDrive(1, 0, BareRotor(RotorParameters(inertia=INERTIA, lag=LAG)))
    other.advance(0)
    for data in (b"\x01\x01",):
        other.receive(Frame(0x000, data), 0)
    for controlword in (0x06, 0x07, 0x0F):
        other.receive(Frame(0x201, struct.pack("<Hh", controlword, 0)), 0)
    for at_ms in range(1, 40):
        frame = Frame(0x201, struct.pack("<Hh", 0x0F, 2067))
        drive.receive(frame, at_ms * MS)
        other.receive(frame, at_ms * MS)
        sample(other, at_ms * MS + 333_333)
    assert abs(sample(drive, 40 * MS)[0] - sample(other, 40 * MS)[0]) <= 1
