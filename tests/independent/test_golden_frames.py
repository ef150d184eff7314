"""Bytes typed from CiA 301 and CiA 402, sent to the simulated drive and expected back. No codec of ours is imported.

Each line of a conversation is `> COB-ID#DATA` for what the master says and `< COB-ID#DATA` for what node 1 must
answer, in candump's notation; `R` marks a remote frame, `..` a byte that the standards leave to the device.
"""

from __future__ import annotations

import time

import can
import pytest

PATIENCE_S = 20.0  # real time on a shared machine: order and content are asserted, never speed

# Each: (name, lines). SDO command specifiers are those of CiA 301, 7.2.4.3; NMT's of 7.2.8.3.1; states of 7.2.8.3.2.
CONVERSATIONS = {
    "expedited upload of four bytes: device type 402 with a servo drive (1000)": """
        > 601#40 00 10 00 00 00 00 00
        < 581#43 00 10 00 92 01 02 00""",
    "expedited upload of two bytes: producer heartbeat time 50 ms (1017)": """
        > 601#40 17 10 00 00 00 00 00
        < 581#4B 17 10 00 32 00 00 00""",
    "expedited upload of one byte: error register (1001)": """
        > 601#40 01 10 00 00 00 00 00
        < 581#4F 01 10 00 00 00 00 00""",
    "the COB-IDs of SYNC, EMCY and both SDO directions (1005, 1014, 1200)": """
        > 601#40 05 10 00 00 00 00 00
        < 581#43 05 10 00 80 00 00 00
        > 601#40 14 10 00 00 00 00 00
        < 581#43 14 10 00 81 00 00 00
        > 601#40 00 12 01 00 00 00 00
        < 581#43 00 12 01 01 06 00 00
        > 601#40 00 12 02 00 00 00 00
        < 581#43 00 12 02 81 05 00 00""",
    "expedited download of two bytes, and what was written is read": """
        > 601#2B 17 10 00 64 00 00 00
        < 581#60 17 10 00 00 00 00 00
        > 601#40 17 10 00 00 00 00 00
        < 581#4B 17 10 00 64 00 00 00""",
    "expedited download without a size indicated (s = 0)": """
        > 601#22 06 10 00 40 1F 00 00
        < 581#60 06 10 00 00 00 00 00
        > 601#40 06 10 00 00 00 00 00
        < 581#43 06 10 00 40 1F 00 00""",
    "segmented download: e = 0 with a size, one last segment of four bytes (n = 3, c = 1)": """
        > 601#21 06 10 00 04 00 00 00
        < 581#60 06 10 00 00 00 00 00
        > 601#07 A0 0F 00 00 00 00 00
        < 581#20 00 00 00 00 00 00 00
        > 601#40 06 10 00 00 00 00 00
        < 581#43 06 10 00 A0 0F 00 00""",
    "0602 0000: the object does not exist": """
        > 601#40 FF 5F 00 00 00 00 00
        < 581#80 FF 5F 00 00 00 02 06""",
    "0609 0011: the sub-index does not exist": """
        > 601#40 18 10 09 00 00 00 00
        < 581#80 18 10 09 11 00 09 06""",
    "0601 0002: write to a read-only object (6041)": """
        > 601#2B 41 60 00 00 00 00 00
        < 581#80 41 60 00 02 00 01 06""",
    "0607 0012 and 0013: data too long and too short (1017)": """
        > 601#23 17 10 00 01 00 00 00
        < 581#80 17 10 00 12 00 07 06
        > 601#2F 17 10 00 01 00 00 00
        < 581#80 17 10 00 13 00 07 06""",
    "0504 0001: an unknown command specifier": """
        > 601#E0 00 10 00 00 00 00 00
        < 581#80 .. .. .. 01 00 04 05""",
    "0609 0030: transmission type 241 is reserved (1800:02)": """
        > 601#2F 00 18 02 F1 00 00 00
        < 581#80 00 18 02 30 00 09 06""",
    "0609 0030: only 0 clears the error history (1003:00)": """
        > 601#2F 03 10 00 01 00 00 00
        < 581#80 03 10 00 30 00 09 06
        > 601#2F 03 10 00 00 00 00 00
        < 581#60 03 10 00 00 00 00 00""",
    "0800 0020: a wrong signature stores nothing (1010:01)": """
        > 601#23 10 10 01 6C 6F 61 64
        < 581#80 10 10 01 20 00 00 08""",
    "0800 0022: no counter overflow value while the communication cycle period is set (1019, 1006)": """
        > 601#2F 19 10 00 0A 00 00 00
        < 581#80 19 10 00 22 00 00 08""",
    "0504 0001 or an abort at the second segment with the same toggle bit (0503 0000)": """
        > 601#21 06 10 00 08 00 00 00
        < 581#60 06 10 00 00 00 00 00
        > 601#10 A0 0F 00 00 00 00 00
        < 581#80 06 10 00 00 00 03 05""",
    "NMT: start, stop, pre-operational, told by the heartbeat": """
        > 000#01 01
        < 701#05
        > 000#02 01
        < 701#04
        > 000#80 01
        < 701#7F""",
    "NMT: to all nodes (node-id 0)": """
        > 000#01 00
        < 701#05
        < 702#05
        < 703#05""",
    "NMT: reset communication and reset node end in a boot-up message and pre-operational": """
        > 000#82 01
        < 701#00
        < 701#7F
        > 000#81 01
        < 701#00
        < 701#7F""",
    "node guarding: the state with a toggling bit 7, while 1017 = 0": """
        > 601#2B 17 10 00 00 00 00 00
        < 581#60 17 10 00 00 00 00 00
        > 701#R1
        < 701#7F
        > 701#R1
        < 701#FF
        > 701#R1
        < 701#7F""",
    "SYNC: TPDO1 (type 1) of statusword, position and torque; position 0 and torque 0 at power-on": """
        > 000#01 01
        < 701#05
        > 080#
        < 181#.. .. 00 00 00 00 00 00""",
    "RPDO1: shutdown, then switch on (CiA 402 transitions 2 and 3), read back as controlword and statusword": """
        > 000#01 01
        < 701#05
        > 201#06 00 00 00
        > 601#40 40 60 00 00 00 00 00
        < 581#4B 40 60 00 06 00 00 00
        > 601#40 41 60 00 00 00 00 00
        < 581#4B 41 60 00 31 .. 00 00
        > 201#07 00 00 00
        > 601#40 41 60 00 00 00 00 00
        < 581#4B 41 60 00 33 .. 00 00""",
    "EMCY 8210 with error register bit 4: an RPDO too short to be processed": """
        > 000#01 01
        < 701#05
        > 201#06
        < 081#10 82 11 .. .. .. .. ..""",
    "PDO remap by the standard's procedure: TPDO1 becomes the position alone": """
        > 601#23 00 18 01 81 01 00 80
        < 581#60 00 18 01 00 00 00 00
        > 601#2F 00 1A 00 00 00 00 00
        < 581#60 00 1A 00 00 00 00 00
        > 601#23 00 1A 01 20 00 64 60
        < 581#60 00 1A 01 00 00 00 00
        > 601#2F 00 1A 00 01 00 00 00
        < 581#60 00 1A 00 00 00 00 00
        > 601#23 00 18 01 81 01 00 00
        < 581#60 00 18 01 00 00 00 00
        > 000#01 01
        < 701#05
        > 080#
        < 181#00 00 00 00""",
    "0604 0041 and 0604 0042: not mappable, and more than eight bytes": """
        > 601#23 00 18 01 81 01 00 80
        < 581#60 00 18 01 00 00 00 00
        > 601#2F 00 1A 00 00 00 00 00
        < 581#60 00 1A 00 00 00 00 00
        > 601#23 00 1A 01 20 00 00 10
        < 581#80 00 1A 01 41 00 04 06
        > 601#23 00 1A 01 20 00 64 60
        < 581#60 00 1A 01 00 00 00 00
        > 601#23 00 1A 02 20 00 64 60
        < 581#60 00 1A 02 00 00 00 00
        > 601#23 00 1A 03 20 00 64 60
        < 581#60 00 1A 03 00 00 00 00
        > 601#2F 00 1A 00 03 00 00 00
        < 581#80 00 1A 00 42 00 04 06""",
}


def message(text: str) -> can.Message:
    identifier, data = text.split("#")
    if data.startswith("R"):
        return can.Message(
            arbitration_id=int(identifier, 16), is_extended_id=False, is_remote_frame=True, dlc=int(data[1:])
        )
    return can.Message(arbitration_id=int(identifier, 16), is_extended_id=False, data=bytes.fromhex(data))


def matches(pattern: str, heard: can.Message) -> bool:
    identifier, data = pattern.split("#")
    wanted = data.split()
    return (
        heard.arbitration_id == int(identifier, 16)
        and len(wanted) == heard.dlc
        and all(w in ("..", f"{byte:02X}") for w, byte in zip(wanted, heard.data, strict=True))
    )


def await_frame(bus: can.BusABC, pattern: str) -> None:
    """Wait for the frame; another frame of the same SDO or EMCY channel in between is a wrong answer."""
    one_shot = pattern[:3] in ("581", "081", "181")
    give_up = time.monotonic() + PATIENCE_S
    while time.monotonic() < give_up:
        heard = bus.recv(PATIENCE_S)
        if heard is None:
            break
        if matches(pattern, heard):
            return
        assert not (one_shot and heard.arbitration_id == int(pattern[:3], 16)), f"expected {pattern}, heard {heard}"
    pytest.fail(f"expected {pattern}, heard nothing of the kind")


@pytest.mark.parametrize("name", CONVERSATIONS)
def test_node_1_answers_as_the_standard_says(simulator, name):
    with simulator.open() as bus:
        for line in CONVERSATIONS[name].split("\n"):
            direction, _, text = line.strip().partition(" ")
            if direction == ">":
                bus.send(message(text))
            elif direction == "<":
                await_frame(bus, text)


def test_a_segmented_upload_carries_the_device_name(simulator):
    """CiA 301, 7.2.4.3.6: e = 0, size in bytes 4..7; then segments with a toggle bit, the last with c = 1."""
    with simulator.open() as bus:
        bus.send(message("601#40 08 10 00 00 00 00 00"))
        first = next(m for m in iter(lambda: bus.recv(PATIENCE_S), None) if m.arbitration_id == 0x581)
        assert first.data[0] == 0x41
        size = int.from_bytes(first.data[4:8], "little")
        name, toggle, last = b"", 0x00, False
        while not last:
            bus.send(message(f"601#{0x60 | toggle:02X} 00 00 00 00 00 00 00"))
            segment = next(m for m in iter(lambda: bus.recv(PATIENCE_S), None) if m.arbitration_id == 0x581)
            assert segment.data[0] & 0xF0 == toggle
            name += bytes(segment.data[1 : 8 - (segment.data[0] >> 1 & 7)])
            last = bool(segment.data[0] & 1)
            toggle ^= 0x10
        assert len(name) == size
        assert name.decode("ascii").isprintable()
