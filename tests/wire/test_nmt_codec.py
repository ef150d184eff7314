"""NMT: golden frames of commands, boot-up, heartbeat and guarding."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.driver.wire import nmt
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.nmt import Heartbeat, NmtCommand, NmtState

# protocol NMT: COB-ID 0, byte 0 the command specifier, byte 1 the node-id (0: all)
COMMANDS = [
    (NmtCommand.START, 1, b"\x01\x01"),
    (NmtCommand.STOP, 2, b"\x02\x02"),
    (NmtCommand.PRE_OPERATIONAL, 3, b"\x80\x03"),
    (NmtCommand.RESET_NODE, 127, b"\x81\x7f"),
    (NmtCommand.RESET_COMMUNICATION, 0, b"\x82\x00"),
]
# protocol heartbeat: COB-ID 0x700 + node-id, one byte: bit 7 reserved (guarding: toggle), bits 6 to 0 the state
ERROR_CONTROL = [
    (1, NmtState.BOOT_UP, False, Frame(0x701, b"\x00")),
    (2, NmtState.STOPPED, False, Frame(0x702, b"\x04")),
    (3, NmtState.OPERATIONAL, False, Frame(0x703, b"\x05")),
    (127, NmtState.PRE_OPERATIONAL, False, Frame(0x77F, b"\x7f")),
    (1, NmtState.OPERATIONAL, True, Frame(0x701, b"\x85")),
    (1, NmtState.PRE_OPERATIONAL, True, Frame(0x701, b"\xff")),
]


@pytest.mark.parametrize(("command", "node_id", "data"), COMMANDS)
def test_commands_are_the_standards_frames_both_ways(command, node_id, data):
    assert nmt.encode_command(command, node_id) == Frame(0x000, data)
    assert nmt.decode_command(Frame(0x000, data)) == (command, node_id)


@pytest.mark.parametrize(("node_id", "state", "toggle", "frame"), ERROR_CONTROL)
def test_error_control_messages_are_the_standards_frames_both_ways(node_id, state, toggle, frame):
    assert nmt.encode_heartbeat(node_id, state, toggle=toggle) == frame
    assert nmt.decode_heartbeat(frame) == Heartbeat(node_id, state, toggle)


def test_a_guarding_request_is_a_remote_frame_of_one_byte():
    frame = nmt.encode_guard_request(5)
    assert (frame.can_id, len(frame.data), frame.remote) == (0x705, 1, True)
    assert nmt.decode_guard_request(frame) == 5
    assert nmt.decode_heartbeat(frame) is None
    assert nmt.decode_guard_request(nmt.encode_heartbeat(5, NmtState.OPERATIONAL)) is None


@pytest.mark.parametrize(
    "frame",
    [
        Frame(0x001, b"\x01\x01"),
        Frame(0x000, b"\x01"),
        Frame(0x000, b"\x01\x01\x00"),
        Frame(0x000, b"\x03\x01"),  # no such command
        Frame(0x000, b"\x01\x80"),  # node-id 128
        Frame(0x000, b"\x00\x00", remote=True),
        Frame(0x000, b"\x01\x01", extended=True),
    ],
)
def test_what_is_no_nmt_command_decodes_to_none(frame):
    assert nmt.decode_command(frame) is None


@pytest.mark.parametrize(
    "frame",
    [
        Frame(0x700, b"\x05"),  # node-id 0
        Frame(0x780, b"\x05"),
        Frame(0x701, b""),
        Frame(0x701, b"\x05\x00"),
        Frame(0x701, b"\x06"),  # no such state
        Frame(0x701, b"\x05", extended=True),
    ],
)
def test_what_is_no_error_control_message_decodes_to_none(frame):
    assert nmt.decode_heartbeat(frame) is None


def test_a_callers_mistake_names_the_datum():
    with pytest.raises(ValueError, match="128"):
        nmt.encode_command(NmtCommand.START, 128)
    with pytest.raises(ValueError, match="3"):
        nmt.encode_command(3, 1)
    with pytest.raises(ValueError, match="not 0"):
        nmt.encode_heartbeat(0, NmtState.OPERATIONAL)
    with pytest.raises(ValueError, match="9"):
        nmt.encode_heartbeat(1, 9)
    with pytest.raises(ValueError, match="not 0"):
        nmt.encode_guard_request(0)


def test_every_state_but_boot_up_obeys_both_resets():
    for state in NmtState:
        for reset in (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION):
            target = nmt.TRANSITIONS.get((state, reset))
            assert target == (None if state is NmtState.BOOT_UP else NmtState.BOOT_UP)


def test_a_command_that_leads_somewhere_leads_to_its_own_state():
    targets = {
        NmtCommand.START: NmtState.OPERATIONAL,
        NmtCommand.STOP: NmtState.STOPPED,
        NmtCommand.PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
        NmtCommand.RESET_NODE: NmtState.BOOT_UP,
        NmtCommand.RESET_COMMUNICATION: NmtState.BOOT_UP,
    }
    assert all(targets[command] is target for (_, command), target in nmt.TRANSITIONS.items())
    assert len(nmt.TRANSITIONS) == 12  # transitions 3 to 14 of the diagram


@given(st.sampled_from(list(NmtCommand)), st.integers(0, 127))
def test_commands_survive_the_round_trip(command, node_id):
    assert nmt.decode_command(nmt.encode_command(command, node_id)) == (command, node_id)


@given(st.integers(1, 127), st.sampled_from(list(NmtState)), st.booleans())
def test_heartbeats_survive_the_round_trip(node_id, state, toggle):
    assert nmt.decode_heartbeat(nmt.encode_heartbeat(node_id, state, toggle=toggle)) == (node_id, state, toggle)
