"""The simulated torque transducer: golden bytes of CiA 301 and CiA 404, written down by hand, none from our codecs."""

import struct

import pytest

from torquerig.device_sim.canopen.core import NodeTiming
from torquerig.device_sim.transducer import SensorFault, SensorParameters, SimulatedTransducer
from torquerig.driver.wire.frame import Frame

MS = 1_000_000
NODE_ID = 10
PROMPT = NodeTiming(boot_ns=MS, answer_ns=0, sample_ns=0, reaction_ns=0)
QUIET = SensorParameters(noise=0.0)


class Bench:
    """Node 10 on a shaft whose torque [N·m] the test sets; frames in candump's notation."""

    def __init__(self, parameters=QUIET):
        self.torque = 0.0
        self.now_ns = 0
        self.node = SimulatedTransducer(NODE_ID, lambda _at_ns: self.torque, parameters, timing=PROMPT)
        self.node.advance(0)
        self.greeting = self.take()

    def take(self):
        return [f"{each.frame.can_id:03X}#{each.frame.data.hex(' ').upper()}" for each in self.node.take()]

    def say(self, text):
        identifier, data = text.split("#")
        self.node.receive(Frame(int(identifier, 16), bytes.fromhex(data)), self.now_ns)
        return self.take()

    def wait(self, until_ns):
        self.now_ns = until_ns
        self.node.advance(until_ns)
        return self.take()

    def process_value(self):
        """Read 9130:1 by expedited SDO; [10^-5 N·m]."""
        (answer,) = self.say("60A#40 30 91 01 00 00 00 00")
        assert answer.startswith("58A#43 30 91 01 ")
        return struct.unpack("<i", bytes.fromhex(answer[16:]))[0]

    def status(self):
        (answer,) = self.say("60A#40 50 61 01 00 00 00 00")
        return bytes.fromhex(answer[4:])[4]


@pytest.fixture
def bench():
    return Bench()


def test_it_greets_with_its_boot_up_message(bench):
    assert bench.greeting == ["70A#00"]


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        ("40 00 10 00", "43 00 10 00 94 01 02 00"),  # 1000: device profile 404, analogue input
        ("40 10 61 01", "4B 10 61 01 46 00 00 00"),  # 6110: 0x46, as a strain gauge's manual shows it
        ("40 12 61 01", "4F 12 61 01 01 00 00 00"),  # 6112: normal operation
        ("40 31 61 01", "43 31 61 01 00 00 56 00"),  # 6131: CiA 303-2: no prefix, N·m
        ("40 32 61 01", "4F 32 61 01 05 00 00 00"),  # 6132: 10^-5
        ("40 25 61 01", "80 25 61 01 01 00 01 06"),  # 6125 is write-only: 0601 0001
        ("40 30 71 01", "80 30 71 01 00 00 02 06"),  # the 16-bit process value is not there: 0602 0000
    ],
)
def test_its_objects_say_what_cia_404_says(bench, request_, answer):
    assert bench.say(f"60A#{request_} 00 00 00 00") == [f"58A#{answer}"]


def test_after_start_it_sends_torque_and_status_at_once_and_then_by_its_event_timer(bench):
    bench.torque = 0.25
    assert bench.say("000#01 0A") == ["18A#A8 61 00 00 00"]  # 25000 = 0x61A8, little endian; status 0
    bench.torque = -0.5
    sent = [frame for frame in bench.wait(100 * MS) if frame.startswith("18A")]
    assert sent == ["18A#B0 3C FF FF 00"]  # -50000


def test_with_type_1_it_answers_every_sync(bench):
    for request_ in ("23 00 18 01 8A 01 00 80", "2F 00 18 02 01 00 00 00", "23 00 18 01 8A 01 00 00"):
        (answer,) = bench.say(f"60A#{request_}")
        assert answer.startswith("58A#60 00 18")
    bench.say("000#01 0A")
    bench.torque = 0.1
    bench.wait(2 * MS)
    assert bench.say("080#") == ["18A#10 27 00 00 00"]  # 10000 = 0x2710


def test_the_word_zero_makes_the_present_torque_zero():
    bench = Bench(SensorParameters(noise=0.0, offset=0.01234))
    assert bench.process_value() == 1234
    assert bench.say("60A#23 25 61 01 7A 65 72 6F") == ["58A#60 25 61 01 00 00 00 00"]  # "zero", first letter first
    bench.torque = 0.5
    bench.wait(5 * MS)
    assert bench.process_value() == 50000
    assert bench.say("60A#40 24 91 01 00 00 00 00") == ["58A#43 24 91 01 2E FB FF FF"]  # 9124: -1234


def test_another_word_is_refused(bench):
    assert bench.say("60A#23 25 61 01 6F 72 65 7A") == ["58A#80 25 61 01 20 00 00 08"]


def test_beyond_its_range_it_says_overload(bench):
    bench.torque = 1.2
    assert (bench.process_value(), bench.status()) == (100000, 2)
    bench.torque = -1.2
    bench.wait(5 * MS)
    assert (bench.process_value(), bench.status()) == (-100000, 4)


def test_between_two_conversions_the_value_stands():
    bench = Bench(SensorParameters(noise=1e-3, seed=7))
    bench.wait(10 * MS)
    first = bench.process_value()
    bench.wait(11 * MS - 1)
    assert bench.process_value() == first
    bench.wait(11 * MS)
    assert bench.process_value() != first


def test_the_same_seed_makes_the_same_noise():
    def values(seed):
        bench = Bench(SensorParameters(noise=1e-3, seed=seed))
        return [(bench.wait(n * MS), bench.process_value())[1] for n in range(1, 40)]

    assert values(3) == values(3)
    assert values(3) != values(4)


def test_a_dead_one_stands_still_and_finds_nothing_wrong():
    bench = Bench(SensorParameters(noise=1e-3, seed=7))
    bench.node.suffer(SensorFault.DEAD, 0)
    first = bench.process_value()
    bench.torque = 0.4
    bench.wait(50 * MS)
    assert (bench.process_value(), bench.status()) == (first, 0)


def test_one_that_saturates_early_clips_and_does_not_notice():
    bench = Bench(SensorParameters(noise=0.0, fault=SensorFault.SATURATED))
    bench.torque = 0.4
    assert (bench.process_value(), bench.status()) == (30000, 0)


def test_a_broken_bridge_is_told_by_status_and_emergency():
    bench = Bench(SensorParameters(noise=0.0, fault=SensorFault.DISCONNECTED))
    assert bench.greeting == ["70A#00", "08A#00 50 21 00 00 00 00 00"]  # 0x5000: device hardware
    assert bench.status() == 3
    assert bench.say("60A#23 25 61 01 7A 65 72 6F") == ["58A#80 25 61 01 22 00 00 08"]
    bench.node.suffer(SensorFault.NONE, 5 * MS)
    assert bench.take() == ["08A#00 00 00 00 00 00 00 00"]


def test_one_mounted_the_other_way_round_shows_the_other_sign():
    bench = Bench(SensorParameters(noise=0.0, fault=SensorFault.REVERSED))
    bench.torque = 0.4
    assert bench.process_value() == -40000
