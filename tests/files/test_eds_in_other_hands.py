"""The shipped EDS as other people's programs see it: dcf-tools, and canopen beside a simulated drive."""

import os
import subprocess
import sys

import canopen
import pytest
from canopen.objectdictionary import ODVariable
from canopen.sdo import SdoAbortedError

from torquerig.assembly import build_simulation
from torquerig.configuration import load_configuration
from torquerig.device_sim.network import SimulatedNetwork
from torquerig.driver.wire.dictionary import DRIVE_EDS
from torquerig.driver.wire.frame import Frame

NODE_ID = 2
STATUSWORD = (0x6041, 0)  # tells the state, which after power-on is another one than before
HISTORY = 0x1003
NO_DATA = 0x08000024  # CiA 301, 7.5.2.4: what an entry that is not there is answered with
PATIENCE_NS = 5_000_000


class Line(canopen.Network):
    """canopen's network on a simulated wire: what is sent is answered before the call returns."""

    def __init__(self, wire):
        super().__init__()
        self.wire = wire

    def send_message(self, can_id, data, remote=False):
        self.wire.submit(Frame(can_id, bytes(data), remote))
        until_ns = self.wire.now_ns() + PATIENCE_NS
        while (arrival := self.wire.run_until(until_ns)) is not None:
            self.notify(arrival.frame.can_id, bytearray(arrival.frame.data), arrival.at_ns / 1e9)


def dcfchk(eds):
    """Run dcf-tools' checker; its findings are Python's warnings, and not all of them change the exit status."""
    command = [sys.executable, "-m", "dcf.cli", "-n", "1", str(eds)]
    environment = {**os.environ, "PYTHONWARNINGS": "always"}
    return subprocess.run(command, capture_output=True, text=True, check=False, env=environment)


def test_dcfchk_finds_nothing():
    run = dcfchk(DRIVE_EDS)
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")


@pytest.mark.parametrize(
    ("right", "wrong", "finding"),
    [
        ("[1001]", "[1002]", "object 0x1001 not found"),
        ("HighLimit=240\nAccessType=rw\nDefaultValue=0", "HighLimit=240\nAccessType=rw\nDefaultValue=241", "overflow"),
        ("SubNumber=5", "SubNumber=4", "1 extra sub-object"),
    ],
)
def test_dcfchk_is_awake(tmp_path, right, wrong, finding):
    text = DRIVE_EDS.read_text("ascii")
    assert right in text
    spoilt = tmp_path / DRIVE_EDS.name
    spoilt.write_text(text.replace(right, wrong, 1), "ascii")
    run = dcfchk(spoilt)
    assert run.returncode == 1
    assert finding in run.stderr


@pytest.fixture(scope="module")
def node():
    simulation = build_simulation(load_configuration().rig, None)
    wire = SimulatedNetwork(simulation.devices, 1_000_000)
    while wire.run_until(10_000_000) is not None:
        pass
    return Line(wire).add_node(NODE_ID, str(DRIVE_EDS))


def defaults(dictionary):
    """Every variable with a default, as canopen reads the EDS."""
    for entry in dictionary.values():
        variables = [entry] if isinstance(entry, ODVariable) else entry.subindices.values()
        yield from (variable for variable in variables if variable.default is not None)


def test_sdo_reads_every_default_of_the_eds(node):
    differing = {}
    count = 0
    for variable in defaults(node.object_dictionary):
        address = (variable.index, variable.subindex)
        if address == STATUSWORD or (variable.index == HISTORY and variable.subindex):
            continue
        count += 1
        held = variable.decode_raw(node.sdo.upload(*address))
        if held != variable.default:
            differing[f"{variable.index:04X}:{variable.subindex:X}"] = (variable.default, held)
    assert differing == {}
    assert count > 200


def test_an_empty_history_has_no_entries_to_read(node):
    assert node.sdo[HISTORY][0].raw == 0
    for subindex in range(1, 9):
        with pytest.raises(SdoAbortedError) as abort:
            node.sdo.upload(HISTORY, subindex)
        assert abort.value.code == NO_DATA


def test_after_power_on_the_statusword_says_switch_on_disabled(node):
    assert node.sdo[0x6041].raw & 0x4F == 0x40


def test_what_the_eds_does_not_hold_does_not_exist(node):
    for index in (0x2F01, 0x5FFF, 0x6010):
        assert index not in node.object_dictionary
        with pytest.raises(SdoAbortedError) as abort:
            node.sdo.upload(index, 0)
        assert abort.value.code == 0x06020000
