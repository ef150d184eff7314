"""A group of axes whose bus offers a port: what is sampled, commanded, noticed and refused is what frames give."""

import math
import struct
from contextlib import contextmanager

import numpy as np
import pytest

from torquerig.benchmarks.enabled import enabled_rotors
from torquerig.benchmarks.wire_answered import AnsweredBus
from torquerig.benchmarks.wire_places import place_of
from torquerig.driver.errors import DriveFault, NoAnswer, SecondMaster
from torquerig.driver.master.pump import FAR_NS
from torquerig.driver.wire.cia402 import DriveState
from torquerig.driver.wire.sync import SYNC_FRAME

AT_ONCE = 0
PERIOD_NS = 100_000_000  # half of it is what a drive has to answer in
ENABLED, DISABLED = 0x1237, 0x0250
TORQUES = np.array([0.1, -0.2, 0.3])


class Drives:
    """What the peer says after each SYNC, and what has come from the master since."""

    def __init__(self, peer) -> None:
        self._peer = peer
        self.answers = [(1, ENABLED, 100, 7), (2, ENABLED, -200, -7), (3, ENABLED, 300, 0)]
        self.others = []  # (COB-ID, data)
        peer.answer = self.answer
        self.close = peer.close

    def answer(self) -> None:
        for can_id, data in self.others:
            self._peer._send(can_id, data)
        for node_id, statusword, position, torque in self.answers:
            self._peer._send(0x180 + node_id, struct.pack("<Hih", statusword, position, torque))

    def _frames(self) -> list[tuple[int, bytes]]:
        return list(iter(self._peer._take, None))

    def heard(self) -> list[int]:
        return [can_id for can_id, _ in self._frames()]

    def torques(self) -> list[int]:
        return [struct.unpack("<Hh", data)[1] for can_id, data in self._frames() if 0x201 <= can_id <= 0x203]


def sample_times(group, times: int) -> None:
    for _ in range(times):
        group.sample(AT_ONCE)


def cycle(group) -> None:
    group.sample(AT_ONCE)
    group.command(TORQUES, AT_ONCE)


@contextmanager
def enabled(url: str, folder):
    opened, peer = place_of(url, folder).ours()
    drives = Drives(peer)
    bus = AnsweredBus(opened, peer)
    with enabled_rotors(3, period_ns=PERIOD_NS, now_ns=bus.now_ns()) as rotors, rotors.moved_to(bus):
        assert rotors.group.session.exchange.port is not None
        yield rotors.group, drives
    opened.close()
    drives.close()


@pytest.fixture(scope="module", params=["pair:", "unix:"])
def shared(request, tmp_path_factory):
    with enabled(request.param, tmp_path_factory.mktemp("bus")) as (group, drives):
        yield group, drives, drives.answers


@pytest.fixture
def rig(shared):
    """A group that the test leaves as it was."""
    group, drives, answers = shared
    drives.answers = list(answers)
    drives.heard()
    yield group, drives
    drives.answers = list(answers)
    group.sample(AT_ONCE)


@pytest.fixture
def mortal(request, tmp_path):
    """A group of the test's own."""
    with enabled(getattr(request, "param", "unix:"), tmp_path) as made:
        yield made


def test_a_sample_is_in_si_units_and_a_command_reaches_every_drive(rig):
    group, drives = rig
    scales = [axis.scale for axis in group.axes]
    for _ in range(5):
        sample = group.sample(AT_ONCE)
        assert sample.complete
        assert sample.q.tolist() == [scale.angle(at) for scale, at in zip(scales, (100, -200, 300), strict=True)]
        assert sample.torque.tolist() == [scale.torque(at) for scale, at in zip(scales, (7, -7, 0), strict=True)]
        assert not np.isnan(sample.answered_ns).any()
        group.command(TORQUES, AT_ONCE)
        assert [can_id for can_id in drives.heard() if can_id != 0x77F] == [SYNC_FRAME.can_id, 0x201, 0x202, 0x203]


def test_a_sample_is_the_callers_own(rig):
    group, drives = rig
    before = group.sample(AT_ONCE)
    kept = before.q.copy()
    drives.answers[0] = (1, ENABLED, 5000, 0)
    group.sample(AT_ONCE)
    assert (before.q == kept).all()


def test_a_sample_and_a_command_wait_for_their_time(rig):
    group, _ = rig
    due_ns = group.now_ns() + 5_000_000
    assert group.sample(due_ns).at_ns >= due_ns
    group.command(TORQUES, due_ns + 5_000_000)
    assert group.now_ns() >= due_ns + 5_000_000


def test_raw_counts_go_the_same_way(rig):
    group, _ = rig
    sample = group.sample_raw(AT_ONCE)
    assert (sample.positions.tolist(), sample.torques.tolist()) == ([100, -200, 300], [7, -7, 0])
    assert sample.complete


def test_who_stays_silent_is_left_out_and_then_stops_the_group(mortal):
    group, drives = mortal
    missing = drives.answers.pop(1)
    sample = group.sample(AT_ONCE)
    assert not sample.complete
    assert np.isnan(sample.answered_ns).tolist() == [False, True, False]
    assert group.cycle_counts.missed == [0, 1, 0]
    drives.answers.insert(1, missing)
    assert group.sample(AT_ONCE).complete
    drives.answers.pop(1)
    with pytest.raises(NoAnswer, match="drive 2 left 4 SYNCs in a row unanswered"):
        sample_times(group, 4)


def test_a_drive_that_leaves_operation_stops_the_group_in_that_cycle(mortal):
    group, drives = mortal
    group.sample(AT_ONCE)
    drives.answers[2] = (3, 0x1218, 300, 0)  # fault
    with pytest.raises(DriveFault, match="drive 3"):
        group.sample(AT_ONCE)


@pytest.mark.parametrize("mortal", ["pair:", "unix:"], indirect=True)
def test_an_emergency_is_noticed_before_the_torques_of_that_cycle_go_out(mortal):
    group, drives = mortal
    drives.others = [(0x082, struct.pack("<HB5x", 0x7310, 0x01))]
    with pytest.raises(DriveFault, match="0x7310"):
        cycle(group)
    assert set(drives.torques()) <= {0}


def test_a_late_statusword_is_heard_with_the_torques_and_does_not_wait_for_the_next_sample(mortal):
    group, drives = mortal
    drives.answers.pop(0)
    group.sample(AT_ONCE)
    drives._peer._send(0x181, struct.pack("<Hih", DISABLED, 100, 0))
    group.command(TORQUES, AT_ONCE)
    assert group.axes[0].state is DriveState.SWITCH_ON_DISABLED
    with pytest.raises(DriveFault, match="drive 1"):
        group.sample(AT_ONCE)


def test_another_master_is_noticed(mortal):
    group, drives = mortal
    drives.others = [(SYNC_FRAME.can_id, b"")]
    with pytest.raises(SecondMaster):
        cycle(group)


@pytest.mark.parametrize(
    "torques", [np.array([1, 0, -1]), np.array([0.5, 0.25, -1], dtype=np.float32), np.arange(6.0)[::-2] / 10]
)
def test_torques_of_any_kind_of_number_are_taken(rig, torques):
    group, drives = rig
    group.sample(AT_ONCE)
    drives.heard()
    group.command(torques, AT_ONCE)
    scales = [axis.scale for axis in group.axes]
    assert drives.torques() == [scale.torque_counts(tau) for scale, tau in zip(scales, torques.tolist(), strict=True)]


def test_controlwords_follow_the_drives_states(mortal):
    group, drives = mortal
    group.sample(AT_ONCE)
    drives.heard()
    group.axes[1].aim(DriveState.SWITCH_ON_DISABLED)
    group.command(TORQUES, AT_ONCE)
    words = [struct.unpack("<Hh", data)[0] for can_id, data in drives._frames() if 0x201 <= can_id <= 0x203]
    assert words == [0x0F, 0x00, 0x0F]


def test_what_is_added_while_a_loop_leads_happens_with_the_next_sync(rig):
    group, _ = rig
    fired = []

    class Once:
        due_ns = 0

        def fire(self, now_ns):
            fired.append(now_ns)
            self.due_ns = FAR_NS

    once, pump = Once(), group.session.pump
    group.sample(AT_ONCE)
    pump.add_timed(once)
    sample_times(group, 3)
    pump.remove_timed(once)
    assert len(fired) == 1


@pytest.mark.parametrize(
    "torques", [np.array([0.1, math.nan, 0.1]), np.array([0.1]), np.zeros((1, 3)), np.zeros((3, 1))]
)
def test_what_are_no_torques_is_refused_and_nothing_is_sent(rig, torques):
    group, drives = rig
    group.sample(AT_ONCE)
    drives.heard()
    with pytest.raises(ValueError, match="torques"):
        group.command(torques, AT_ONCE)
    assert 0x201 not in drives.heard()
