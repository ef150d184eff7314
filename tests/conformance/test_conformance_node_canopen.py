"""node-canopen, the npm package `canopen`, as the master of the simulated drives."""

import pytest

NAME = b"torquerig simulated torque drive".hex()


def shows(section: str) -> pytest.MarkDecorator:
    return pytest.mark.conformance(section, "node-canopen")


@shows("NMT")
@pytest.mark.parametrize(("service", "state"), [("startNode", 0x05), ("stopNode", 0x04)], ids=["start", "stop"])
def test_a_service_leads_to_a_state_and_pre_operational_back(node_master, service, state):
    node_master.order("nmt", service=service)
    node_master.event("heartbeat", node=1, state=state)
    node_master.order("nmt", service="enterPreOperational")
    node_master.event("heartbeat", node=1, state=0x7F)


@shows("NMT")
@pytest.mark.parametrize("service", ["resetNode", "resetCommunication"])
def test_a_reset_ends_in_a_boot_up_message_and_pre_operational(node_master, service):
    node_master.order("nmt", service="startNode")
    node_master.event("heartbeat", node=1, state=0x05)
    node_master.order("nmt", service=service)
    node_master.event("heartbeat", node=1, state=0x00)
    node_master.event("heartbeat", node=1, state=0x7F)


@shows("SDO")
@pytest.mark.parametrize(
    ("index", "subindex", "data"),
    [(0x1001, 0, "00"), (0x1017, 0, "3200"), (0x1000, 0, "92010200"), (0x1018, 4, "01000000")],
    ids=["one byte", "two bytes", "four bytes", "a sub-index"],
)
def test_expedited_upload(node_master, index, subindex, data):
    assert node_master.order("upload", index=index, subIndex=subindex) == {"answer": data}


@shows("SDO")
def test_segmented_upload_of_a_string(node_master):
    assert node_master.order("upload", index=0x1008, subIndex=0) == {"answer": NAME}


@shows("SDO")
def test_block_upload_of_a_string_with_crc(node_master):
    assert node_master.order("upload", index=0x1008, subIndex=0, block=True) == {"answer": NAME}


@shows("SDO")
@pytest.mark.parametrize(("index", "data"), [(0x6060, "04"), (0x1015, "6400"), (0x1006, "401f0000")])
def test_expedited_download(node_master, index, data):
    assert node_master.order("download", index=index, subIndex=0, data=data) == {"answer": None}
    assert node_master.order("upload", index=index, subIndex=0) == {"answer": data}


@shows("SDO")
def test_block_download_with_crc(node_master):
    assert node_master.order("download", index=0x1006, subIndex=0, data="401f0000", block=True) == {"answer": None}
    assert node_master.order("upload", index=0x1006, subIndex=0) == {"answer": "401f0000"}


@shows("SDO abort codes")
@pytest.mark.parametrize(
    ("index", "subindex", "code"),
    [(0x5FFF, 0, 0x06020000), (0x1018, 9, 0x06090011), (0x2F00, 0, 0x06010001), (0x1003, 1, 0x08000024)],
    ids=["no object", "no sub-index", "write-only", "no data"],
)
def test_a_refused_upload_names_its_reason(node_master, index, subindex, code):
    assert node_master.order("upload", index=index, subIndex=subindex) == {"refused": code}


@shows("SDO abort codes")
@pytest.mark.parametrize(
    ("index", "data", "code"),
    [(0x6041, "0000", 0x06010002), (0x1017, "00000000", 0x06070012), (0x1017, "00", 0x06070013)],
    ids=["read-only", "too long", "too short"],
)
def test_a_refused_download_names_its_reason(node_master, index, data, code):
    assert node_master.order("download", index=index, subIndex=0, data=data) == {"refused": code}


@shows("PDO transmission")
def test_a_tpdo_is_told_by_the_names_of_the_eds(node_master):
    node_master.order("nmt", service="startNode")
    node_master.order("sync", counter=None)
    told = node_master.event("pdo", cobId=0x181)
    assert told["values"] == {"Statusword": 0x0250, "Position actual value": 0, "Raw torque actual": 0}


@shows("PDO transmission")
def test_an_rpdo_moves_the_drive(node_master):
    node_master.order("nmt", service="startNode")
    node_master.order("frame", id=0x201, data="06000000")
    assert node_master.order("upload", index=0x6041, subIndex=0) == {"answer": "3102"}


@shows("SYNC")
def test_a_sync_with_a_counter_is_answered(node_master):
    for index, data in ((0x1006, "00000000"), (0x1019, "0a")):
        assert node_master.order("download", index=index, subIndex=0, data=data) == {"answer": None}
    node_master.order("nmt", service="startNode")
    node_master.order("sync", counter=1)
    node_master.event("pdo", cobId=0x181)


@shows("EMCY")
def test_an_emergency_is_heard_with_code_and_register(node_master):
    node_master.order("download", index=0x2F00, subIndex=0, data="01000000")
    node_master.event("emergency", cobId=0x081, code=0x2310, register=0x03)


@shows("CiA 402 states")
def test_a_drive_is_enabled_and_disabled(node_master):
    node_master.order("nmt", service="startNode")
    for controlword, statusword in (("0600", "3102"), ("0700", "3302"), ("0f00", "3712"), ("0000", "5002")):
        assert node_master.order("download", index=0x6040, subIndex=0, data=controlword) == {"answer": None}
        assert node_master.order("upload", index=0x6041, subIndex=0) == {"answer": statusword}
