"""20 000 frames each to drives, driver and SDO machines: nothing raises, nothing grows, nothing is dropped in silence.

`long_run.py` does the same with a million, guided by coverage.
"""

import pytest
from fuzz_devices import DeviceTarget
from fuzz_frames import pause_ns
from fuzz_log import to_candump
from fuzz_maker import FrameMaker
from fuzz_session import TARGETS
from hypothesis import given, note, settings
from hypothesis import strategies as st
from long_run import seeded

FRAMES = 20_000


class DrawnSource:
    """Lets hypothesis decide, so that it can shrink what fails."""

    exhausted = False

    def __init__(self, draw):
        self._draw = draw

    def integer(self, low, high):
        return self._draw(st.integers(low, high))

    def octets(self, length):
        return self._draw(st.binary(min_size=length, max_size=length))


@pytest.mark.parametrize("target", TARGETS)
def test_no_hostile_wire_crashes_anyone(target):
    totals = seeded(target, FRAMES, seed=20261122)
    assert totals.report == "", totals.report
    assert totals.frames >= FRAMES


def test_every_kind_of_refusal_is_met():
    seen = seeded("devices", FRAMES // 2, seed=7).seen
    rare = {"RPDO too late", "SDO aborted by the client", "RPDO value refused", "emergency dropped"}
    names = set(DeviceTarget().refusals())
    assert {name for name in names - rare if not seen.get(name)} == set()


@settings(max_examples=25)
@given(st.data())
def test_whatever_hypothesis_thinks_of_crashes_no_drive(data):
    source = DrawnSource(data.draw)
    target = DeviceTarget()
    maker = FrameMaker(source)
    try:
        for _ in range(data.draw(st.integers(1, 12))):
            pause = pause_ns(source)
            for frame in maker.burst():
                target.say(frame, pause)
                pause = 0
        target.finish()
    except Exception:
        note(to_candump(target.log))
        raise
