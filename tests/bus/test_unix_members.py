"""The unix bus among its members: who comes, who goes, who is killed, who sleeps, who talks nonsense."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import can
import pytest

from torquerig.driver.bus.unix import UnixBus

PATIENCE_S = 20.0  # real time on a shared machine: order and content are asserted, never speed

MEMBER = """
import sys, can
bus = can.Bus(interface="unix", channel=sys.argv[1])
print("in", flush=True)
sys.stdin.readline()
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "bus"


def numbered(number: int) -> can.Message:
    return can.Message(arbitration_id=0x181, data=number.to_bytes(4, "little"), is_extended_id=False)


def numbers(bus: UnixBus, count: int) -> list[int]:
    messages = [bus.recv(PATIENCE_S) for _ in range(count)]
    return [int.from_bytes(message.data, "little") for message in messages]


def all_waiting(bus: UnixBus) -> list[int]:
    came = []
    while (message := bus.recv(0)) is not None:
        came.append(int.from_bytes(message.data, "little"))
    return came


def start_member(folder: Path) -> subprocess.Popen[bytes]:
    process = subprocess.Popen(
        [sys.executable, "-c", MEMBER, str(folder)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert process.stdout.readline() == b"in\n"
    return process


def kill(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.communicate(timeout=PATIENCE_S)


def test_python_can_knows_the_interface_by_its_entry_point(folder):
    with can.Bus(interface="unix", channel=str(folder), bitrate=1_000_000) as bus:
        assert isinstance(bus, UnixBus)


def test_each_of_four_members_hears_the_other_three(folder):
    buses = [UnixBus(folder) for _ in range(4)]
    for k, bus in enumerate(buses):
        bus.send(numbered(k))
    for k, bus in enumerate(buses):
        assert numbers(bus, 3) == [other for other in range(4) if other != k]
        assert bus.recv(0) is None
        bus.shutdown()


def test_a_member_that_asks_for_it_hears_itself_and_can_tell(folder):
    with UnixBus(folder, receive_own_messages=True) as bus:
        bus.send(numbered(1))
        message = bus.recv(0)
        assert message is not None
        assert not message.is_rx
        assert bus.recv(0) is None


def test_a_newcomer_hears_all_that_is_sent_once_it_is_there(folder):
    with UnixBus(folder) as old:
        old.send(numbered(0))
        with UnixBus(folder) as newcomer:
            old.send(numbered(1))
            newcomer.send(numbered(2))
            assert numbers(newcomer, 1) == [1]
            assert numbers(old, 1) == [2]
        old.send(numbered(3))
        assert old.members == 0


def test_a_killed_member_is_forgotten_and_the_others_go_on(folder):
    with UnixBus(folder) as one, UnixBus(folder) as two:
        victim = start_member(folder)
        one.send(numbered(0))
        assert one.members == 2
        kill(victim)
        for k in range(1, 50):
            one.send(numbered(k))
        assert numbers(two, 50) == list(range(50))
        assert one.members == 1
        assert one.counts["not_taken"] == 0


def test_the_socket_of_a_killed_member_is_swept_by_the_next_that_comes(folder):
    kill(start_member(folder))
    assert len(list(folder.glob("member-*.sock"))) == 1
    with UnixBus(folder) as bus:
        (left,) = folder.glob("member-*.sock")
        assert left.name.startswith(f"member-{os.getpid()}-")
        bus.send(numbered(0))
    assert not list(folder.glob("member-*.sock"))


def test_a_stalled_member_costs_the_others_nothing_and_learns_what_it_missed(folder):
    with UnixBus(folder) as sender, UnixBus(folder) as healthy, UnixBus(folder) as stalled:
        total = 0
        while sender.counts["not_taken"] < 500:
            sender.send(numbered(total))
            assert numbers(healthy, 1) == [total]
            total += 1
        lost = sender.counts["not_taken"]
        assert sender.not_taken == {os.getpid(): lost}
        kept = all_waiting(stalled)
        assert kept == list(range(total - lost))  # what fitted, in order
        sender.send(numbered(total))
        assert numbers(stalled, 1) == [total]
        assert stalled.counts["missed"] == lost
        assert healthy.counts["missed"] == 0


def test_a_stopped_process_does_not_hold_up_the_others(folder):
    with UnixBus(folder) as sender, UnixBus(folder) as healthy:
        sleeper = start_member(folder)
        try:
            sleeper.send_signal(signal.SIGSTOP)
            for k in range(5000):
                sender.send(numbered(k))
                assert numbers(healthy, 1) == [k]
            assert sender.not_taken.keys() <= {sleeper.pid}
            with UnixBus(folder) as newcomer:  # nor does it keep anyone from joining
                newcomer.send(numbered(7))
                assert numbers(healthy, 1) == [7]
        finally:
            kill(sleeper)


def test_a_receiver_that_stalled_takes_frames_in_the_order_of_sending_with_the_times_of_sending(folder):
    with UnixBus(folder) as one, UnixBus(folder) as two, UnixBus(folder) as late:
        before = time.time()
        for k in range(20):
            (one if k % 3 else two).send(numbered(k))
        after = time.time()
        time.sleep(0.05)
        messages = [late.recv(PATIENCE_S) for _ in range(20)]
        assert [int.from_bytes(message.data, "little") for message in messages] == list(range(20))
        stamps = [message.timestamp for message in messages]
        assert stamps == sorted(stamps)
        assert before - 0.01 <= stamps[0]
        assert stamps[-1] <= after + 0.01


def test_what_a_member_said_before_it_left_is_still_heard(folder):
    with UnixBus(folder) as stays:
        with UnixBus(folder) as leaves:
            stays.send(numbered(100))  # unread by the one that leaves
            for k in range(10):
                leaves.send(numbered(k))
        stays.send(numbered(101))
        assert numbers(stays, 10) == list(range(10))


def test_members_that_join_at_the_same_time_all_find_each_other_once(folder):
    barrier = threading.Barrier(12)

    def join(_: int) -> UnixBus:
        barrier.wait()
        return UnixBus(folder)

    with ThreadPoolExecutor(12) as pool:
        buses = list(pool.map(join, range(12)))
    for k, bus in enumerate(buses):
        bus.send(numbered(k))
    for k, bus in enumerate(buses):
        assert sorted(numbers(bus, 11)) == [other for other in range(12) if other != k]
        assert bus.recv(0) is None
        bus.shutdown()


def test_a_notifier_thread_hears_while_another_thread_sends(folder):
    reader = can.BufferedReader()
    with UnixBus(folder) as one, UnixBus(folder) as two:
        notifier = can.Notifier(one, [reader], timeout=0.01)
        for k in range(200):
            two.send(numbered(k))
            one.send(numbered(k))
        came = [reader.get_message(PATIENCE_S) for _ in range(200)]
        notifier.stop()
        assert [int.from_bytes(message.data, "little") for message in came] == list(range(200))
        assert numbers(two, 200) == list(range(200))


def test_the_file_descriptor_is_readable_as_long_as_frames_wait(folder):
    with UnixBus(folder) as one, UnixBus(folder, receive_own_messages=True) as two:
        assert not select.select([two], [], [], 0)[0]
        for k in range(5):
            one.send(numbered(k))
        two.send(numbered(5))
        for _ in range(6):
            assert select.select([two], [], [], PATIENCE_S)[0]
            two.recv(0)
        assert not select.select([two], [], [], 0)[0]


def test_a_thread_that_waits_is_told_when_the_bus_closes(folder):
    bus = UnixBus(folder)
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(bus.recv, None)
        time.sleep(0.05)
        bus.shutdown()
        with pytest.raises(can.CanOperationError, match="shut down"):
            waiting.result(PATIENCE_S)


def test_a_closed_member_says_so(folder):
    bus = UnixBus(folder)
    bus.shutdown()
    with pytest.raises(can.CanOperationError, match="shut down"):
        bus.send(numbered(0))
    with pytest.raises(can.CanOperationError, match="shut down"):
        bus.recv(0)


def test_an_fd_frame_is_refused(folder):
    with UnixBus(folder) as bus, pytest.raises(can.CanOperationError, match="classic CAN frames only"):
        bus.send(can.Message(arbitration_id=1, data=bytes(16), is_fd=True))


def test_filters_apply_at_once_also_when_nobody_waits(folder):
    with UnixBus(folder) as one, UnixBus(folder, [{"can_id": 0x700, "can_mask": 0x780}]) as two:
        for can_id in (0x181, 0x181, 0x701):
            one.send(can.Message(arbitration_id=can_id, is_extended_id=False))
        message = two.recv(0)
        assert message is not None
        assert message.arbitration_id == 0x701
