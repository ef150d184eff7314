"""Logs as pcap files, judged by Wireshark's CANopen dissector."""

import os
import re
import shutil
import subprocess
from collections import Counter

import pytest

from torquerig.exports.pcap import read_log, write_pcap
from torquerig.record import BUS_FILE

if shutil.which("tshark") is None and os.environ.get("CI") != "true":
    pytest.skip("Wireshark did not judge our pcap files: apt-get install tshark", allow_module_level=True)

# what Wireshark calls the kinds of CiA 301
KINDS = {
    **{f"PDO{n} (tx)": f"TPDO{n}" for n in (1, 2, 3, 4)},
    **{f"PDO{n} (rx)": f"RPDO{n}" for n in (1, 2, 3, 4)},
    "Default-SDO (tx)": "SDO response",
    "Default-SDO (rx)": "SDO request",
    "NMT Error Control": "heartbeat",
}
COMPLAINTS = "_ws.malformed or _ws.expert or data or not canopen"

# one of each, typed from CiA 301: what a line of candump holds, and what Wireshark is to say
GOLDEN = [
    ("000#0100", "NMT: Start remote node"),
    ("000#0203", "NMT: Stop remote node"),
    ("000#8000", "NMT: Enter pre-operational state"),
    ("000#8101", "NMT: Reset node"),
    ("000#8202", "NMT: Reset communication"),
    ("080#", "SYNC"),
    ("080#05", "SYNC"),
    ("081#5082110000000000", "EMCY"),
    ("100#0000000000400000", "TIME STAMP"),
    ("181#3716000000000000", "PDO1 (tx)"),
    ("281#0000000000000000", "PDO2 (tx)"),
    ("381#00", "PDO3 (tx)"),
    ("481#", "PDO4 (tx)"),
    ("201#0F000000", "PDO1 (rx)"),
    ("301#00", "PDO2 (rx)"),
    ("401#00", "PDO3 (rx)"),
    ("501#00", "PDO4 (rx)"),
    ("601#4018100100000000", "Default-SDO (rx): Initiate upload request"),
    ("581#4318100100000000", "Default-SDO (tx): Initiate upload response"),
    ("601#2F60600A00000000", "Default-SDO (rx): Initiate download request"),
    ("581#6060600000000000", "Default-SDO (tx): Initiate download response"),
    ("581#410810000D000000", "Default-SDO (tx): Initiate upload response"),
    ("601#6000000000000000", "Default-SDO (rx): Upload segment request"),
    ("581#00746F7271756572", "Default-SDO (tx): Upload segment response"),
    ("601#0073617665000000", "Default-SDO (rx): Download segment request"),
    ("581#2000000000000000", "Default-SDO (tx): Download segment response"),
    ("581#8010100011000906", "Default-SDO (tx): Abort transfer"),
    ("701#00", "NMT Error Control: Boot-up"),
    ("701#04", "NMT Error Control: Stopped"),
    ("701#05", "NMT Error Control: Operational"),
    ("701#7F", "NMT Error Control: Pre-operational"),
    ("701#85", "NMT Error Control: Operational"),
]


def dissect(pcap, *fields, only="frame"):
    """Return fields of the frames that a display filter lets through, as Wireshark's CANopen dissector has them."""
    command = ["tshark", "-n", "-r", str(pcap), "-d", "can.subdissector,canopen", "-Y", only, "-T", "fields"]
    command += [word for field in fields for word in ("-e", field)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return [line.split("\t") for line in run.stdout.splitlines()]


def converted(log, folder):
    pcap = folder / "bus.pcap"
    with pcap.open("wb") as file:
        write_pcap(read_log(log), file)
    return pcap


def log_of(folder, frames):
    log = folder / BUS_FILE
    log.write_text("".join(f"({n:010d}.{n:06d}) vcan0 {frame}\n" for n, frame in enumerate(frames)), "ascii")
    return log


def kind_of(info):
    words = re.match(r"([\w -]*\w( \((rx|tx)\))?)(: Boot-up)?", info)
    if words[4]:
        return "boot-up"
    return KINDS.get(words[1], words[1])


def test_every_kind_is_what_it_is(tmp_path):
    pcap = converted(log_of(tmp_path, [frame for frame, _ in GOLDEN]), tmp_path)
    told = [info for (info,) in dissect(pcap, "_ws.col.Info")]
    for (frame, words), info in zip(GOLDEN, told, strict=True):
        assert info.startswith(words), frame
    assert dissect(pcap, "frame.number", only=COMPLAINTS) == []


def test_wireshark_is_awake(tmp_path):
    pcap = converted(log_of(tmp_path, ["081#508211", "000#01", "701#05"]), tmp_path)
    assert dissect(pcap, "frame.number", only=COMPLAINTS) == [["1"], ["2"]]


def test_values_arrive_as_they_were_logged(tmp_path):
    pcap = converted(log_of(tmp_path, [frame for frame, _ in GOLDEN]), tmp_path)
    assert dissect(pcap, "canopen.em.err_code", "canopen.em.err_reg", only="canopen.em.err_code") == [
        ["0x8250", "0x11"]
    ]
    assert dissect(pcap, "canopen.sdo.abort_code", only="canopen.sdo.abort_code") == [["0x06090011"]]
    assert dissect(pcap, "canopen.nmt_guard.state", "canopen.nmt_guard.toggle", only="can.id == 0x701") == [
        ["0x00", "0"],
        ["0x04", "0"],
        ["0x05", "0"],
        ["0x7f", "0"],
        ["0x05", "1"],
    ]
    stamps = [float(stamp) for (stamp,) in dissect(pcap, "frame.time_epoch")]
    assert stamps == pytest.approx([n + n * 1e-6 for n in range(len(GOLDEN))], abs=1e-9)


def test_frames_that_are_not_canopens_keep_their_flags(tmp_path):
    log = log_of(tmp_path, ["701#R1", "701#R", "12345678#0102", "20000004#0004000000000000"])
    pcap = converted(log, tmp_path)
    fields = ("can.id", "can.flags.rtr", "can.flags.xtd", "can.flags.err", "can.len")
    assert dissect(pcap, *fields) == [
        [str(0x701), "1", "0", "0", "1"],
        [str(0x701), "1", "0", "0", "0"],
        [str(0x12345678), "0", "1", "0", "2"],
        ["", "", "", "1", "8"],
    ]
    assert dissect(pcap, "frame.number", only="_ws.malformed or _ws.expert") == []


@pytest.mark.parametrize("which", ["a run", "a run whose controller vanishes"])
def test_wireshark_finds_every_frame_of_each_kind(tmp_path, record, deserted_log, count_kinds, which):
    log = record / BUS_FILE if which == "a run" else deserted_log
    expected = count_kinds(log)
    pcap = converted(log, tmp_path)
    assert dissect(pcap, "frame.number", only=COMPLAINTS) == []
    told = Counter(kind_of(info) for (info,) in dissect(pcap, "_ws.col.Info"))
    assert told == expected
    kinds = {"NMT", "SYNC", "boot-up", "heartbeat", "TPDO1", "TPDO2", "RPDO1", "SDO request", "SDO response"}
    assert set(told) == kinds | ({"EMCY"} if which != "a run" else set())
    assert told["boot-up"] >= 3
    assert told["TPDO1"] == 3 * told["SYNC"]
