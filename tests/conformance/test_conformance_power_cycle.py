"""What outlives the loss of power: the parameters that were saved, and nothing else (CiA 301, 7.3.2.2.1)."""

import pytest
from conversation import golden

pytestmark = pytest.mark.conformance("Power cycle", "golden bytes at exact times", bus="bench")

SAVE = "\n > 601#23 10 10 01 73 61 76 65\n < 581#60 10 10 01 00 00 00 00"
LOAD = "\n > 601#23 11 10 01 6C 6F 61 64\n < 581#60 11 10 01 00 00 00 00"
WRITE_PERIOD = "\n > 601#23 06 10 00 40 1F 00 00\n < 581#60 06 10 00 00 00 00 00"
WRITE_SLOPE = "\n > 601#23 87 60 00 E8 03 00 00\n < 581#60 87 60 00 00 00 00 00"
PERIOD = "\n > 601#40 06 10 00 00 00 00 00\n < 581#43 06 10 00 {}"
SLOPE = "\n > 601#40 87 60 00 00 00 00 00\n < 581#43 87 60 00 {}"
WRITTEN = PERIOD.format("40 1F 00 00") + SLOPE.format("E8 03 00 00")
DEFAULT = PERIOD.format("A0 0F 00 00") + SLOPE.format("E0 93 04 00")
OVERCURRENT = """
    > 601#23 00 2F 00 01 00 00 00
    < 081#10 23 03 .. .. .. .. ..
    < 581#60 00 2F 00 00 00 00 00"""


@golden(
    {
        "what was not saved is gone": WRITE_PERIOD + WRITE_SLOPE + "|" + DEFAULT,
        "what was saved is there": WRITE_PERIOD + WRITE_SLOPE + SAVE + "|" + WRITTEN,
        "what was saved is there a second time": WRITE_PERIOD + WRITE_SLOPE + SAVE + "|" + WRITTEN + "|" + WRITTEN,
        "after load the defaults are": WRITE_PERIOD + WRITE_SLOPE + SAVE + "|" + WRITTEN + LOAD + "|" + DEFAULT,
        "the node is pre-operational": "> 000#01 01|> 601#2B 17 10 00 00 00 00 00\n < 581#60 17 10 00 00 00 00 00"
        + "\n > 701#R1\n < 701#7F",
        "the drive is in switch on disabled, and a fault is gone": OVERCURRENT
        + """|
            > 601#40 41 60 00 00 00 00 00
            < 581#4B 41 60 00 50 02 00 00
            > 601#40 01 10 00 00 00 00 00
            < 581#4F 01 10 00 00 00 00 00""",
        "the error history is empty": OVERCURRENT
        + """|
            > 601#40 03 10 00 00 00 00 00
            < 581#4F 03 10 00 00 00 00 00""",
        "a saved controlword does not enable": """
            > 000#01 01
            > 201#06 00 00 00
            > 201#07 00 00 00"""
        + SAVE
        + """|
            > 000#01 01
            > 601#40 41 60 00 00 00 00 00
            < 581#4B 41 60 00 50 02 00 00""",
    }
)
def test_after_power_on(bench, golden):
    before, *after = golden.text.split("|")
    bench.prepare(before)
    for words in after:
        bench.power_cycle()
        bench.prepare("< 701#00\n" + words)
