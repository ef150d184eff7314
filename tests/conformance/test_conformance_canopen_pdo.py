"""The library canopen, which shares no line with us, as the master: process data and SYNC."""

import struct

import pytest
from masters import abort_code, await_pdo, await_state, await_true, join, shows


@shows("PDO mapping")
def test_the_library_reads_the_mappings_that_the_eds_ships(node):
    node.tpdo.read()
    node.rpdo.read()
    assert [each.index for each in node.tpdo[1]] == [0x6041, 0x6064, 0x2077]
    assert [each.index for each in node.tpdo[2]] == [0x606C, 0x2100, 0x603F]
    assert [each.index for each in node.rpdo[1]] == [0x6040, 0x2071]
    assert [number for number, pdo in node.tpdo.items() if pdo.enabled] == [1, 2]


@shows("PDO mapping")
@pytest.mark.parametrize("state", ["PRE-OPERATIONAL", "OPERATIONAL"])
def test_a_tpdo_is_remapped_in(network, node, state):
    node.nmt.state = state
    node.tpdo.read()
    pdo = node.tpdo[1]
    pdo.clear()
    pdo.add_variable(0x6064)
    pdo.add_variable(0x6061)
    pdo.save()
    node.nmt.state = "OPERATIONAL"
    await_state(node, 0x05)
    await_pdo(pdo, network.sync.transmit)
    assert len(pdo.data) == 5
    assert pdo[1].raw == 10


@shows("PDO mapping")
def test_an_rpdo_is_mapped_with_a_dummy(network, node):
    node.rpdo.read()
    pdo = node.rpdo[2]
    pdo.clear()
    pdo.add_variable(0x0003, 0, 16)
    pdo.add_variable(0x2071)
    pdo.enabled = True
    pdo.save()
    node.nmt.state = "OPERATIONAL"
    network.send_message(pdo.cob_id, struct.pack("<hh", 1234, -1000))
    assert node.sdo[0x2071].raw == -1000


@shows("PDO mapping")
@pytest.mark.parametrize(
    ("entry", "code"),
    [(0x5FFF0010, 0x06020000), (0x10170010, 0x06040041), (0x60410008, 0x06040041)],
    ids=["missing", "not mappable", "another length"],
)
def test_an_impossible_entry_is_refused(node, entry, code):
    node.sdo[0x1800][1].raw = 0x80000181
    node.sdo[0x1A00][0].raw = 0
    assert abort_code(lambda: setattr(node.sdo[0x1A00][1], "raw", entry)) == code


@shows("PDO mapping")
def test_too_many_bytes_are_refused(node):
    node.sdo[0x1800][1].raw = 0x80000181
    node.sdo[0x1A00][0].raw = 0
    for subindex in (1, 2, 3):
        node.sdo[0x1A00][subindex].raw = 0x60640020
    assert abort_code(lambda: setattr(node.sdo[0x1A00][0], "raw", 3)) == 0x06040042


@shows("PDO mapping")
def test_a_mapping_is_refused_while_its_pdo_is_enabled(node):
    assert abort_code(lambda: setattr(node.sdo[0x1A00][0], "raw", 0)) == 0x08000022


@shows("PDO transmission")
def test_an_rpdo_of_the_library_moves_the_drive(node):
    node.rpdo.read()
    node.nmt.state = "OPERATIONAL"
    node.rpdo[1][0x6040].raw = 0x06
    node.rpdo[1].transmit()
    await_true(lambda: node.sdo[0x6041].raw & 0x6F == 0x21)


@shows("PDO transmission")
def test_a_tpdo_is_fetched_by_a_remote_frame(node):
    node.tpdo.read()
    node.nmt.state = "OPERATIONAL"
    await_state(node, 0x05)
    await_pdo(node.tpdo[1], node.tpdo[1].remote_request)
    assert node.tpdo[1][0x6041].raw & 0x4F == 0x40


@shows("PDO transmission")
def test_a_tpdo_of_type_255_tells_a_change(node):
    node.tpdo.read()
    pdo = node.tpdo[3]
    pdo.clear()
    pdo.add_variable(0x6041)
    pdo.trans_type = 255
    pdo.enabled = True
    pdo.save()
    seen = []
    pdo.add_callback(lambda told: seen.append(told[0].raw & 0x6F))
    node.nmt.state = "OPERATIONAL"
    node.sdo[0x6040].raw = 0x06
    node.sdo[0x6040].raw = 0x07
    await_true(lambda: seen == [0x40, 0x21, 0x23])


@shows("SYNC")
def test_a_sync_is_answered_by_all_that_are_operational(network):
    nodes = [join(network, node_id) for node_id in (1, 2, 3)]
    for each in nodes:
        each.tpdo.read()
    network.nmt.state = "OPERATIONAL"
    for each in nodes:
        await_state(each, 0x05)
    heard = []
    for each in nodes:
        each.tpdo[1].add_callback(lambda pdo: heard.append(pdo.cob_id))
    network.sync.transmit()
    await_true(lambda: sorted(heard) == [0x181, 0x182, 0x183])


@shows("SYNC")
def test_a_sync_with_a_counter_is_answered(network, node):
    node.sdo[0x1006].raw = 0
    node.sdo[0x1019].raw = 10
    node.tpdo.read()
    node.nmt.state = "OPERATIONAL"
    await_state(node, 0x05)
    await_pdo(node.tpdo[1], lambda: network.sync.transmit(1))
