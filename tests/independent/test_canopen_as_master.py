"""The library canopen, which shares no line with us, as the master of the simulated drives over a real-time bus."""

from __future__ import annotations

import struct
import time
from collections.abc import Iterator
from importlib.resources import files

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402

EDS = str(files("torquerig.driver") / "data" / "torquerig-drive.eds")
PATIENCE_S = 20.0  # real time on a shared machine: order and content are asserted, never speed


@pytest.fixture
def network(simulator) -> Iterator[canopen.Network]:
    network = canopen.Network()
    network.connect(interface="unix", channel=str(simulator.folder))
    yield network
    network.disconnect()


@pytest.fixture
def drive(network) -> BaseNode402:
    node = BaseNode402(1, EDS)
    network.add_node(node)
    node.sdo.RESPONSE_TIMEOUT = PATIENCE_S
    return node


def walk(drive: BaseNode402, controlword: int) -> None:
    drive.sdo[0x6040].raw = controlword


def state_bits(drive: BaseNode402) -> int:
    return drive.sdo[0x6041].raw & 0x6F


def enable(drive: BaseNode402) -> None:
    for controlword in (0x06, 0x07, 0x0F):
        walk(drive, controlword)
    assert state_bits(drive) == 0x27


def test_the_scan_finds_three_nodes(network):
    network.scanner.search(limit=10)
    give_up = time.monotonic() + PATIENCE_S
    while len(network.scanner.nodes) < 3 and time.monotonic() < give_up:
        time.sleep(0.05)
    assert sorted(network.scanner.nodes) == [1, 2, 3]


def test_every_node_tells_its_identity(network):
    serials = set()
    for node_id in (1, 2, 3):
        node = network.add_node(node_id, EDS)
        node.sdo.RESPONSE_TIMEOUT = PATIENCE_S
        assert node.sdo[0x1000].raw == 0x00020192
        assert node.sdo[0x1018][2].raw == node.object_dictionary[0x1018][2].default
        serials.add(node.sdo[0x1018][4].raw)
    assert len(serials) == 3


def test_every_readable_object_of_the_eds_reads_with_the_length_of_its_type(drive):
    for entry in drive.object_dictionary.values():
        variables = [entry] if isinstance(entry, canopen.objectdictionary.ODVariable) else list(entry.values())
        for variable in variables:
            if variable.index == 0x1003 and variable.subindex > 0:
                with pytest.raises(canopen.SdoAbortedError) as nothing:  # CiA 301, 7.5.2.4: no error, no entry
                    drive.sdo.upload(variable.index, variable.subindex)
                assert nothing.value.code == 0x08000024
            elif variable.readable and variable.index >= 0x1000:
                data = drive.sdo.upload(variable.index, variable.subindex)
                if variable.data_type in canopen.objectdictionary.datatypes.NUMBER_TYPES:
                    assert len(data) * 8 == len(variable), variable.name


def test_a_remapped_tpdo_says_what_it_was_mapped_to(network, drive):
    drive.nmt.state = "PRE-OPERATIONAL"
    drive.tpdo.read()
    pdo = drive.tpdo[1]
    pdo.clear()
    pdo.add_variable(0x6064)
    pdo.add_variable(0x6061)
    pdo.trans_type = 1
    pdo.enabled = True
    pdo.save()
    drive.nmt.state = "OPERATIONAL"
    drive.nmt.wait_for_heartbeat(PATIENCE_S)
    pdo.subscribe()
    network.sync.transmit()
    assert pdo.wait_for_reception(PATIENCE_S) is not None
    assert len(pdo.data) == 5
    assert pdo[1].raw == 10
    assert drive.sdo[0x1A00][0].raw == 2


def test_a_drive_walks_to_operation_enabled_and_back(drive):
    drive.nmt.state = "OPERATIONAL"
    enable(drive)
    for controlword, bits in ((0x07, 0x23), (0x06, 0x21), (0x00, 0x40)):
        walk(drive, controlword)
        assert state_bits(drive) & 0x4F == bits & 0x4F


def test_the_librarys_own_402_machine_enables_the_drive(network, drive):
    """It reads the statusword from TPDO1, so SYNC must run; a thread sends it, hence the patient period in 1006."""
    drive.sdo[0x1006].raw = 1_000_000
    drive.nmt.state = "OPERATIONAL"
    drive.setup_402_state_machine()
    network.sync.start(0.02)
    drive.state = "OPERATION ENABLED"
    assert drive.state == "OPERATION ENABLED"
    drive.state = "SWITCH ON DISABLED"
    network.sync.stop()
    assert state_bits(drive) == 0x40


def test_torque_commanded_by_rpdo_turns_the_encoder_that_way(network, drive):
    """Node 1 alone pushes with 0.4 N·m, 8040 counts: more than the friction of all three joints, for a moment."""
    drive.nmt.state = "OPERATIONAL"
    drive.sdo[0x2120][2].raw = 0
    enable(drive)
    before = drive.sdo[0x6064].raw
    network.send_message(0x201, struct.pack("<Hh", 0x0F, 8040))
    moved = 0
    give_up = time.monotonic() + PATIENCE_S
    while moved < 50 and time.monotonic() < give_up:
        moved = drive.sdo[0x6064].raw - before
    network.send_message(0x201, struct.pack("<Hh", 0x00, 0))
    assert moved >= 50


def test_an_emergency_of_an_enabled_drive_is_heard_with_its_code(network, drive):
    """The RPDO event timer expires: EMCY 0x8250, error register's communication bit, the drive in fault."""
    drive.sdo[0x1400][5].raw = 40
    drive.nmt.state = "OPERATIONAL"
    enable(drive)
    network.send_message(0x201, struct.pack("<Hh", 0x0F, 0))
    emergency = drive.emcy.wait(0x8250, PATIENCE_S)
    assert emergency is not None
    assert emergency.register & 0x11 == 0x11
    assert state_bits(drive) & 0x4F == 0x08
    assert drive.sdo[0x603F].raw == 0x8250
    assert drive.sdo[0x1003][1].raw & 0xFFFF == 0x8250
    walk(drive, 0x80)
    assert state_bits(drive) & 0x4F == 0x40
