"""The kernel's CAN link goes down or away in the middle of a run, and comes back: nobody hangs, no torque stays."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import can
import links
import pyarrow.parquet as pq
import pytest

pytestmark = pytest.mark.vcan
LINK = "vcan7"
PATIENCE_S = 120.0
ZERO_NM = 1e-9
STALLS_S = 1.0
GRACE_NS = round((STALLS_S + 0.5) * 1e9)  # patience, then the watchdogs' 12 ms, in processes that may stand still
# a shared machine may stand still for longer than a watchdog waits, and spinning starves a peer on the same processor
PATIENT = f"[bus]\npatience = {STALLS_S}\n[loop]\nspin = 0.0\n"


class Loss(NamedTuple):
    """How a link is lost, and how it comes back."""

    lose: Callable[[], None]
    restore: Callable[[], None]


def delete():
    links.delete(LINK)


def add():
    links.add(LINK)
    links.switch(LINK, up=True)


DOWN = Loss(lambda: links.switch(LINK, up=False), lambda: links.switch(LINK, up=True))
DELETED = Loss(delete, add)


class Rig(NamedTuple):
    """A running simulator on the link."""

    simulator: subprocess.Popen[str]
    configuration: Path
    record: Path


def torquerig(*arguments: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "torquerig", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.fixture
def rig(tmp_path) -> Iterator[Rig]:
    add()
    configuration = tmp_path / "rig.toml"
    configuration.write_text(PATIENT, encoding="utf-8")
    record = tmp_path / "truth"
    simulator = torquerig("sim", "--bus", f"socketcan:{LINK}", "--config", configuration, "--record", record)
    try:
        assert simulator.stdout is not None
        assert simulator.stdout.readline().startswith(f"simulated drives 1, 2, 3 on socketcan:{LINK}")
        yield Rig(simulator, configuration, record)
    finally:
        simulator.kill()
        simulator.communicate()
        with suppress(OSError):  # the test may have failed while it was gone
            links.delete(LINK)


def run(rig: Rig, *arguments: object) -> subprocess.Popen[str]:
    return torquerig("run", "--bus", f"socketcan:{LINK}", "--config", rig.configuration, "--json", *arguments)


def running_controller(rig: Rig) -> subprocess.Popen[str]:
    """Start a long run, and wait until drive 1 is told to make torque."""
    controller = run(rig, "--repeat", "1000")
    with can.Bus(interface="socketcan", channel=LINK) as bus:
        while controller.poll() is None:
            message = bus.recv(1.0)
            if message and message.arbitration_id == 0x201 and message.data[2:4] != b"\0\0":
                return controller
    return pytest.fail(f"the run came to no torque: {controller.communicate()}")


@pytest.mark.parametrize("loss", [DOWN, DELETED], ids=["down", "deleted"])
def test_a_lost_link_ends_the_run_and_the_torque_and_the_next_run_finds_all_well(rig, loss):
    controller = running_controller(rig)
    loss.lose()
    lost_ns = time.time_ns()
    output, errors = controller.communicate(timeout=PATIENCE_S)
    assert (controller.returncode, output) == (3, ""), errors
    assert "its link is down or gone" in errors.splitlines()[0]
    assert "Traceback" not in errors

    time.sleep(6.0)
    back_ns = time.time_ns()
    loss.restore()
    again = run(rig)
    output, errors = again.communicate(timeout=PATIENCE_S)
    assert again.returncode == 0, errors
    assert json.loads(output)["cycles"] > 40

    rig.simulator.send_signal(signal.SIGTERM)
    said, errors = rig.simulator.communicate(timeout=PATIENCE_S)
    assert (rig.simulator.returncode, errors) == (0, "")
    gone, back = said.splitlines()[:2]
    assert "its link is down or gone" in gone
    assert back == "the bus is back"

    assert_no_torque(rig.record, lost_ns + GRACE_NS, back_ns)


def assert_no_torque(record: Path, since_ns: int, until_ns: int) -> None:
    """The record's times lag behind the wall clock by no more than the simulator's time stood still."""
    facts = json.loads((record / "run.json").read_text(encoding="utf-8"))
    zero_ns, until_ns = facts["time_zero_ns"], until_ns - facts["stood_still_ns"]
    truth = pq.read_table(record / "truth.parquet").to_pydict()
    torques = zip(*(truth[f"motor_torque_{axis}"] for axis in "123"), strict=True)
    rows = [row for at_ns, row in zip(truth["at_ns"], torques, strict=True) if since_ns < at_ns + zero_ns < until_ns]
    assert len(rows) > 50
    assert max(abs(torque) for row in rows for torque in row) < ZERO_NM
