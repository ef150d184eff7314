"""The fuzzers are awake: what is broken on purpose is found, told as a log, and happens again when that is replayed."""

import pytest
from fuzz_driver import DriverTarget
from fuzz_log import Timed, from_candump, shortest, to_candump
from fuzz_memory import footprint
from fuzz_session import FRAMES, TARGETS, play
from fuzz_source import OctetSource, SeededSource
from fuzz_wire import HostileWire, ReplayedWire
from hypothesis import given
from hypothesis import strategies as st
from long_run import main

from torquerig.device_sim.canopen.node import CanopenNode
from torquerig.device_sim.canopen.rpdo import Rpdo
from torquerig.device_sim.drive.state_machine import PowerStateMachine
from torquerig.device_sim.drive.watchdog import Watchdogs
from torquerig.driver.master import watch
from torquerig.driver.wire.frame import Frame


def raises(*_arguments):
    raise IndexError("planted")


def first_failure(target):
    """The first session that fails, of a few."""
    outcomes = (TARGETS[target](SeededSource(seed)) for seed in range(8))
    return next(outcome.failure for outcome in outcomes if outcome.failure)


def frames_in(report):
    """The log in a report, as whoever copies it out of a terminal has it."""
    return from_candump("\n".join(line for line in report.splitlines() if line.startswith("(")))


def test_an_exception_of_a_drive_is_found_and_shrunk_and_replayed(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(Rpdo, "_judge_length", raises)
    failure = first_failure("devices")
    assert "planted" in failure.error
    assert len(failure.log) <= 4
    log = tmp_path / "failure.log"
    log.write_text(to_candump(frames_in(failure.report)), "ascii")
    assert main(["--replay", str(log)]) == 1
    assert "planted" in capsys.readouterr().out
    monkeypatch.undo()
    assert main(["--replay", str(log)]) == 0


def test_torque_that_outlives_nmt_operational_is_found(monkeypatch):
    monkeypatch.setattr(Watchdogs, "handle_event", lambda *_: None)
    failure = first_failure("devices")
    assert "N·m in NMT" in failure.error
    assert play(frames_in(failure.report), ()) is not None


def test_a_short_cut_to_operation_enabled_is_found(monkeypatch):
    obey = PowerStateMachine.obey
    monkeypatch.setattr(PowerStateMachine, "obey", lambda self, word, at_ns: obey(self, word | 0x06, at_ns))
    assert "the enable sequence was not on the wire" in first_failure("devices").error


def test_a_refusal_that_is_not_counted_is_found(monkeypatch):
    monkeypatch.setattr(CanopenNode, "_refuse", lambda *_: None)
    assert "neither answered nor counted" in first_failure("devices").error


def test_an_exception_of_the_driver_is_found_and_replayed(monkeypatch):
    decode = watch.emcy.decode_payload
    monkeypatch.setattr(
        watch.emcy, "decode_payload", lambda node, data: decode(node, data) if len(data) == 8 else raises()
    )
    failure = first_failure("driver")
    assert "planted" in failure.error
    assert "planted" in play(frames_in(failure.report), failure.plan)
    monkeypatch.undo()
    assert play(failure.log, failure.plan) is None


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_replayed_driver_says_the_same_at_the_same_times(monkeypatch, seed):
    said = {wire: spied_on(monkeypatch, wire) for wire in (HostileWire, ReplayedWire)}
    target = DriverTarget(SeededSource(seed))
    target.session()
    target.driver.close()
    assert play(from_candump(to_candump(target.wire.log)), target.plan) is None
    assert len(said[HostileWire]) > 100
    assert said[ReplayedWire] == said[HostileWire]


def spied_on(monkeypatch, wire):
    """All that a driver says on a kind of wire, from now on."""
    said, submit = [], wire.submit
    monkeypatch.setattr(wire, "submit", lambda self, frame: (said.append((self.now_ns(), frame)), submit(self, frame)))
    return said


def test_a_list_that_grows_is_seen():
    root = {"kept": [Timed(0, Frame(1))] * 10, "more": bytearray(5)}
    before = footprint(root)
    root["kept"] += [None] * 1000
    assert footprint(root).elements - before.elements == 1000
    assert footprint(root).largest == 1010
    assert footprint(root, without=(list,)).largest < 1000


times = st.integers(0, 10**12).map(lambda microseconds: microseconds * 1000)
identifiers = st.tuples(st.integers(0, 0x7FF), st.just(value=False)) | st.tuples(  # and whether it is an extended one
    st.integers(0, 0x1FFF_FFFF), st.just(value=True)
)
frames = st.builds(lambda head, data: Frame(head[0], data, extended=head[1]), identifiers, st.binary(max_size=8))
frames |= st.builds(lambda head, n: Frame(head[0], bytes(n), True, head[1]), identifiers, st.integers(0, 8))


@given(st.lists(st.builds(Timed, times, frames), max_size=5))
def test_a_log_holds_every_frame(log):
    assert from_candump(to_candump(log)) == log


def test_what_candump_does_not_write_is_no_log():
    with pytest.raises(ValueError, match="no line of candump"):
        from_candump("601#40")


def test_the_shortest_log_holds_what_is_needed_and_no_more():
    log = [Timed(number, Frame(number)) for number in range(300)]
    needed = {17, 18, 255}
    assert {each.at_ns for each in shortest(log, lambda some: needed <= {each.at_ns for each in some})} == needed


def test_one_seed_is_one_session():
    one, other = (TARGETS["devices"](SeededSource(5)) for _ in range(2))
    assert (one.frames, one.seen) == (other.frames, other.seen)
    assert one.frames >= FRAMES


def test_few_bytes_make_a_short_session():
    assert TARGETS["devices"](OctetSource(b"")).frames <= 10
    assert TARGETS["driver"](OctetSource(bytes(50))).failure is None
    assert TARGETS["sdo"](OctetSource(b"")).failure is None
