"""The library canopen's state machine of CiA 402 as the master of the simulated drives."""

import struct

import pytest
from canopen.profiles.p402 import BaseNode402, OperationMode
from masters import await_true, shows
from stations import PATIENCE_S


@pytest.fixture
def drive(network, node) -> BaseNode402:
    """The library's state machine, fed by TPDO1; a thread sends SYNC, hence the patient period in 1006."""
    node.sdo[0x1006].raw = 1_000_000
    node.nmt.state = "OPERATIONAL"
    node.setup_402_state_machine()
    network.sync.start(0.02)
    yield node
    network.sync.stop()


@shows("CiA 402 states")
def test_the_librarys_state_machine_walks_up_and_down(drive):
    for state in ("READY TO SWITCH ON", "SWITCHED ON", "OPERATION ENABLED", "SWITCHED ON", "SWITCH ON DISABLED"):
        drive.state = state
        assert drive.state == state


@shows("CiA 402 states")
def test_the_librarys_state_machine_stops_quickly(drive):
    drive.sdo[0x605A].raw = 6
    drive.state = "OPERATION ENABLED"
    drive.state = "QUICK STOP ACTIVE"
    assert drive.state == "QUICK STOP ACTIVE"
    drive.state = "SWITCH ON DISABLED"
    assert drive.state == "SWITCH ON DISABLED"


@shows("CiA 402 states")
def test_the_librarys_state_machine_resets_a_fault(drive):
    drive.state = "OPERATION ENABLED"
    drive.sdo.download(0x2F00, 0, b"\x01\0\0\0")
    await_true(drive.is_faulted)
    drive.reset_from_fault()
    assert not drive.is_faulted()


@shows("CiA 402 modes")
@pytest.mark.parametrize("mode", ["PROFILED TORQUE", "HOMING", "CYCLIC SYNCHRONOUS TORQUE"])
def test_the_library_sets_a_supported_mode(drive, mode):
    drive.op_mode = mode
    assert drive.op_mode == mode


@shows("CiA 402 modes")
def test_the_library_is_told_which_modes_there_are(node):
    supported = {name for name in OperationMode.SUPPORTED if node.is_op_mode_supported(name)}
    assert supported - {"NO MODE"} == {"PROFILED TORQUE", "HOMING", "CYCLIC SYNCHRONOUS TORQUE"}


@shows("CiA 402 modes")
def test_the_library_homes_on_the_current_position(drive):
    drive.sdo[0x607C].raw = 12345
    assert drive.homing(timeout=PATIENCE_S)
    assert drive.sdo[0x6064].raw == 12345


@shows("CiA 402 modes")
def test_torque_turns_the_encoder_its_way(network, node):
    """Node 1 alone pushes with 0.4 N·m, 8040 counts: more than the friction of all three joints, for a moment."""
    node.nmt.state = "OPERATIONAL"
    for controlword in (0x06, 0x07, 0x0F):
        node.sdo[0x6040].raw = controlword
    assert node.sdo[0x6041].raw & 0x6F == 0x27
    before = node.sdo[0x6064].raw
    network.send_message(0x201, struct.pack("<Hh", 0x0F, 8040))
    await_true(lambda: node.sdo[0x6064].raw - before >= 50)
    network.send_message(0x201, struct.pack("<Hh", 0x00, 0))
