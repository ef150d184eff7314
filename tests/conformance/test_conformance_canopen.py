"""The library canopen, which shares no line with us, as the master: NMT, SDO, EMCY, storage."""

import struct

import canopen
import pytest
from masters import abort_code, await_boot_up, await_state, await_true, join, shows

NAME = b"torquerig simulated torque drive"
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")  # canopen leaves streams of SDO to the collector


@shows("Scan")
def test_the_scan_finds_three_nodes_and_no_other(network):
    network.scanner.search(limit=127)
    await_true(lambda: len(network.scanner.nodes) >= 3)
    assert sorted(network.scanner.nodes) == [1, 2, 3]


@shows("Scan")
def test_each_node_has_its_own_identity(network):
    serials = set()
    for node_id in (1, 2, 3):
        each = join(network, node_id)
        assert each.sdo[0x1000].raw == 0x00020192
        serials.add(each.sdo[0x1018][4].raw)
    assert len(serials) == 3


@shows("Object dictionary")
def test_every_default_of_the_eds_is_what_sdo_reads(node):
    differing = {}
    for entry in node.object_dictionary.values():
        single = isinstance(entry, canopen.objectdictionary.ODVariable)
        for variable in [entry] if single else entry.subindices.values():
            address = (variable.index, variable.subindex)
            told = variable.index == 0x6041 or (variable.index == 0x1003 and variable.subindex)
            if variable.index < 0x1000 or variable.default is None or not variable.readable or told:
                continue
            held = variable.decode_raw(node.sdo.upload(*address))
            if held != variable.default:
                differing[address] = (variable.default, held)
    assert differing == {}


@shows("NMT")
@pytest.mark.parametrize("before", [0x7F, 0x05, 0x04])
@pytest.mark.parametrize(("command", "after"), [(1, 0x05), (2, 0x04), (128, 0x7F)])
def test_a_command_leads_from_state_to_state(node, before, command, after):
    node.nmt.send_command({0x7F: 128, 0x05: 1, 0x04: 2}[before])
    await_state(node, before)
    node.nmt.send_command(command)
    await_state(node, after)


@shows("NMT")
@pytest.mark.parametrize("command", [129, 130])
@pytest.mark.parametrize("before", [128, 1, 2])
def test_both_resets_end_in_a_boot_up_message(node, before, command):
    node.nmt.send_command(before)
    await_boot_up(node, command)
    await_state(node, 0x7F)


@shows("NMT")
def test_a_command_to_all_reaches_all(network):
    nodes = [join(network, node_id) for node_id in (1, 2, 3)]
    network.nmt.state = "OPERATIONAL"
    for each in nodes:
        await_state(each, 0x05)


@shows("Heartbeat and guarding")
def test_the_guarded_node_tells_its_state(node):
    node.sdo[0x1017].raw = 0
    for state in ("OPERATIONAL", "STOPPED", "PRE-OPERATIONAL"):
        node.nmt.state = state
        node.nmt.start_node_guarding(0.01)
        for _ in range(3):
            node.nmt.wait_for_heartbeat()
        node.nmt.stop_node_guarding()
        assert node.nmt.state == state


@shows("Heartbeat and guarding")
def test_the_masters_heartbeat_is_missed_and_told_by_emcy_8130(network, node):
    node.sdo[0x1016][1].raw = 127 << 16 | 100
    network.send_message(0x77F, b"\x05")
    await_true(lambda: node.emcy.log)
    assert (node.emcy.log[0].code, node.emcy.log[0].register) == (0x8130, 0x11)


@shows("SDO")
def test_expedited_transfers_of_one_two_and_four_bytes(node):
    for index, value in ((0x6060, 4), (0x1015, 100), (0x1006, 8000)):
        node.sdo[index].raw = value
        assert node.sdo[index].raw == value


@shows("SDO")
def test_segmented_upload_of_a_string(node):
    assert node.sdo[0x1008].raw == NAME.decode()


@shows("SDO")
def test_segmented_upload_of_an_integer_of_eight_bytes(node):
    assert node.sdo[0x2130].raw == 0


@shows("SDO")
def test_segmented_download(node):
    with node.sdo.open(0x1006, 0, "wb", size=4, force_segment=True, buffering=0) as stream:
        stream.write(struct.pack("<I", 8000))
    assert node.sdo[0x1006].raw == 8000


@shows("SDO")
@pytest.mark.parametrize("crc", ["with CRC", "without CRC"])
def test_block_upload_of_a_string(node, crc):
    options = {"block_transfer": True, "request_crc_support": crc == "with CRC"}
    with node.sdo.open(0x1008, 0, "rb", **options) as stream:
        assert stream.read() == NAME


@shows("SDO")
@pytest.mark.parametrize("crc", ["with CRC", "without CRC"])
def test_block_download(node, crc):
    options = {"block_transfer": True, "request_crc_support": crc == "with CRC", "size": 4, "buffering": 0}
    with node.sdo.open(0x1006, 0, "wb", **options) as stream:
        stream.write(struct.pack("<I", 8000))
    assert node.sdo[0x1006].raw == 8000


@shows("SDO abort codes")
@pytest.mark.parametrize(
    ("index", "subindex", "code"),
    [(0x5FFF, 0, 0x06020000), (0x1018, 9, 0x06090011), (0x2F00, 0, 0x06010001), (0x1003, 1, 0x08000024)],
    ids=["no object", "no sub-index", "write-only", "no data"],
)
def test_a_refused_upload_names_its_reason(node, index, subindex, code):
    assert abort_code(lambda: node.sdo.upload(index, subindex)) == code


@shows("SDO abort codes")
@pytest.mark.parametrize(
    ("index", "subindex", "data", "code"),
    [
        (0x6041, 0, b"\0\0", 0x06010002),
        (0x1017, 0, b"\0\0\0\0", 0x06070012),
        (0x1017, 0, b"\0", 0x06070013),
        (0x1800, 2, b"\xf1", 0x06090030),
        (0x605D, 0, b"\x05\0", 0x06090031),
        (0x605D, 0, b"\0\0", 0x06090032),
        (0x1010, 1, b"load", 0x08000020),
        (0x1019, 0, b"\x0a", 0x08000022),
    ],
    ids=["read-only", "too long", "too short", "not allowed", "too high", "too low", "signature", "device state"],
)
def test_a_refused_download_names_its_reason(node, index, subindex, data, code):
    assert abort_code(lambda: node.sdo.download(index, subindex, data)) == code


@shows("EMCY")
def test_an_emergency_is_heard_entered_and_reset(node):
    node.sdo.download(0x2F00, 0, b"\x01\0\0\0")
    await_true(lambda: node.emcy.active)
    (emergency,) = node.emcy.active
    assert (emergency.code, emergency.register) == (0x2310, 0x03)
    assert emergency.get_desc() == "Current"
    assert node.sdo[0x1003][0].raw == 1
    assert node.sdo[0x1003][1].raw & 0xFFFF == 0x2310
    node.sdo[0x6040].raw = 0x80
    await_true(lambda: node.emcy.active == [])
    assert node.sdo[0x1001].raw == 0
    node.sdo[0x1003][0].raw = 0
    assert node.sdo[0x1003][0].raw == 0


@shows("Storage")
def test_what_the_library_stores_outlives_a_reset_until_it_restores(node):
    node.sdo[0x6087].raw = 1000
    node.store()
    for command, slope in ((None, 1000), (node.restore, 300000)):
        if command is not None:
            command()
        await_boot_up(node, 129)
        assert node.sdo[0x6087].raw == slope
