"""SDO: expedited, segmented and block transfers, both ways (CiA 301, 7.2.4.3)."""

import pytest
from conversation import golden, talk

pytestmark = pytest.mark.conformance("SDO", "golden bytes")

PERIOD_IS_8000 = """
    > 601#40 06 10 00 00 00 00 00
    < 581#43 06 10 00 40 1F 00 00"""
PERIOD_IS_4000 = """
    > 601#40 06 10 00 00 00 00 00
    < 581#43 06 10 00 A0 0F 00 00"""


@golden(
    {
        "upload of one byte: n = 3 (1001)": """
            > 601#40 01 10 00 00 00 00 00
            < 581#4F 01 10 00 00 00 00 00""",
        "upload of two bytes: n = 2 (1018:0 is one byte, 6075 four, 1015 two)": """
            > 601#40 15 10 00 00 00 00 00
            < 581#4B 15 10 00 00 00 00 00""",
        "upload of three bytes: n = 1 (100A)": """
            > 601#40 0A 10 00 00 00 00 00
            < 581#47 0A 10 00 31 2E 30 00""",
        "upload of four bytes: n = 0 (1000)": """
            > 601#40 00 10 00 00 00 00 00
            < 581#43 00 10 00 92 01 02 00""",
        "the node's COB-IDs hold its node-id (1014, 1200:1, 1200:2, 1400:1, 1800:1)": """
            > 601#40 14 10 00 00 00 00 00
            < 581#43 14 10 00 81 00 00 00
            > 601#40 00 12 01 00 00 00 00
            < 581#43 00 12 01 01 06 00 00
            > 601#40 00 12 02 00 00 00 00
            < 581#43 00 12 02 81 05 00 00
            > 601#40 00 14 01 00 00 00 00
            < 581#43 00 14 01 01 02 00 00
            > 601#40 00 18 01 00 00 00 00
            < 581#43 00 18 01 81 01 00 00""",
        "download of one byte (605A's mode, 6060)": """
            > 601#2F 60 60 00 04 00 00 00
            < 581#60 60 60 00 00 00 00 00
            > 601#40 60 60 00 00 00 00 00
            < 581#4F 60 60 00 04 00 00 00""",
        "download of two bytes (1015)": """
            > 601#2B 15 10 00 64 00 00 00
            < 581#60 15 10 00 00 00 00 00
            > 601#40 15 10 00 00 00 00 00
            < 581#4B 15 10 00 64 00 00 00""",
        "download of four bytes (1006)": """
            > 601#23 06 10 00 40 1F 00 00
            < 581#60 06 10 00 00 00 00 00"""
        + PERIOD_IS_8000,
        "download without its size indicated (s = 0)": """
            > 601#22 06 10 00 40 1F 00 00
            < 581#60 06 10 00 00 00 00 00"""
        + PERIOD_IS_8000,
    }
)
def test_expedited(line, golden):
    talk(line, golden.text)


NAME_INITIATED = """
    > 601#40 08 10 00 00 00 00 00
    < 581#41 08 10 00 20 00 00 00"""


@golden(
    {
        "upload of a name of 32 characters: size, toggle, n and c (1008)": NAME_INITIATED
        + """
            > 601#60 00 00 00 00 00 00 00
            < 581#00 74 6F 72 71 75 65 72
            > 601#70 00 00 00 00 00 00 00
            < 581#10 69 67 20 73 69 6D 75
            > 601#60 00 00 00 00 00 00 00
            < 581#00 6C 61 74 65 64 20 74
            > 601#70 00 00 00 00 00 00 00
            < 581#10 6F 72 71 75 65 20 64
            > 601#60 00 00 00 00 00 00 00
            < 581#07 72 69 76 65 00 00 00""",
        "upload of nine characters: the last segment has two (1009)": """
            > 601#40 09 10 00 00 00 00 00
            < 581#41 09 10 00 09 00 00 00
            > 601#60 00 00 00 00 00 00 00
            < 581#00 73 69 6D 75 6C 61 74
            > 601#70 00 00 00 00 00 00 00
            < 581#1B 65 64 00 00 00 00 00""",
        "upload of an integer of eight bytes (2130)": """
            > 601#40 30 21 00 00 00 00 00
            < 581#41 30 21 00 08 00 00 00
            > 601#60 00 00 00 00 00 00 00
            < 581#00 .. .. .. .. .. .. ..
            > 601#70 00 00 00 00 00 00 00
            < 581#1D .. 00 00 00 00 00 00""",
        "download in one segment (1006)": """
            > 601#21 06 10 00 04 00 00 00
            < 581#60 06 10 00 00 00 00 00
            > 601#07 40 1F 00 00 00 00 00
            < 581#20 00 00 00 00 00 00 00"""
        + PERIOD_IS_8000,
        "download in two short segments whose toggle bits alternate": """
            > 601#21 06 10 00 04 00 00 00
            < 581#60 06 10 00 00 00 00 00
            > 601#0A 40 1F 00 00 00 00 00
            < 581#20 00 00 00 00 00 00 00
            > 601#1B 00 00 00 00 00 00 00
            < 581#30 00 00 00 00 00 00 00"""
        + PERIOD_IS_8000,
        "download without its size indicated (s = 0)": """
            > 601#20 06 10 00 00 00 00 00
            < 581#60 06 10 00 00 00 00 00
            > 601#07 40 1F 00 00 00 00 00
            < 581#20 00 00 00 00 00 00 00"""
        + PERIOD_IS_8000,
        "nothing is written before the last segment": """
            > 601#21 06 10 00 04 00 00 00
            < 581#60 06 10 00 00 00 00 00
            > 601#0A 40 1F 00 00 00 00 00
            < 581#20 00 00 00 00 00 00 00
            > 601#80 06 10 00 00 00 00 08"""
        + PERIOD_IS_4000,
        "a new request replaces the transfer under way": NAME_INITIATED
        + """
            > 601#40 00 10 00 00 00 00 00
            < 581#43 00 10 00 92 01 02 00
            > 601#60 00 00 00 00 00 00 00
            < 581#80 00 00 00 01 00 04 05""",
        "an abort by the client is not answered and ends the transfer": NAME_INITIATED
        + """
            > 601#80 08 10 00 00 00 04 05
            > 601#60 00 00 00 00 00 00 00
            < 581#80 00 00 00 01 00 04 05""",
    }
)
def test_segmented(line, golden):
    talk(line, golden.text)


@golden(
    {
        "of seven bytes": "> 601#40 00 10 00 00 00 00",
        "of no byte": "> 601#",
        "as a remote frame": "> 601#R8",
        "with a 29-bit identifier": "> 00000601#40 00 10 00 00 00 00 00",
    }
)
def test_no_answer_to_a_request(line, golden):
    talk(line, golden.text)


BLOCK_UPLOAD_OF_NAME = """
    > 601#A4 08 10 00 {blksize} 00 00 00
    < 581#C6 08 10 00 20 00 00 00
    > 601#A3 00 00 00 00 00 00 00"""
NAME_ENDS = """
    < 581#CD 12 26 00 00 00 00 00
    > 601#A1 00 00 00 00 00 00 00"""


@golden(
    {
        "upload of 32 characters in one block, with CRC": BLOCK_UPLOAD_OF_NAME.format(blksize="7F")
        + """
            < 581#01 74 6F 72 71 75 65 72
            < 581#02 69 67 20 73 69 6D 75
            < 581#03 6C 61 74 65 64 20 74
            < 581#04 6F 72 71 75 65 20 64
            < 581#85 72 69 76 65 00 00 00
            > 601#A2 05 7F 00 00 00 00 00"""
        + NAME_ENDS,
        "upload in blocks of two segments": BLOCK_UPLOAD_OF_NAME.format(blksize="02")
        + """
            < 581#01 74 6F 72 71 75 65 72
            < 581#02 69 67 20 73 69 6D 75
            > 601#A2 02 02 00 00 00 00 00
            < 581#01 6C 61 74 65 64 20 74
            < 581#02 6F 72 71 75 65 20 64
            > 601#A2 02 02 00 00 00 00 00
            < 581#81 72 69 76 65 00 00 00
            > 601#A2 01 02 00 00 00 00 00"""
        + NAME_ENDS,
        "upload: the block size may change at every acknowledgement": BLOCK_UPLOAD_OF_NAME.format(blksize="01")
        + """
            < 581#01 74 6F 72 71 75 65 72
            > 601#A2 01 04 00 00 00 00 00
            < 581#01 69 67 20 73 69 6D 75
            < 581#02 6C 61 74 65 64 20 74
            < 581#03 6F 72 71 75 65 20 64
            < 581#84 72 69 76 65 00 00 00
            > 601#A2 04 04 00 00 00 00 00"""
        + NAME_ENDS,
        "upload: what was not acknowledged is sent again": BLOCK_UPLOAD_OF_NAME.format(blksize="03")
        + """
            < 581#01 74 6F 72 71 75 65 72
            < 581#02 69 67 20 73 69 6D 75
            < 581#03 6C 61 74 65 64 20 74
            > 601#A2 01 03 00 00 00 00 00
            < 581#01 69 67 20 73 69 6D 75
            < 581#02 6C 61 74 65 64 20 74
            < 581#03 6F 72 71 75 65 20 64
            > 601#A2 03 03 00 00 00 00 00
            < 581#81 72 69 76 65 00 00 00
            > 601#A2 01 03 00 00 00 00 00"""
        + NAME_ENDS,
        "upload without CRC when the client has none": """
            > 601#A0 08 10 00 7F 00 00 00
            < 581#C2 08 10 00 20 00 00 00
            > 601#A3 00 00 00 00 00 00 00
            < 581#01 74 6F 72 71 75 65 72
            < 581#02 69 67 20 73 69 6D 75
            < 581#03 6C 61 74 65 64 20 74
            < 581#04 6F 72 71 75 65 20 64
            < 581#85 72 69 76 65 00 00 00
            > 601#A2 05 7F 00 00 00 00 00
            < 581#CD 00 00 00 00 00 00 00
            > 601#A1 00 00 00 00 00 00 00""",
        "upload of no more bytes than pst becomes segmented": """
            > 601#A4 08 10 00 7F 20 00 00
            < 581#41 08 10 00 20 00 00 00
            > 601#60 00 00 00 00 00 00 00
            < 581#00 74 6F 72 71 75 65 72""",
        "upload of four bytes with pst = 4 becomes expedited": """
            > 601#A4 00 10 00 7F 04 00 00
            < 581#43 00 10 00 92 01 02 00""",
        "upload aborted by the client": BLOCK_UPLOAD_OF_NAME.format(blksize="01")
        + """
            < 581#01 74 6F 72 71 75 65 72
            > 601#80 08 10 00 00 00 00 08
            > 601#A2 01 01 00 00 00 00 00
            < 581#80 00 00 00 01 00 04 05""",
        "download with CRC (1006)": """
            > 601#C6 06 10 00 04 00 00 00
            < 581#A4 06 10 00 7F 00 00 00
            > 601#81 40 1F 00 00 00 00 00
            < 581#A2 01 7F 00 00 00 00 00
            > 601#CD CE 01 00 00 00 00 00
            < 581#A1 00 00 00 00 00 00 00"""
        + PERIOD_IS_8000,
        "download without CRC": """
            > 601#C2 06 10 00 04 00 00 00
            < 581#A0 06 10 00 7F 00 00 00
            > 601#81 40 1F 00 00 00 00 00
            < 581#A2 01 7F 00 00 00 00 00
            > 601#CD 00 00 00 00 00 00 00
            < 581#A1 00 00 00 00 00 00 00"""
        + PERIOD_IS_8000,
        "download without its size indicated": """
            > 601#C4 06 10 00 00 00 00 00
            < 581#A4 06 10 00 7F 00 00 00
            > 601#81 40 1F 00 00 00 00 00
            < 581#A2 01 7F 00 00 00 00 00
            > 601#CD CE 01 00 00 00 00 00
            < 581#A1 00 00 00 00 00 00 00"""
        + PERIOD_IS_8000,
        "download aborted by the client in the midst of a block": """
            > 601#C6 06 10 00 04 00 00 00
            < 581#A4 06 10 00 7F 00 00 00
            > 601#80 06 10 00 00 00 00 08"""
        + PERIOD_IS_4000,
    }
)
def test_block(line, golden):
    talk(line, golden.text)
