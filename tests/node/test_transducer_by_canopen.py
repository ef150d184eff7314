"""The library canopen, which shares no line with us, reads the simulated transducer; dcf-tools checks its EDS."""

import os
import struct
import subprocess
import sys

import canopen
import pytest
from canopen.objectdictionary import ODVariable
from canopen.sdo import SdoAbortedError

from torquerig.bench import build_bench
from torquerig.configuration import load_configuration
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.driver.wire.frame import Frame
from torquerig.driver.wire.measuring import TRANSDUCER_EDS

NODE_ID = 10
PATIENCE_NS = 5_000_000
NOT_DEFAULT = {0x6150, 0x9100, 0x9130, 0x1003}  # measured; and a history that is empty
OFFSET = 0.004


class Line(canopen.Network):
    """canopen's network on a simulated wire: what is sent is answered before the call returns."""

    def __init__(self, wire):
        super().__init__()
        self.wire = wire

    def send_message(self, can_id, data, remote=False):
        self.wire.submit(Frame(can_id, bytes(data), remote))
        self.listen(PATIENCE_NS)

    def listen(self, duration_ns):
        until_ns = self.wire.now_ns() + duration_ns
        while (arrival := self.wire.run_until(until_ns)) is not None:
            self.notify(arrival.frame.can_id, bytearray(arrival.frame.data), arrival.at_ns / 1e9)


@pytest.fixture
def node():
    rig = load_configuration(options={"bench.noise": 0.0, "bench.offset": OFFSET}).rig
    wire = SimulatedNetwork(build_bench(rig).devices, 1_000_000)
    while wire.run_until(10_000_000) is not None:
        pass
    return Line(wire).add_node(NODE_ID, str(TRANSDUCER_EDS))


def test_the_eds_is_in_order_by_dcf_tools():
    command = [sys.executable, "-m", "dcf.cli", "-n", str(NODE_ID), str(TRANSDUCER_EDS)]
    environment = {**os.environ, "PYTHONWARNINGS": "always"}
    run = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")


def test_every_default_of_the_eds_is_what_sdo_reads(node):
    count = 0
    for entry in node.object_dictionary.values():
        for variable in [entry] if isinstance(entry, ODVariable) else entry.subindices.values():
            if variable.default is not None and variable.index not in NOT_DEFAULT:
                held = variable.decode_raw(node.sdo.upload(variable.index, variable.subindex))
                assert held == variable.default, variable.qualname
                count += 1
    assert count > 50


def test_it_is_a_measuring_device_of_torque(node):
    assert node.sdo["Device type"].raw & 0xFFFF == 404
    assert node.sdo["AI physical unit PV"][1].raw == 0x00560000  # CiA 303-2: N·m without a prefix
    assert node.sdo["AI input PV"][1].raw / 10 ** node.sdo["AI decimal digits PV"][1].raw == OFFSET


def test_zeroed_it_shows_nothing(node):
    node.sdo["AI autozero"][1].raw = int.from_bytes(b"zero", "little")
    assert node.sdo["AI input PV"][1].raw == 0
    assert node.sdo["AI input offset"][1].raw == -400
    with pytest.raises(SdoAbortedError) as abort:
        node.sdo["AI autozero"][1].raw = 1
    assert abort.value.code == 0x08000020


def test_operational_it_sends_its_pdo(node):
    heard = []
    node.tpdo.read()
    node.tpdo[1].add_callback(lambda message: heard.append([variable.raw for variable in message]))
    node.nmt.state = "OPERATIONAL"
    node.network.listen(250_000_000)
    assert heard == [[400, 0]] * 3  # at once, and twice by its event timer of 100 ms


def test_its_emergency_and_heartbeat_are_heard(node):
    node.network.listen(60_000_000)
    assert node.nmt.state == "PRE-OPERATIONAL"
    frames = []
    node.network.subscribe(0x80 + NODE_ID, lambda _id, data, _at: frames.append(bytes(data)))
    node.network.send_message(0x080, b"\x05")  # a SYNC with a counter, where none is expected: 0x8240
    assert [struct.unpack_from("<H", frame)[0] for frame in frames] == [0x8240]
