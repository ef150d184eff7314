"""Heartbeat and guarding: who says what, in which order (CiA 301, 7.2.8.3.2). Their times: see the timelines."""

import pytest
from conversation import golden, talk

pytestmark = pytest.mark.conformance("Heartbeat and guarding", "golden bytes")

BEAT = """
    > 601#2B 17 10 00 0A 00 00 00
    < 581#60 17 10 00 00 00 00 00"""
WATCH_127 = """
    > 601#23 16 10 01 64 00 7F 00
    < 581#60 16 10 01 00 00 00 00"""
LOST = "\n < 081#30 81 11 .. .. .. .. .."
BACK = "\n < 081#00 00 00 .. .. .. .. .."


@golden(
    {
        "a heartbeat says pre-operational": "~ 701#7F" + BEAT + "\n < 701#7F\n < 701#7F",
        "a heartbeat says operational": "> 000#01 01\n ~ 701#05" + BEAT + "\n < 701#05\n < 701#05",
        "a heartbeat says stopped": BEAT.replace("\n    <", "\n ~ 701#7F\n <") + "\n > 000#02 01\n ~ 701#04\n < 701#04",
        "the heartbeat of a watched node is missing: EMCY 8130; it is back: EMCY 0000": WATCH_127
        + "\n > 77F#05"
        + LOST
        + "\n > 77F#05"
        + BACK
        + LOST,
        "a boot-up message is a heartbeat for its consumer": WATCH_127 + "\n > 77F#00" + LOST,
        "a heartbeat of two bytes is none": WATCH_127 + "\n > 77F#05 05",
        "no longer watched: the error is gone": WATCH_127
        + "\n > 77F#05"
        + LOST
        + "\n > 601#23 16 10 01 00 00 00 00"
        + BACK
        + "\n < 581#60 16 10 01 00 00 00 00",
        "a missing heartbeat in operational leads to pre-operational (1029:1 = 0)": "> 000#01 01"
        + WATCH_127
        + "\n > 77F#05"
        + LOST
        + "\n > 701#R1\n < 701#7F",
        "a missing heartbeat changes no state (1029:1 = 1)": """
            > 000#01 01
            > 601#2F 29 10 01 01 00 00 00
            < 581#60 29 10 01 00 00 00 00"""
        + WATCH_127
        + "\n > 77F#05"
        + LOST
        + "\n > 701#R1\n < 701#05",
        "a missing heartbeat leads to stopped (1029:1 = 2)": """
            > 000#01 01
            > 601#2F 29 10 01 02 00 00 00
            < 581#60 29 10 01 00 00 00 00"""
        + WATCH_127
        + "\n > 77F#05"
        + LOST
        + "\n > 701#R1\n < 701#04",
        "guarding answers with a bit 7 that toggles": """
            > 701#R1
            < 701#7F
            > 701#R1
            < 701#FF
            > 701#R1
            < 701#7F
            > 000#01 01
            > 701#R1
            < 701#85
            > 000#02 01
            > 701#R1
            < 701#04""",
        "the toggle bit begins with 0 after reset communication": """
            > 701#R1
            < 701#7F
            ~ 701#7F
            > 000#82 01
            < 701#00
            > 601#2B 17 10 00 00 00 00 00
            < 581#60 17 10 00 00 00 00 00
            > 701#R1
            < 701#7F
            > 701#R1
            < 701#FF""",
        "no guarding while there is a heartbeat (1017)": "~ 701#7F" + BEAT + "\n > 701#R1 x4",
        "a guarding master that falls silent: EMCY 8130; it asks again: EMCY 0000": """
            > 601#2B 0C 10 00 32 00 00 00
            < 581#60 0C 10 00 00 00 00 00
            > 601#2F 0D 10 00 02 00 00 00
            < 581#60 0D 10 00 00 00 00 00
            > 701#R1
            < 701#7F"""
        + LOST
        + "\n > 701#R1"
        + BACK
        + "\n < 701#FF"
        + LOST,
    }
)
def test_error_control(line, golden):
    talk(line, golden.text)
