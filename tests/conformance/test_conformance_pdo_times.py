"""When process data are sent and taken: inhibit times, event timers, the synchronous window, in virtual time.

CiA 301, 7.2.2, 7.5.2.7 and 7.5.2.37.
"""

import pytest
from conversation import golden

pytestmark = pytest.mark.conformance("Times of communication", "golden bytes at exact times", bus="bench")

# TPDO3: the statusword on 0x381; inhibit time 1802:3 in 100 us, event timer 1802:5 in ms
TPDO3 = """
    > 601#23 02 1A 01 10 00 41 60
    < 581#60 02 1A 01 00 00 00 00
    > 601#2F 02 1A 00 01 00 00 00
    < 581#60 02 1A 00 00 00 00 00
    > 601#2F 02 18 02 {type} 00 00 00
    < 581#60 02 18 02 00 00 00 00
    > 601#2B 02 18 03 {inhibit} 00 00 00
    < 581#60 02 18 03 00 00 00 00
    > 601#2B 02 18 05 {event} 00 00 00
    < 581#60 02 18 05 00 00 00 00
    > 601#23 02 18 01 81 03 00 00
    < 581#60 02 18 01 00 00 00 00"""


@pytest.mark.parametrize("kind", ["FE", "FF"])
@golden(
    {
        "the inhibit time stands between two": """
            0 > 000#01 01
            0 < 381#50 02
            1 > 201#06 00 00 00
            10 < 381#31 02
            15 > 201#07 00 00 00
            20 < 381#33 02
            40 > 201#06 00 00 00
            40 < 381#31 02
            60 < .""",
        "of events within the inhibit time the last is told": """
            0 > 000#01 01
            0 < 381#50 02
            1 > 201#06 00 00 00
            2 > 201#07 00 00 00
            3 > 201#06 00 00 00
            10 < 381#31 02
            30 < .""",
    }
)
def test_inhibit_time(bench, golden, kind):
    bench.prepare(TPDO3.format(type=kind, inhibit="64", event="00"))
    bench.follow(golden.text)


@pytest.mark.parametrize("kind", ["FE", "FF"])
@golden(
    {
        "without events one comes every 1802:5": """
            0 > 000#01 01
            0 < 381#50 02
            20 < 381#50 02
            40 < 381#50 02
            50 < .""",
        "an event begins a new period": """
            0 > 000#01 01
            0 < 381#50 02
            15 > 201#06 00 00 00
            15 < 381#31 02
            35 < 381#31 02
            55 < 381#31 02
            60 < .""",
        "it ends with operational": """
            0 > 000#01 01
            0 < 381#50 02
            10 > 000#80 01
            100 < .""",
        "a write begins a new period": """
            0 > 000#01 01
            0 < 381#50 02
            5 > 601#2B 02 18 05 1E 00 00 00
            5 < 381#50 02
            5 < 581#60 02 18 05 00 00 00 00
            35 < 381#50 02
            40 < .""",
    }
)
def test_event_timer(bench, golden, kind):
    bench.prepare(TPDO3.format(type=kind, inhibit="00", event="14"))
    bench.follow(golden.text)


@golden(
    {
        "the inhibit time outlasts the event timer": """
            0 > 000#01 01
            0 < 381#50 02
            30 < 381#50 02
            60 < 381#50 02
            70 < .""",
    }
)
def test_inhibit_time_and_event_timer(bench, golden):
    bench.prepare(TPDO3.format(type="FF", inhibit="2C 01", event="14").replace("2C 01 00 00 00", "2C 01 00 00"))
    bench.follow(golden.text)


@golden(
    {
        "a synchronous TPDO has none": """
            0 > 000#01 01
            0 > 080#
            0 < 381#50 02
            100 < .""",
    }
)
def test_event_timer_of_type_1(bench, golden):
    bench.prepare(TPDO3.format(type="01", inhibit="00", event="14"))
    bench.prepare("> 601#23 00 18 01 81 01 00 80\n < 581#60 00 18 01 00 00 00 00")
    bench.follow(golden.text)


@golden(
    {
        "a synchronous RPDO within 1007 acts at the next SYNC": """
            0 > 080#
            0 < 181#50 02 00 00 00 00 00 00
            0.9 > 201#06 00 00 00
            4 > 080#
            4 < 181#50 02 00 00 00 00 00 00
            8 > 080#
            8 < 181#31 02 00 00 00 00 00 00
            10 < .""",
        "a synchronous RPDO after 1007 is too late, and dropped": """
            0 > 080#
            0 < 181#50 02 00 00 00 00 00 00
            1.1 > 201#06 00 00 00
            4 > 080#
            4 < 181#50 02 00 00 00 00 00 00
            8 > 080#
            8 < 181#50 02 00 00 00 00 00 00
            10 < .""",
    }
)
def test_synchronous_window(bench, golden):
    bench.prepare(
        """
        > 601#23 07 10 00 E8 03 00 00
        < 581#60 07 10 00 00 00 00 00
        > 601#2F 00 14 02 01 00 00 00
        < 581#60 00 14 02 00 00 00 00
        > 000#01 01"""
    )
    bench.follow(golden.text)
