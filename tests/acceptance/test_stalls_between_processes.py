"""Simulator and controller, two processes that the machine stops now and then: with patience the motion is the same."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from torquerig import load_configuration, run_experiment
from torquerig.driver import open_bus

LIMIT_S = 240.0
STALL_S = 0.3
STALLS = 6
PATIENT = "[bus]\npatience = 5.0\n[loop]\nspin = 0.0\nrepeat = 3\n"


def torquerig(*arguments: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "torquerig", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.fixture
def settings(tmp_path) -> tuple[object, ...]:
    file = tmp_path / "rig.toml"
    file.write_text(PATIENT, encoding="utf-8")
    return ("--bus", f"unix:{tmp_path / 'bus'}", "--config", file)


@pytest.fixture
def simulator(settings) -> Iterator[subprocess.Popen[str]]:
    process = torquerig("sim", *settings)
    assert process.stdout is not None
    assert process.stdout.readline().startswith("simulated drives 1, 2, 3")
    yield process
    process.kill()
    process.communicate()


def stall(process: subprocess.Popen[str]) -> None:
    process.send_signal(signal.SIGSTOP)
    time.sleep(STALL_S)
    process.send_signal(signal.SIGCONT)


def test_stalls_of_either_process_leave_the_errors_what_they_are_in_lockstep(settings, simulator, tmp_path):
    record = tmp_path / "record"
    with torquerig("run", *settings, "--json", "--record", record) as controller:
        bus = tmp_path / "bus"
        wait_for_sync(bus)
        for number in range(STALLS):
            stall((simulator, controller)[number % 2])
            time.sleep(0.05)
        output, errors = controller.communicate(timeout=LIMIT_S)
    assert controller.returncode == 0, errors
    facts = json.loads((record / "run.json").read_text(encoding="utf-8"))
    lockstep = run_experiment(load_configuration(options={"loop.repeat": 3})).summary
    assert json.loads(output)["position_rmse_mm"] == pytest.approx(lockstep.position_rmse_mm, rel=0.2)
    assert facts["counters"]["patience"]["stood_still_ns"] > 2 * STALL_S * 1e9


def wait_for_sync(folder: Path) -> None:
    bus = open_bus(f"unix:{folder}", bitrate=1_000_000, spin_ns=0)
    try:
        until_ns = bus.now_ns() + int(LIMIT_S * 1e9)
        while (arrival := bus.receive(until_ns)) is not None and arrival.frame.can_id != 0x080:
            pass
    finally:
        bus.close()
