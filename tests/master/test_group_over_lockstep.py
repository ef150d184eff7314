"""The group against the simulated drives themselves, over a wire with bit times and arbitration."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import radians

import numpy as np
import pytest

from torquerig.device_sim.devices import SimulatedDevices
from torquerig.device_sim.drive.drive import SimulatedDrive
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.device_sim.plant import Friction, PlanarManipulatorMachine
from torquerig.driver.bus.lockstep import LockstepBus
from torquerig.driver.errors import ConfigurationMismatch, DriveFault, NoAnswer, ProfileError, SecondMaster
from torquerig.driver.master.group import AxisGroup
from torquerig.driver.master.profile import load_profile
from torquerig.driver.master.scale import AxisSettings
from torquerig.driver.master.scan import scan
from torquerig.driver.master.sdo_jobs import Download
from torquerig.driver.master.settings import GroupSettings
from torquerig.driver.master.stop import reset, stop
from torquerig.driver.wire import emcy
from torquerig.driver.wire.cia402 import DriveState
from torquerig.driver.wire.dictionary import DRIVE_EDS
from torquerig.driver.wire.frame import Frame, worst_case_bits
from torquerig.driver.wire.nmt import NmtState
from torquerig.mechanism import Manipulator

MS = 1_000_000
PERIOD = 4 * MS
HOME = [radians(degrees) for degrees in (48.9177, 183.6095, 251.5625)]
PUSH = np.array([0.2, 0.0, 0.0])
ZERO = bytes(4)


@dataclass
class LockstepRig:
    """Three simulated drives on the manipulator, and all frames that passed."""

    bus: LockstepBus
    drives: list[SimulatedDrive]
    log: list[tuple[int, Frame]]
    axes: list[AxisSettings]

    def group(self, settings: GroupSettings | None = None) -> AxisGroup:
        return AxisGroup(self.bus, self.axes, settings)

    def since(self, start_ns: int) -> list[Frame]:
        return [frame for at, frame in self.log if at > start_ns]


@pytest.fixture
def rig() -> Iterator[LockstepRig]:
    machine = PlanarManipulatorMachine(Manipulator.thesis(), Friction((0.5,) * 3, (0.5,) * 3))
    drives = [SimulatedDrive(node_id, node_id - 1, machine) for node_id in (1, 2, 3)]
    log: list[tuple[int, Frame]] = []
    wire = SimulatedNetwork(SimulatedDevices(drives), 1_000_000, tap=lambda at, frame: log.append((at, frame)))
    profile = load_profile()
    axes = [AxisSettings(node_id, profile, home=home) for node_id, home in zip((1, 2, 3), HOME, strict=True)]
    bus = LockstepBus(wire)
    yield LockstepRig(bus, drives, log, axes)
    bus.close()


def run(group: AxisGroup, cycles: int, torque: np.ndarray = PUSH) -> None:
    due = group.now_ns() + PERIOD
    for _ in range(cycles):
        assert group.sample(due).complete
        group.command(torque, due + 3 * MS)
        due += PERIOD


def inject(group: AxisGroup, node_id: int, what: int) -> None:
    """Write 2F00, which no EDS holds."""

    def job():
        yield Download(0x2F00, 0, what.to_bytes(4, "little"))

    group._session.service.run({node_id: job()})


def kill_controller(rig: LockstepRig) -> None:
    """Run a group and leave it without its end, as kill -9 does; then let the watchdogs have their time."""
    group = rig.group().__enter__()
    group.home()
    group.enable()
    run(group, 5)
    rig.bus.wait_until(rig.bus.now_ns() + 200 * MS)
    while rig.bus.receive(0):
        pass


def states(rig: LockstepRig) -> set[DriveState]:
    return {drive.state for drive in rig.drives}


def test_a_push_turns_its_joint_that_way_and_leaving_ends_it(rig):
    with rig.group() as group:
        assert group.home()
        assert group.enable() == []
        start = group.sample(group.now_ns() + PERIOD).q
        assert start == pytest.approx(HOME, abs=2e-5)
        run(group, 25)
        sample = group.sample(group.now_ns() + PERIOD)
        assert sample.q[0] - start[0] > 0.01
        assert sample.torque[0] == pytest.approx(0.2, rel=0.05)
        assert group.cycle_counts.missed == [0, 0, 0]
    assert states(rig) == {DriveState.SWITCH_ON_DISABLED}
    assert all(drive.torque_demand == 0 for drive in rig.drives)


def test_every_cycle_is_a_sync_three_tpdos_and_three_rpdos(rig):
    with rig.group() as group:
        group.home()
        group.enable()
        start = group.now_ns()
        run(group, 50)
        frames = [frame.can_id for frame in rig.since(start + PERIOD // 2)]
    cyclic = [can_id for can_id in frames if can_id == 0x080 or 0x181 <= can_id <= 0x203]
    first = cyclic.index(0x080)
    assert cyclic[first : first + 7 * 40] == [0x080, 0x181, 0x182, 0x183, 0x201, 0x202, 0x203] * 40


def test_leaving_by_an_error_ends_at_zero_torque_and_disabled(rig):
    def fail() -> None:
        with rig.group() as group:
            group.enable()
            run(group, 5)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert states(rig) == {DriveState.SWITCH_ON_DISABLED}
    assert all(drive.torque_demand == 0 for drive in rig.drives)


def test_a_clean_end_leaves_no_emergency_behind(rig):
    with rig.group() as group:
        group.home()
        group.enable()
        run(group, 5)
    rig.bus.wait_until(rig.bus.now_ns() + 500 * MS)
    assert [frame for _, frame in rig.log if emcy.decode(frame)] == []


def test_a_killed_controller_leaves_faults_that_the_next_one_resets_and_names(rig):
    kill_controller(rig)
    assert states(rig) == {DriveState.FAULT}
    last_rpdo = max(at for at, frame in rig.log if frame.can_id == 0x203)
    alarms: dict[int, int] = {}
    for at, frame in rig.log:
        emergency = emcy.decode(frame)
        if emergency is not None and emergency.code:
            alarms.setdefault(emergency.node_id, at)
    assert set(alarms) == {1, 2, 3}
    assert max(alarms.values()) - last_rpdo <= 3 * PERIOD + MS
    with rig.group() as group:
        assert not group.home()
        notices = group.enable()
        run(group, 5)
    assert [notice.partition(":")[0] for notice in notices] == [
        f"drive {node_id} was in fault since communication was lost" for node_id in (1, 2, 3)
    ]


def test_a_second_group_does_not_home_a_machine_that_moved(rig):
    with rig.group() as group:
        group.home()
        group.enable()
        run(group, 25)
    with rig.group() as group:
        assert not group.home()
        assert group.sample(group.now_ns() + PERIOD).q[0] - HOME[0] > 0.01


def test_the_fault_of_one_stops_all_and_the_cause_is_told_first(rig):
    with rig.group() as group:
        group.home()
        group.enable()
        run(group, 5)
        with pytest.raises(DriveFault) as fault:  # noqa: PT012 - either may be where it shows
            inject(group, 2, 1)
            run(group, 5)
    assert str(fault.value) == (
        "drive 2 is in fault: continuous overcurrent at the output (0x2310);"
        " drives 1 and 3 stopped because a sibling did"
    )
    alarm = next(place for place, (_, frame) in enumerate(rig.log) if frame.can_id == 0x082)
    commands = [frame.data for _, frame in rig.log[alarm:] if 0x201 <= frame.can_id <= 0x203]
    assert set(commands) == {ZERO}


def test_a_drive_in_fault_is_refused_and_can_be_reset_by_a_person(rig):
    with rig.group() as group:
        group.home()
        inject(group, 3, 4)
        with pytest.raises(DriveFault, match=r"^drive 3 is in fault: device over-temperature \(0x4210\)$"):
            group.enable()
        assert DriveState.OPERATION_ENABLED not in states(rig)
        inject(group, 3, 0)
    with pytest.raises(DriveFault, match="drive 3"), rig.group() as group:
        group.enable()
    assert reset(rig.bus, [3]) == ["drive 3 was in fault: device over-temperature (0x4210); reset"]
    with rig.group() as group:
        group.enable()


def test_a_drive_that_loses_power_is_told_by_name(rig):
    with rig.group() as group:
        group.home()
        group.enable()
        run(group, 5)
        rig.drives[1].power_cycle(group.now_ns())
        with pytest.raises(DriveFault, match="drive 2 restarted"):
            run_incomplete(group, 10)
    assert states(rig) <= {DriveState.SWITCH_ON_DISABLED, DriveState.FAULT}


def run_incomplete(group: AxisGroup, cycles: int) -> None:
    due = group.now_ns() + PERIOD
    for _ in range(cycles):
        group.sample(due)
        group.command(PUSH, due + 3 * MS)
        due += PERIOD


def test_a_drive_of_another_make_than_the_eds_is_refused(rig, tmp_path):
    eds = tmp_path / "other.eds"
    eds.write_text(DRIVE_EDS.read_text().replace("ProductNumber=0x00000001", "ProductNumber=0x00000007"))
    rig.axes[1] = replace(rig.axes[1], eds=eds)
    with pytest.raises(ConfigurationMismatch, match=r"^drive 2 holds 1 in 1018:2 \(.*\), not 7"):
        rig.group().__enter__()


def test_a_drive_that_is_not_there_is_named(rig):
    rig.axes[2] = replace(rig.axes[2], node_id=5)
    with pytest.raises(NoAnswer, match=r"^no answer from drive 5 within 0.9 s\b"):
        rig.group().__enter__()


def test_an_rpdo_that_acts_at_the_next_sync_drives_as_well(rig):
    with rig.group(GroupSettings(rpdo_type=1)) as group:
        group.home()
        group.enable()
        run(group, 25)
        assert group.sample(group.now_ns() + PERIOD).q[0] - HOME[0] > 0.01


def test_at_a_thousand_cycles_a_second_only_a_heartbeat_in_the_way_makes_an_answer_late(rig):
    """SYNC and three TPDOs take 480 of the 500 us that a sample may take; a heartbeat takes 65."""
    with rig.group(GroupSettings(period_ns=MS)) as group:
        group.home()
        group.enable()
        due = group.now_ns() + MS
        late = 0
        for _ in range(500):
            late += not group.sample(due).complete
            group.command(np.zeros(3), due)
            due += MS
    assert late <= 500 // 50 * 4  # three drives' heartbeats every 50 ms, and the master's


def test_a_scan_finds_the_three_drives(rig):
    rig.bus.wait_until(500 * MS)
    assert [(node.node_id, node.state) for node in scan(rig.bus)] == [
        (node_id, NmtState.PRE_OPERATIONAL) for node_id in (1, 2, 3)
    ]


def test_stop_by_another_program_ends_a_run(rig):
    group = rig.group().__enter__()
    group.enable()
    run(group, 5)
    assert stop(rig.bus, rig.axes) == [f"drive {node_id} is in 'switch on disabled'" for node_id in (1, 2, 3)]
    # whichever is heard first: a statusword, a heartbeat, or nothing
    with pytest.raises(
        (DriveFault, NoAnswer), match=r"went to 'switch on disabled'|left NMT|SYNCs in a row unanswered"
    ):
        run_incomplete(group, 10)


class TestGroupRpdo:
    """One frame for all torques, TPDO1 with the position alone."""

    SETTINGS = GroupSettings(group_rpdo=True)

    def test_a_cycle_has_five_frames_and_455_bits(self, rig):
        with rig.group(self.SETTINGS) as group:
            group.home()
            group.enable()
            run(group, 5)
            start = group.now_ns()
            run(group, 100)
            frames = rig.since(start)
        syncs = [place for place, frame in enumerate(frames) if frame.can_id == 0x080][
            1:101
        ]  # the first one is led by nobody
        cycle_ids = (0x080, 0x181, 0x182, 0x183, 0x200)
        cycles = [frame for frame in frames[syncs[0] : syncs[-1]] if frame.can_id in cycle_ids]
        rest = {frame.can_id for frame in frames[syncs[0] : syncs[-1]]} - set(cycle_ids)
        assert [frame.can_id for frame in cycles] == list(cycle_ids) * 99
        assert sum(worst_case_bits(len(frame.data)) for frame in cycles) == 99 * 455
        assert rest <= {*range(0x201, 0x204), *range(0x281, 0x284), *range(0x701, 0x780)}
        assert len([frame for frame in frames[syncs[0] : syncs[-1]] if frame.can_id == 0x281]) in {9, 10}

    def test_every_drive_takes_its_own_slot(self, rig):
        with rig.group(self.SETTINGS) as group:
            group.home()
            group.enable()
            run(group, 20, np.array([0.01, -0.02, 0.03]))
            targets = [drive.store.get(0x2071) for drive in rig.drives]
            reported = group.sample(group.now_ns() + PERIOD).torque
        assert targets == [201, -402, 603]
        assert reported == pytest.approx([0.01, -0.02, 0.03], rel=0.05)

    def test_the_drives_go_where_they_go_with_rpdos_of_their_own(self, rig):
        with rig.group(self.SETTINGS) as group:
            group.home()
            group.enable()
            run(group, 25)
            assert group.sample(group.now_ns() + PERIOD).q[0] - HOME[0] > 0.01
        assert all(drive.state is DriveState.SWITCH_ON_DISABLED for drive in rig.drives)

    def test_without_the_group_rpdo_the_drives_stop_by_its_watchdog(self, rig):
        group = rig.group(self.SETTINGS).__enter__()
        group.home()
        group.enable()
        run(group, 25)
        rig.bus.wait_until(group.now_ns() + 13 * MS)
        assert {drive.store.get(0x603F) for drive in rig.drives} <= {0x8250, 0x8700}
        assert all(drive.state is DriveState.FAULT for drive in rig.drives)

    def test_torques_that_do_not_fit_are_not_sent(self, rig):
        with rig.group(self.SETTINGS) as group:
            group.home()
            group.enable()
            start = group.now_ns()
            with pytest.raises(ValueError, match="16 bits"):
                group.command_raw([0, 0, 40_000], start)
            assert not [frame for frame in rig.since(start) if frame.can_id == 0x200]

    def test_somebody_else_who_sends_it_is_a_second_master(self, rig):
        group = rig.group(self.SETTINGS).__enter__()
        group.home()
        group.enable()
        group._session.pump.handlers[0x200](group.now_ns(), bytes(6))
        with pytest.raises(SecondMaster, match="it commands all drives"):
            run(group, 1)

    def test_a_make_without_fillers_cannot_share(self, rig):
        rig.axes[1] = replace(rig.axes[1], profile=replace(load_profile(), dummy_mapping=False))
        with pytest.raises(ProfileError, match=r"drive 2 .* cannot share an RPDO"):
            rig.group(self.SETTINGS)
