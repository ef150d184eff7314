"""Homing: the fixture's pose goes into the drives once, and a machine that stands elsewhere is not zeroed anew."""

from __future__ import annotations

import numpy as np
import pytest

from torquerig.driver.errors import EnablingRefused, NotHomed
from torquerig.driver.wire.cia402 import DriveState
from torquerig.driver.wire.sdo import AbortCode

FIXTURE_COUNTS = [27177, 102005, 139757]  # 48.9177, 183.6095 and 251.5625 degrees of 200 000 counts a revolution
FIXTURE_RAD = [counts * 2 * np.pi / 200_000 for counts in FIXTURE_COUNTS]
PERIOD = 4_000_000


@pytest.fixture
def homed(rig):
    with rig.group() as group:
        group.home(FIXTURE_RAD)
    return rig


def positions(rig) -> list[int]:
    return [drive.position for drive in rig.drives.values()]


def test_in_the_fixture_every_position_becomes_the_fixtures(rig):
    with rig.group() as group:
        assert not group.is_homed
        assert group.home(FIXTURE_RAD)
        assert group.is_homed
        assert positions(rig) == FIXTURE_COUNTS
        sample = group.sample(group.now_ns() + PERIOD)
        assert sample.q == pytest.approx(FIXTURE_RAD, abs=1e-12)


def test_without_angles_the_settings_homes_are_taken(rig):
    with rig.group() as group:
        group.home()
    assert positions(rig) == FIXTURE_COUNTS


def test_homing_leaves_the_drives_disabled_in_their_cyclic_mode(rig):
    with rig.group() as group:
        group.home()
        assert all(drive.state is DriveState.SWITCH_ON_DISABLED for drive in rig.drives.values())
        assert all(drive.values[0x6060, 0] == 10 for drive in rig.drives.values())
        group.enable()


def test_homing_starts_by_the_edge_of_controlword_bit_4_and_without_torque(rig):
    with rig.group() as group:
        group.home()
    assert bytes.fromhex("1F000000") in rig.bus.sent_to(0x201)
    assert {frame[2:] for frame in rig.bus.sent_to(0x201)} == {bytes(2)}


def test_a_second_run_homes_nothing_wherever_the_machine_stands(homed):
    for drive in homed.drives.values():
        drive.encoder += 5000
    moved = positions(homed)
    with homed.group() as group:
        assert not group.home()
    assert positions(homed) == moved


def test_homed_to_other_angles_is_an_error_with_both_counts(homed):
    with homed.group() as group, pytest.raises(NotHomed) as refusal:
        group.home([FIXTURE_RAD[0] + 0.1, *FIXTURE_RAD[1:]])
    assert "drive 1 was homed to 27177 counts (607C), where the settings say 30360" in str(refusal.value)


def test_anew_homes_also_what_is_homed(homed):
    for drive in homed.drives.values():
        drive.encoder += 5000
    with homed.group() as group:
        assert group.home(anew=True)
    assert positions(homed) == FIXTURE_COUNTS


def test_one_drive_that_lost_its_home_is_homed_alone_in_the_fixture(homed):
    homed.drives[2].homed = False
    homed.drives[2].zero = 0
    before = homed.drives[1].visited.copy()
    with homed.group() as group:
        assert group.home()
    assert positions(homed) == FIXTURE_COUNTS
    assert homed.drives[1].visited == before


def test_one_drive_that_lost_its_home_is_not_homed_elsewhere(homed):
    homed.drives[2].homed = False
    homed.drives[2].zero = 0
    homed.drives[3].encoder += 5000
    with homed.group() as group, pytest.raises(NotHomed) as refusal:
        group.home()
    assert str(refusal.value).startswith("drive 2 cannot be homed here, because by drive 3 the machine does not stand")
    assert not homed.drives[2].homed


def test_a_drive_that_does_not_attain_home_is_told(rig):
    rig.drives[3].fail_homing = True
    with rig.group() as group, pytest.raises(NotHomed, match="drive 3 did not attain home"):
        group.home()
    assert rig.drives[3].state is DriveState.SWITCH_ON_DISABLED


def test_a_drive_that_takes_the_offset_with_the_other_sign_is_found_out(rig):
    rig.drives[1].home_sign = -1
    with rig.group() as group, pytest.raises(NotHomed, match="drive 1 says -27177 counts after homing, not 27177"):
        group.home()


def test_a_drive_that_refuses_the_method_is_told_with_its_object(rig):
    rig.drives[2].refused[0x6098, 0] = AbortCode.INVALID_VALUE
    with rig.group() as group, pytest.raises(Exception, match=r"drive 2 refuses 37 \(0x25\) in 6098:0"):
        group.home()


def test_enabled_drives_are_not_homed(rig):
    with rig.group() as group:
        group.enable()
        with pytest.raises(EnablingRefused, match="homed before they are enabled"):
            group.home()


def test_faults_that_homing_resets_are_told_by_enable(rig):
    rig.drives[1].fault(0x8250, told=False)
    with rig.group() as group:
        group.home()
        assert group.enable() == ["drive 1 was in fault since communication was lost: RPDO timeout (0x8250); reset"]
