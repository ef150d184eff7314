"""When a node speaks: heartbeats, guarding, EMCY, SDO (CiA 301), in virtual time."""

import pytest
from conversation import golden

pytestmark = pytest.mark.conformance("Times of communication", "golden bytes at exact times", bus="bench")

BEAT_10 = "\n 0 > 601#2B 17 10 00 0A 00 00 00\n 0 < 581#60 17 10 00 00 00 00 00"
RESET = "\n 0 > 000#81 01\n 1 < 701#00"


@golden(
    {
        "one every 1017 from the moment it is written": BEAT_10
        + """
            10 < 701#7F
            20 < 701#7F
            30 < 701#7F
            35 < .""",
        "the boot-up message begins the first period": RESET
        + """
            51 < 701#7F
            101 < 701#7F
            120 < .""",
        "a write begins a new period": BEAT_10
        + """
            5 > 601#2B 17 10 00 14 00 00 00
            5 < 581#60 17 10 00 00 00 00 00
            25 < 701#7F
            45 < 701#7F
            60 < .""",
        "0 ends it": BEAT_10
        + """
            10 < 701#7F
            15 > 601#2B 17 10 00 00 00 00 00
            15 < 581#60 17 10 00 00 00 00 00
            500 < .""",
        "a change of the NMT state does not shift it": BEAT_10
        + """
            10 < 701#7F
            13 > 000#01 01
            20 < 701#05
            27 > 000#02 01
            30 < 701#04
            35 < .""",
    }
)
def test_heartbeat(bench, golden):
    bench.follow(golden.text)


WATCH = "\n 0 > 601#23 16 10 01 64 00 7F 00\n 0 < 581#60 16 10 01 00 00 00 00"
LOST, BACK = "081#30 81 11 .. .. .. .. ..", "081#00 00 00 .. .. .. .. .."
GUARDED = """
    > 601#2B 0C 10 00 32 00 00 00
    < 581#60 0C 10 00 00 00 00 00
    > 601#2F 0D 10 00 02 00 00 00
    < 581#60 0D 10 00 00 00 00 00"""


@golden(
    {
        "is not missed before the first": WATCH + "\n 5000 < .",
        "is missed 1016 after the last": WATCH
        + f"""
            10 > 77F#05
            110 < {LOST}
            1000 < .""",
        "just in time is in time": WATCH
        + f"""
            10 > 77F#05
            109.999999 > 77F#05
            209.999999 < {LOST}
            300 < .""",
        "is back with the next one": WATCH
        + f"""
            0 > 77F#05
            100 < {LOST}
            150 > 77F#05
            150 < {BACK}
            250 < {LOST}
            300 < .""",
        "missing in stopped is told when stopped is left": WATCH
        + f"""
            0 > 77F#05
            1 > 000#02 01
            150 > 000#80 01
            150 < {LOST}
            300 < .""",
        "is not missed by a node that was reset, before the first": WATCH
        + """
            0 > 77F#05
            10 > 000#82 01
            11 < 701#00
            20 > 601#2B 17 10 00 00 00 00 00
            20 < 581#60 17 10 00 00 00 00 00
            1000 < .""",
    }
)
def test_watched_heartbeat(bench, golden):
    bench.follow(golden.text)


@golden(
    {
        "does not begin before the first request": "1000 < .",
        "ends 100C x 100D after the last request": f"""
            0 > 701#R1
            0 < 701#7F
            60 > 701#R1
            60 < 701#FF
            160 < {LOST}
            500 < .""",
        "is back with the next request": f"""
            0 > 701#R1
            0 < 701#7F
            100 < {LOST}
            130 > 701#R1
            130 < 701#FF
            130 < {BACK}
            230 < {LOST}
            300 < .""",
    }
)
def test_life_guarding(bench, golden):
    bench.prepare(GUARDED)
    bench.follow(golden.text)


@golden(
    {
        "1015 stands between two": """
            0 > 601#2B 15 10 00 64 00 00 00
            0 < 581#60 15 10 00 00 00 00 00
            1 > 601#23 00 2F 00 03 00 00 00
            1 < 081#10 43 09 .. .. .. .. ..
            1 < 581#60 00 2F 00 00 00 00 00
            2 > 601#23 00 2F 00 06 00 00 00
            2 < 581#60 00 2F 00 00 00 00 00
            3 > 601#23 00 2F 00 01 00 00 00
            3 < 581#60 00 2F 00 00 00 00 00
            11 < 081#10 32 0D .. .. .. .. ..
            21 < 081#10 23 0F .. .. .. .. ..
            50 < .""",
        "without 1015 none waits": """
            1 > 601#23 00 2F 00 03 00 00 00
            1 < 081#10 43 09 .. .. .. .. ..
            1 < 581#60 00 2F 00 00 00 00 00
            2 > 601#23 00 2F 00 06 00 00 00
            2 < 081#10 32 0D .. .. .. .. ..
            2 < 581#60 00 2F 00 00 00 00 00
            50 < .""",
        "what waits is forgotten by a reset": """
            0 > 601#2B 15 10 00 64 00 00 00
            0 < 581#60 15 10 00 00 00 00 00
            1 > 601#23 00 2F 00 03 00 00 00
            1 < 081#10 43 09 .. .. .. .. ..
            1 < 581#60 00 2F 00 00 00 00 00
            2 > 601#23 00 2F 00 06 00 00 00
            2 < 581#60 00 2F 00 00 00 00 00
            3 > 000#81 01
            4 < 701#00
            54 < 701#7F
            60 < .""",
    }
)
def test_emcy_inhibit_time(bench, golden):
    bench.follow(golden.text)


@golden(
    {
        "before the boot-up message nothing is heard or said": """
            0 > 000#81 01
            0.5 > 601#40 00 10 00 00 00 00 00
            0.6 > 000#01 01
            0.7 > 080#
            0.8 > 701#R1
            1 < 701#00
            1.1 > 601#40 00 10 00 00 00 00 00
            1.1 < 581#43 00 10 00 92 01 02 00
            51 < 701#7F
            60 < .""",
    }
)
def test_initialisation(bench, golden):
    bench.follow(golden.text)


@golden(
    {
        "is asked for the rest of a block, and the transfer aborted in the end (0504 0000)": """
            0 > 601#C6 06 10 00 04 00 00 00
            0 < 581#A4 06 10 00 7F 00 00 00"""
        + "".join(f"\n {200 * n} < 581#A2 00 7F 00 00 00 00 00" for n in range(1, 17))
        + """
            3400 < 581#80 06 10 00 00 00 04 05
            5000 < .""",
        "may end its block later, and loses nothing": """
            0 > 601#C6 06 10 00 04 00 00 00
            0 < 581#A4 06 10 00 7F 00 00 00
            200 < 581#A2 00 7F 00 00 00 00 00
            250 > 601#81 40 1F 00 00 00 00 00
            250 < 581#A2 01 7F 00 00 00 00 00
            251 > 601#CD CE 01 00 00 00 00 00
            251 < 581#A1 00 00 00 00 00 00 00
            252 > 601#40 06 10 00 00 00 00 00
            252 < 581#43 06 10 00 40 1F 00 00
            500 < .""",
    }
)
def test_client_that_falls_silent(bench, golden):
    bench.follow(golden.text)
