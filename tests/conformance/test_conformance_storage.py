"""Storing and restoring parameters: objects 1010 and 1011 (CiA 301, 7.5.2.13 and 7.5.2.14)."""

import pytest
from conversation import golden, talk

pytestmark = pytest.mark.conformance("Storage", "golden bytes")

SAVE = """
    > 601#23 10 10 01 73 61 76 65
    < 581#60 10 10 01 00 00 00 00"""
LOAD = """
    > 601#23 11 10 01 6C 6F 61 64
    < 581#60 11 10 01 00 00 00 00"""
RESET_NODE = """
    ~ 701#..
    > 000#81 01
    < 701#00"""
RESET_COMMUNICATION = """
    ~ 701#..
    > 000#82 01
    < 701#00"""
WRITE_PERIOD = """
    > 601#23 06 10 00 40 1F 00 00
    < 581#60 06 10 00 00 00 00 00"""
WRITE_SLOPE = """
    > 601#23 87 60 00 E8 03 00 00
    < 581#60 87 60 00 00 00 00 00"""
PERIOD = "\n > 601#40 06 10 00 00 00 00 00\n < 581#43 06 10 00 {}"
SLOPE = "\n > 601#40 87 60 00 00 00 00 00\n < 581#43 87 60 00 {}"
WRITTEN_PERIOD, WRITTEN_SLOPE = PERIOD.format("40 1F 00 00"), SLOPE.format("E8 03 00 00")
DEFAULT_PERIOD, DEFAULT_SLOPE = PERIOD.format("A0 0F 00 00"), SLOPE.format("E0 93 04 00")


@golden(
    {
        "both objects say that they act on command (1010:1 and 1011:1 read 1)": """
            > 601#40 10 10 01 00 00 00 00
            < 581#43 10 10 01 01 00 00 00
            > 601#40 11 10 01 00 00 00 00
            < 581#43 11 10 01 01 00 00 00""",
        "what was not saved is gone after reset node": WRITE_PERIOD
        + WRITE_SLOPE
        + RESET_NODE
        + DEFAULT_PERIOD
        + DEFAULT_SLOPE,
        "what was saved is there after reset node": WRITE_PERIOD
        + WRITE_SLOPE
        + SAVE
        + RESET_NODE
        + WRITTEN_PERIOD
        + WRITTEN_SLOPE,
        "what was saved is there after reset communication": WRITE_PERIOD
        + SAVE
        + PERIOD.format("40 1F 00 00")
        + RESET_COMMUNICATION
        + WRITTEN_PERIOD,
        "what was written after saving is not saved": WRITE_PERIOD
        + SAVE
        + """
            > 601#23 06 10 00 D0 07 00 00
            < 581#60 06 10 00 00 00 00 00"""
        + RESET_NODE
        + WRITTEN_PERIOD,
        "load acts at the next reset, and not before": WRITE_PERIOD
        + SAVE
        + RESET_NODE
        + LOAD
        + WRITTEN_PERIOD
        + RESET_NODE
        + DEFAULT_PERIOD,
        "save undoes a load that has not acted yet": WRITE_PERIOD + LOAD + SAVE + RESET_NODE + WRITTEN_PERIOD,
        "a mapping is saved with its PDO": """
            > 601#23 00 18 01 81 01 00 80
            < 581#60 00 18 01 00 00 00 00
            > 601#2F 00 1A 00 00 00 00 00
            < 581#60 00 1A 00 00 00 00 00
            > 601#23 00 1A 01 20 00 64 60
            < 581#60 00 1A 01 00 00 00 00
            > 601#2F 00 1A 00 01 00 00 00
            < 581#60 00 1A 00 00 00 00 00
            > 601#23 00 18 01 A1 01 00 00
            < 581#60 00 18 01 00 00 00 00"""
        + SAVE
        + RESET_NODE
        + """
            > 000#01 01
            > 080#
            < 1A1#00 00 00 00""",
        "a command is no parameter: controlword and targets are not saved": """
            > 601#2B 40 60 00 06 00 00 00
            < 581#60 40 60 00 00 00 00 00
            > 601#2B 71 20 00 E8 03 00 00
            < 581#60 71 20 00 00 00 00 00"""
        + SAVE
        + RESET_NODE
        + """
            > 601#40 40 60 00 00 00 00 00
            < 581#4B 40 60 00 00 00 00 00
            > 601#40 71 20 00 00 00 00 00
            < 581#4B 71 20 00 00 00 00 00
            > 601#40 41 60 00 00 00 00 00
            < 581#4B 41 60 00 50 02 00 00""",
        "a wrong signature stores nothing (0800 0020)": WRITE_PERIOD
        + """
            > 601#23 10 10 01 53 41 56 45
            < 581#80 10 10 01 20 00 00 08"""
        + RESET_NODE
        + DEFAULT_PERIOD,
    }
)
def test_storage(line, golden):
    talk(line, golden.text)
