"""Logs and records to be read by programs that are not ours."""

import subprocess
import sys
from collections import Counter

import can
import pytest

from torquerig.assembly import open_rig
from torquerig.axes import axis_settings, group_settings
from torquerig.configuration import load_configuration
from torquerig.driver.master.group import AxisGroup
from torquerig.record import BUS_FILE, BusLog

# CiA 301, table of the pre-defined connection set: function code in bits 7 to 10 of the identifier
FUNCTIONS = (
    *("NMT", "SYNC or EMCY", "TIME", "TPDO1", "RPDO1", "TPDO2", "RPDO2", "TPDO3", "RPDO3", "TPDO4", "RPDO4"),
    *("SDO response", "SDO request", "", "heartbeat", "LSS"),
)


def kind_of(message):
    """What kind of CANopen message a frame of python-can is, by its identifier alone; boot-up by its data."""
    function, node_id = divmod(message.arbitration_id, 0x80)
    kind = FUNCTIONS[function]
    if kind == "SYNC or EMCY":
        return "EMCY" if node_id else "SYNC"
    return "boot-up" if kind == "heartbeat" and not any(message.data) else kind


def messages_of(log):
    with can.LogReader(log) as reader:
        return list(reader)


@pytest.fixture(scope="session")
def read_log():
    return messages_of


@pytest.fixture(scope="session")
def count_kinds():
    return lambda log: Counter(map(kind_of, messages_of(log)))


@pytest.fixture(scope="session")
def record(tmp_path_factory):
    """Return the record of a run as a user makes it."""
    place = tmp_path_factory.mktemp("run") / "record"
    command = [sys.executable, "-m", "torquerig", "run", "--json", "--record", str(place)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return place


@pytest.fixture(scope="session")
def deserted_log(tmp_path_factory):
    """Return the log of drives whose controller vanishes while they are enabled."""
    configuration = load_configuration()
    log = BusLog()
    with open_rig(configuration, tap=log.tap) as rig:
        group = AxisGroup(rig.bus, axis_settings(configuration), group_settings(configuration.rig))
        group.__enter__()
        group.home()
        group.enable()
        until_ns = rig.bus.now_ns() + 100_000_000
        while rig.bus.receive(until_ns) is not None:
            pass
    place = tmp_path_factory.mktemp("deserted") / BUS_FILE
    log.write(place, "lockstep")
    return place
