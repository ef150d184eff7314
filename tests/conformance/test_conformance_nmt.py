"""NMT: every transition, what each state serves and refuses, boot-up (CiA 301, 7.2.8 and 7.3.2)."""

import pytest
from conversation import golden, talk

pytestmark = pytest.mark.conformance("NMT", "golden bytes")

# Node 1 is guarded: a remote frame on 0x701 is answered by its state (7F pre-operational, 05 operational, 04 stopped)
# and a bit 7 that toggles, 0 at first.
INTO = {"pre-operational": "", "operational": "> 000#01 01", "stopped": "> 000#02 01"}
COMMANDS = {
    "start": "> 000#01 01\n > 701#R1\n < 701#05",
    "stop": "> 000#02 01\n > 701#R1\n < 701#04",
    "enter pre-operational": "> 000#80 01\n > 701#R1\n < 701#7F",
    # a node that was reset beats again, with the default 1017
    "reset node": "~ 701#7F\n > 000#81 01\n < 701#00\n < 701#7F",
    "reset communication": "~ 701#7F\n > 000#82 01\n < 701#00\n < 701#7F",
}


@golden(
    {
        f"{command} in {state}": f"{before}\n{words}"
        for state, before in INTO.items()
        for command, words in COMMANDS.items()
    }
)
def test_transition(line, golden):
    talk(line, golden.text)


@golden(
    {
        "a command to node-id 0 is for all": """
            > 000#01 00
            < 702#05
            < 703#05
            > 701#R1
            < 701#05""",
        "a command to another node-id is not obeyed": """
            > 000#01 02
            < 702#05
            > 701#R1
            < 701#7F""",
        "an unknown command specifier changes nothing": """
            > 000#03 01
            > 000#7F 01
            > 701#R1
            < 701#7F""",
        "a command of one byte changes nothing": """
            > 000#01
            > 701#R1
            < 701#7F""",
        "a 29-bit identifier 0 is no NMT command": """
            > 00000000#01 01
            > 701#R1
            < 701#7F""",
        "boot-up is one byte 0 on 0x700 + node-id, from every node": """
            ~ 701#7F
            > 000#81 00
            < 701#00
            < 702#00
            < 703#00""",
        "reset communication restores 1000 to 1FFF and leaves 2000 to 9FFF": """
            ~ 701#7F
            > 601#23 87 60 00 E8 03 00 00
            < 581#60 87 60 00 00 00 00 00
            > 601#23 06 10 00 40 1F 00 00
            < 581#60 06 10 00 00 00 00 00
            > 000#82 01
            < 701#00
            > 601#40 06 10 00 00 00 00 00
            < 581#43 06 10 00 A0 0F 00 00
            > 601#40 87 60 00 00 00 00 00
            < 581#43 87 60 00 E8 03 00 00""",
        "reset node restores 2000 to 9FFF too": """
            ~ 701#7F
            > 601#23 87 60 00 E8 03 00 00
            < 581#60 87 60 00 00 00 00 00
            > 000#81 01
            < 701#00
            > 601#40 87 60 00 00 00 00 00
            < 581#43 87 60 00 E0 93 04 00""",
    }
)
def test_command(line, golden):
    talk(line, golden.text)


SDO = "> 601#40 00 10 00 00 00 00 00\n"
SDO_SERVED = SDO + "< 581#43 00 10 00 92 01 02 00\n"
CONTROLWORD_IS = "> 601#40 40 60 00 00 00 00 00\n < 581#4B 40 60 00 {} 00 00 00\n"
FAULT = "> 601#23 00 2F 00 01 00 00 00\n"  # overcurrent by the simulation's own object: EMCY 0x2310


@golden(
    {
        "pre-operational serves SDO": SDO_SERVED,
        "pre-operational sends EMCY": FAULT + "< 081#10 23 03 .. .. .. .. ..\n < 581#60 00 2F 00 00 00 00 00",
        "pre-operational answers guarding": "> 701#R1\n < 701#7F",
        "pre-operational answers no SYNC": "> 080# x3",
        "pre-operational answers no remote frame on a TPDO": "> 181#R8",
        "pre-operational takes no RPDO": "> 201#06 00 00 00\n" + CONTROLWORD_IS.format("00"),
        "operational serves SDO": "> 000#01 01\n" + SDO_SERVED,
        "operational sends EMCY": "> 000#01 01\n"
        + FAULT
        + "< 081#10 23 03 .. .. .. .. ..\n < 581#60 00 2F 00 00 00 00 00",
        "operational answers guarding": "> 000#01 01\n > 701#R1\n < 701#05",
        "operational answers SYNC by TPDO1": "> 000#01 01\n > 080#\n < 181#50 02 00 00 00 00 00 00",
        "operational answers a remote frame on a TPDO": "> 000#01 01\n > 181#R8\n < 181#50 02 00 00 00 00 00 00",
        "operational takes RPDO1": "> 000#01 01\n > 201#06 00 00 00\n" + CONTROLWORD_IS.format("06"),
        "stopped serves no SDO": "> 000#02 01\n" + SDO,
        "stopped answers guarding": "> 000#02 01\n > 701#R1\n < 701#04",
        "stopped answers no SYNC": "> 000#02 01\n > 080# x3",
        "stopped answers no remote frame on a TPDO": "> 000#02 01\n > 181#R8",
        "stopped takes no RPDO": "> 000#02 01\n > 201#06 00 00 00\n > 000#01 01\n" + CONTROLWORD_IS.format("00"),
        "an SDO transfer under way does not survive stopped": """
            > 601#40 08 10 00 00 00 00 00
            < 581#41 08 10 00 20 00 00 00
            > 000#02 01
            > 000#80 01
            > 601#60 00 00 00 00 00 00 00
            < 581#80 00 00 00 01 00 04 05""",
    }
)
def test_service(line, golden):
    talk(line, golden.text)
