"""Logs as pcap files, byte by byte; and logs that are none."""

import io

import pytest

from torquerig.errors import RecordError
from torquerig.exports.pcap import packet, parse_line, read_log, write_pcap


def test_a_pcap_file_is_laid_out_as_its_specification_says():
    file = io.BytesIO()
    frames = map(parse_line, ["(1700000000.000001) can0 181#0102", "(1.500000) can0 12345678#R8"])
    assert write_pcap(frames, file) == 2
    assert file.getvalue().hex(" ") == (
        # magic, version 2.4, zone, accuracy, longest packet, link type 227
        "d4 c3 b2 a1 02 00 04 00 00 00 00 00 00 00 00 00 ff ff 00 00 e3 00 00 00 "
        # seconds, microseconds, captured and original length; identifier in network byte order, length, data
        "00 f1 53 65 01 00 00 00 0a 00 00 00 0a 00 00 00 00 00 01 81 02 00 00 00 01 02 "
        "01 00 00 00 20 a1 07 00 08 00 00 00 08 00 00 00 d2 34 56 78 08 00 00 00"
    )


@pytest.mark.parametrize("tail", ["", " R", " T", "\n", "\r\n"])
def test_a_line_may_end_as_candump_ends_it(tail):
    assert packet(parse_line(f"(0.000001) vcan0 123#0a0B{tail}")).endswith(b"\x02\0\0\0\x0a\x0b")


@pytest.mark.parametrize(
    "line",
    [
        "vcan0 123#",
        "(0.000001) vcan0 123#0",
        "(0.000001) vcan0 123#000102030405060708",
        "(0.000001) vcan0 123##1AABB",
        "(0.000001) vcan0 1234#00",
        "(0.000001) vcan0 123#R9",
        "(99999999999.000001) vcan0 123#00",
        "(0.000001) vcan0 FFFFFFFFF#",
    ],
)
def test_a_line_that_is_no_classic_frame_is_named(tmp_path, line):
    log = tmp_path / "bus.log"
    log.write_text(f"(0.000001) vcan0 080#\n\n{line}\n", "ascii")
    with pytest.raises(RecordError, match=r"bus\.log:3: .* is no classic CAN frame as candump -L writes them"):
        list(read_log(log))


def test_a_log_that_is_not_there_is_named(tmp_path):
    with pytest.raises(RecordError, match=r"nothing\.log cannot be read: No such file"):
        list(read_log(tmp_path / "nothing.log"))
