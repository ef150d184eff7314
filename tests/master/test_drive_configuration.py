"""Configuration: what is written in which order, read back, and compared."""

from __future__ import annotations

from dataclasses import replace

import pytest

from torquerig.driver.errors import ConfigurationMismatch, EdsError, ProfileError
from torquerig.driver.master.configuration import settings_of
from torquerig.driver.master.group import AxisGroup
from torquerig.driver.master.objects import DriveObjects
from torquerig.driver.master.profile import load_profile
from torquerig.driver.master.settings import GroupSettings
from torquerig.driver.wire.dictionary import DRIVE_EDS
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.sdo import AbortCode

MS = 1_000_000


def plan(node_id: int = 1, settings: GroupSettings | None = None, **changes: object) -> list[tuple[str, int]]:
    """All settings of a drive as ("index:sub", value)."""
    profile = replace(load_profile(), **changes)
    objects = DriveObjects(node_id, DRIVE_EDS)
    siblings = [other for other in (1, 2, 3) if other != node_id]
    found = settings_of(objects, profile, settings or GroupSettings(), siblings)
    return [(f"{setting.index:04X}:{setting.subindex}", setting.value) for setting in found]


def test_a_pdo_is_remapped_by_the_standards_procedure():
    """CiA 301, 7.5.2.36: invalid, no entries, the entries, their number, valid."""
    assert [item for item in plan() if item[0].startswith(("1400", "1600"))] == [
        ("1400:1", 0x80000201),
        ("1400:2", 255),
        ("1400:5", 12),
        ("1600:0", 0),
        ("1600:1", 0x60400010),
        ("1600:2", 0x20710010),
        ("1600:0", 2),
        ("1400:1", 0x00000201),
    ]
    assert [item for item in plan(3) if item[0].startswith(("1800", "1A00"))] == [
        ("1800:1", 0x80000183),
        ("1800:2", 1),
        ("1800:3", 0),
        ("1800:5", 0),
        ("1A00:0", 0),
        ("1A00:1", 0x60410010),
        ("1A00:2", 0x60640020),
        ("1A00:3", 0x20770010),
        ("1A00:0", 3),
        ("1800:1", 0x00000183),
    ]


def test_pdos_that_nobody_counts_on_are_switched_off():
    settings = dict(plan(2))
    assert settings["1401:1"] == 0x80000302
    assert settings["1803:1"] == 0x80000482


def test_slower_process_data_are_off_where_the_cycle_has_no_room_for_them():
    assert dict(plan(settings=GroupSettings(period_ns=2 * MS)))["1801:1"] == 0x00000281
    assert dict(plan(settings=GroupSettings(period_ns=MS)))["1801:1"] == 0x80000281


def test_master_and_siblings_are_watched():
    settings = plan(2)
    assert settings.index(("1016:3", 0)) < settings.index(("1016:1", 127 << 16 | 100))
    assert dict(settings)["1016:2"] == 1 << 16 | 100
    assert dict(settings)["1016:3"] == 3 << 16 | 100
    assert dict(settings)["1017:0"] == 50
    assert dict(settings)["1028:1"] == 0x81
    assert dict(settings)["1028:2"] == 0x80000000
    assert dict(settings)["1028:3"] == 0x83
    assert dict(settings)["2120:2"] == 1


@pytest.mark.parametrize(("periods", "multiple"), [(3, 3), (5, 5), (4000, 255)])
def test_sync_may_be_missing_for_the_watchdogs_periods_as_far_as_eight_bits_go(periods, multiple):
    assert dict(plan(settings=GroupSettings(watchdog_periods=periods)))["2120:1"] == multiple


@pytest.mark.parametrize(
    ("period_ns", "sync_us", "value", "exponent", "timer_ms"),
    [(4 * MS, 4000, 4, -3, 12), (1 * MS, 1000, 1, -3, 3), (MS // 2, 500, 5, -4, 2), (3_333_000, 3333, None, None, 10)],
)
def test_the_period_stands_wherever_a_drive_needs_it(period_ns, sync_us, value, exponent, timer_ms):
    if value is None:
        with pytest.raises(ProfileError, match=r"a period of 3\.333 ms is not 1 to 255 steps of 1e-6 s"):
            plan(settings=GroupSettings(period_ns=period_ns))
        return
    settings = dict(plan(settings=GroupSettings(period_ns=period_ns)))
    assert settings["1006:0"] == sync_us
    assert (settings["60C2:1"], settings["60C2:2"]) == (value, exponent)
    assert settings["1400:5"] == timer_ms


def test_a_drive_of_whole_milliseconds_takes_no_other_period():
    nanotec = load_profile("nanotec")
    assert nanotec.interpolation_period(2 * MS) == (2, -3)
    with pytest.raises(ProfileError, match=r"a period of 2\.5 ms is not 1 to 255 steps of 1e-3 s"):
        nanotec.interpolation_period(2_500_000)


def test_an_rpdo_that_acts_at_the_next_sync_is_configuration():
    assert dict(plan(settings=GroupSettings(rpdo_type=1)))["1400:2"] == 1


def test_torque_profile_mode_takes_its_slope_along():
    settings = dict(plan(mode=4, torque_slope=0xFFFFFFFF))
    assert (settings["6060:0"], settings["6087:0"]) == (4, 0xFFFFFFFF)


def test_a_guarded_drive_has_no_heartbeat_and_is_asked_by_remote_frames(rig):
    watchdogs = replace(load_profile().watchdogs, heartbeat=False, guarding=True)
    profile = replace(load_profile(), watchdogs=watchdogs)
    settings = dict(plan(watchdogs=watchdogs))
    assert (settings["1017:0"], settings["100C:0"], settings["100D:0"]) == (0, 33, 3)
    with AxisGroup(rig.bus, [replace(axis, profile=profile) for axis in rig.axes]) as group:
        group.wait(1.0)
    asked = [at for at, frame in rig.bus.log if frame.can_id == 0x701 and frame.remote]
    assert 29 <= len(asked) <= 32


@pytest.mark.parametrize(
    "wrong",
    [
        {"period_ns": 0},
        {"period_ns": 4_000_500},
        {"rpdo_type": 241},
        {"rpdo_type": 252},
        {"master_id": 0},
        {"watchdog_periods": 0},
        {"listening_ms": -1},
    ],
)
def test_impossible_group_settings_are_refused(wrong):
    with pytest.raises(ValueError, match=r"\d"):
        GroupSettings(**wrong)


def test_a_difference_names_drive_object_and_both_values(rig):
    rig.drives[2].forgotten.add((0x605A, 0))
    rig.drives[2].values[0x605A, 0] = 6
    with pytest.raises(ConfigurationMismatch) as mismatch:
        rig.group().__enter__()
    assert str(mismatch.value) == "drive 2 holds 6 in 605A:0 (Quick stop option code), not 2"


def test_a_refused_value_is_told_with_the_drives_reason(rig):
    rig.drives[1].refused[0x6060, 0] = AbortCode.INVALID_VALUE
    with pytest.raises(ConfigurationMismatch) as mismatch:
        rig.group().__enter__()
    assert str(mismatch.value) == "drive 1 refuses 10 (0xa) in 6060:0 (Modes of operation): invalid value"


def test_a_drive_of_another_make_is_refused(rig):
    rig.drives[3].values[0x1018, 2] = 99
    with pytest.raises(ConfigurationMismatch, match=r"drive 3 holds 99 \(0x63\) in 1018:2 \(.*Product code\), not 1"):
        rig.group().__enter__()


def test_an_emcy_on_another_identifier_is_refused_because_siblings_would_not_hear_it(rig):
    rig.drives[2].values[0x1014, 0] = 0x90
    with pytest.raises(ConfigurationMismatch, match=r"drive 2 holds 144 \(0x90\) in 1014:0"):
        rig.group().__enter__()


def test_bit_30_of_a_tpdos_cob_id_is_the_drives_own(rig):
    drive = rig.drives[1]
    plain = drive.read
    drive.read = lambda index, subindex: (
        (0x40000181).to_bytes(4, "little")
        if (index, subindex) == (0x1800, 1) and not drive.values[0x1800, 1] >> 31
        else plain(index, subindex)
    )
    with rig.group() as group:
        group.enable()


def test_a_profile_that_maps_what_the_eds_lacks_is_refused_before_anything_is_sent(rig):
    torque = replace(load_profile().torque, target="2079")
    rpdo = replace(load_profile().rpdo, objects=("6040", "2079"))
    profile = replace(load_profile(), torque=torque, rpdo=rpdo)
    with pytest.raises(EdsError, match=r"drive 1 has no object 2079:0 by its EDS .*torquerig-drive.eds"):
        AxisGroup(rig.bus, [replace(rig.axes[0], profile=profile)])
    assert rig.bus.log == []


def test_a_sibling_whose_emergencies_a_drive_cannot_hear_is_refused(make_rig):
    with pytest.raises(EdsError, match="drive 1 has no object 1028:9"):
        make_rig((1, 9)).group().__enter__()


def test_two_axes_of_one_node_id_are_refused(rig):
    with pytest.raises(ValueError, match=r"node-ids of their own, not \[1, 1\]"):
        AxisGroup(rig.bus, [rig.axes[0], rig.axes[0]])


def test_a_rated_value_of_the_profile_is_written_and_scales_the_torque(rig):
    torque = replace(
        load_profile().torque,
        reference="rated torque",
        target="6071",
        actual="6077",
        rated_object="6076",
        rated_unit=0.001,
        rated_value=500,
    )
    profile = replace(
        load_profile(),
        torque=torque,
        rpdo=replace(load_profile().rpdo, objects=("6040", "6071")),
        tpdos=(replace(load_profile().tpdos[0], objects=("6041", "6064", "6077")),),
    )
    with AxisGroup(rig.bus, [replace(axis, profile=profile) for axis in rig.axes]) as group:
        assert rig.drives[1].values[0x6076, 0] == 500
        assert group.axes[0].scale is not None
        assert group.axes[0].scale.torque_counts(0.25) == 500


def test_objects_are_read_and_written_by_their_types(rig):
    with rig.group() as group:
        assert group.read(2, 0x1008) == "torquerig simulated torque drive"
        assert group.read(2, 0x60C2, 2) == -3
        group.write(2, 0x6072, 0, 1000)
        assert rig.drives[2].values[0x6072, 0] == 1000
        with pytest.raises(ValueError, match=r"70000 does not fit 6072:0 \(Max torque\)"):
            group.write(2, 0x6072, 0, 70000)
        with pytest.raises(EdsError, match="drive 2 has no object 5FFF:0"):
            group.read(2, 0x5FFF)
        with pytest.raises(ValueError, match="drive 9 is not of this group"):
            group.read(9, 0x1000)


def test_slower_process_data_are_kept_by_object(rig):
    with rig.group() as group:
        rig.bus.inject(group.now_ns() + MS, Frame(0x281, bytes.fromhex("10 27 00 00 2C 01 50 82")))
        rig.bus.inject(group.now_ns() + MS, Frame(0x282, bytes(2)))
        group.wait(0.01)
        assert group.axes[0].monitored == {(0x606C, 0): 10000, (0x2100, 1): 300, (0x603F, 0): 0x8250}
        assert group.pump_counts.malformed == 1
