"""Simulator and controller as processes of their own, as a user starts them, over the unix bus in real time.

What is asserted holds on a machine that is busy with other things: both sides have patience.
"""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import can
import pyarrow.parquet as pq
import pytest

PATIENCE_S = 60.0
PATIENT = "[bus]\npatience = 2.0\n"
EMERGENCIES = (0x081, 0x082, 0x083)


def torquerig(*arguments: object, **kwargs: object) -> subprocess.Popen[str]:
    """Start the program."""
    command = [sys.executable, "-m", "torquerig", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **kwargs)


def await_true(condition, what: str) -> None:
    """Wait until something is so."""
    give_up = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < give_up, f"waited in vain until {what}"
        time.sleep(0.02)


@pytest.fixture
def rig(tmp_path) -> Iterator[Path]:
    """A running simulator on unix:bus, recording into `truth`; it ends cleanly on SIGTERM."""
    file = tmp_path / "patient.toml"
    file.write_text(PATIENT, encoding="utf-8")
    simulator = torquerig("sim", "--bus", f"unix:{tmp_path}/bus", "--config", file, "--record", tmp_path / "truth")
    try:
        assert simulator.stdout is not None
        assert simulator.stdout.readline().startswith("simulated drives 1, 2, 3 on unix:")
        yield tmp_path
    finally:
        simulator.send_signal(signal.SIGTERM)
        _, errors = simulator.communicate(timeout=PATIENCE_S)
    assert (simulator.returncode, errors) == (0, "")


def run(rig: Path, *arguments: object) -> subprocess.Popen[str]:
    """Start the controller on the simulator's bus."""
    return torquerig("run", "--bus", f"unix:{rig}/bus", "--config", rig / "patient.toml", "--json", *arguments)


def await_enabled(bus: can.BusABC) -> None:
    """Wait until drive 1 is told to enable operation and to make torque: the loop runs."""
    give_up = time.monotonic() + PATIENCE_S
    while time.monotonic() < give_up:
        message = bus.recv(PATIENCE_S)
        assert message is not None
        if message.arbitration_id == 0x201 and message.data[0] == 0x0F and message.data[2:4] != b"\x00\x00":
            return
    raise AssertionError("waited in vain for a torque")


def test_a_run_over_a_real_time_bus_does_all_its_cycles(rig):
    output, errors = (controller := run(rig)).communicate(timeout=PATIENCE_S)
    assert (controller.returncode, errors) == (0, "")
    summary = json.loads(output)
    assert summary["bus"] == f"unix:{rig}/bus"
    assert 102 <= summary["cycles"] <= 110  # 25 + 51 + 25 + 1, and a few to approach by less than an encoder count
    assert summary["true_position_rmse_mm"] is None
    assert summary["plant"] is None


def test_a_killed_controller_leaves_drives_without_torque_and_the_next_run_works(rig):
    with can.Bus(interface="unix", channel=f"{rig}/bus") as listener:
        controller = run(rig, "--repeat", 1000)
        await_enabled(listener)
        controller.kill()
        controller.communicate(timeout=PATIENCE_S)
        heard: dict[int, bytes] = {}
        while set(heard) != set(EMERGENCIES):
            message = listener.recv(PATIENCE_S)
            assert message is not None
            if message.arbitration_id in EMERGENCIES:
                heard[message.arbitration_id] = bytes(message.data)
    assert {data[:2] for data in heard.values()} <= {b"\x50\x82", b"\x00\x87", b"\x30\x81", b"\x01\xff"}
    again = run(rig)
    output, errors = again.communicate(timeout=PATIENCE_S)
    assert (again.returncode, errors) == (0, "")
    assert json.loads(output)["cycles"] >= 102


def test_a_second_controller_is_refused_and_the_first_is_told(rig):
    with can.Bus(interface="unix", channel=f"{rig}/bus") as listener:
        first = run(rig, "--repeat", 1000)
        await_enabled(listener)
        second = run(rig)
        _, errors = second.communicate(timeout=PATIENCE_S)
        first.send_signal(signal.SIGTERM)
        first.communicate(timeout=PATIENCE_S)
    assert second.returncode == 3
    assert errors.startswith("torquerig: another master speaks on the bus: ")
    assert first.returncode == 143


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_a_run_in_order(tmp_path, number, code):
    controller = torquerig("run", "--repeat", 1000, "--record", tmp_path / "record", "--json")
    await_true((tmp_path / "record").exists, "the record's folder is there")
    time.sleep(1.0)
    controller.send_signal(number)
    output, errors = controller.communicate(timeout=PATIENCE_S)
    assert (controller.returncode, output, errors) == (code, "", f"torquerig: stopped by {number.name}\n")
    facts = json.loads((tmp_path / "record" / "run.json").read_text(encoding="utf-8"))
    assert facts["ended"] == f"stopped by {number.name}"
    if facts["summary"] is not None:
        assert pq.read_table(tmp_path / "record" / "cycles.parquet").num_rows == facts["summary"]["cycles"]


def test_the_simulators_record_holds_the_true_torques_and_every_frame(tmp_path):
    simulator = torquerig("sim", "--bus", f"unix:{tmp_path}/bus", "--record", tmp_path / "truth")
    assert simulator.stdout is not None
    simulator.stdout.readline()
    missing = {0x701, 0x702, 0x703}
    with can.Bus(interface="unix", channel=f"{tmp_path}/bus") as listener:
        while missing:  # boot-up messages, or heartbeats for who joined late
            message = listener.recv(PATIENCE_S)
            assert message is not None
            missing.discard(message.arbitration_id)
    simulator.send_signal(signal.SIGINT)
    output, errors = simulator.communicate(timeout=PATIENCE_S)
    assert (simulator.returncode, output, errors) == (0, f"Record: {tmp_path}/truth\n", "")
    truth = pq.read_table(tmp_path / "truth" / "truth.parquet")
    assert {"at_ns", "position_x", "velocity_y", "theta_3", "motor_torque_1"} <= set(truth.column_names)
    assert truth["position_x"].to_pylist()[0] == 0.092
    with can.LogReader(tmp_path / "truth" / "bus.log") as reader:
        assert {message.arbitration_id for message in reader} >= {0x701, 0x702, 0x703}
