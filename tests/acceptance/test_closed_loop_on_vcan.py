"""The closed loop over the kernel's CAN: simulator and controller as two processes on vcan0, can-utils as witness.

Both sides have patience, so that a shared machine's stalls do not decide: content is asserted, and the errors to 20 %
of lockstep's.
"""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from torquerig import load_configuration, run_experiment

pytestmark = pytest.mark.vcan
PATIENCE_S = 120.0
LAWS = ("decoupled-pd", "coupled-pd", "augmented-pd", "computed-torque")
PATIENT = "[bus]\npatience = 5.0\n[loop]\nspin = 0.0\n"  # spinning starves a peer that shares the processor
AHEAD = ("chrt", "--fifo", "20")  # of run and sim, or frames are lost to those who look on


def torquerig(*arguments: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "torquerig", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.fixture(scope="module")
def configuration(tmp_path_factory) -> Iterator[Path]:
    """A running simulator on vcan0, and the configuration that it has."""
    file = tmp_path_factory.mktemp("vcan") / "rig.toml"
    file.write_text(PATIENT, encoding="utf-8")
    simulator = torquerig("sim", "--bus", "socketcan:vcan0", "--config", file)
    assert simulator.stdout is not None
    assert simulator.stdout.readline().startswith("simulated drives 1, 2, 3 on socketcan:vcan0")
    yield file
    simulator.send_signal(signal.SIGTERM)
    _, errors = simulator.communicate(timeout=PATIENCE_S)
    assert (simulator.returncode, errors) == (0, "")


def run(configuration: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    process = torquerig("run", "--bus", "socketcan:vcan0", "--config", configuration, "--json", *arguments)
    output, errors = process.communicate(timeout=PATIENCE_S)
    return subprocess.CompletedProcess(process.args, process.returncode, output, errors)


@pytest.mark.parametrize("law", LAWS)
def test_each_law_errs_on_vcan_as_in_lockstep(configuration, law):
    lockstep = run_experiment(load_configuration(options={"loop.law": law})).summary
    done = run(configuration, "--law", law)
    assert done.returncode == 0, done.stderr
    on_vcan = json.loads(done.stdout)
    assert on_vcan["position_rmse_mm"] == pytest.approx(lockstep.position_rmse_mm, rel=0.2)
    assert on_vcan["true_position_rmse_mm"] is None


@pytest.fixture
def witnesses(tmp_path) -> Iterator[Callable[[], tuple[str, str]]]:
    """candump and canbusload on vcan0, ahead of what they watch; calling it ends them and gives what they wrote."""
    dump_file = tmp_path / "dump.log"
    with dump_file.open("w", encoding="utf-8") as dump:
        candump = subprocess.Popen([*AHEAD, "candump", "-L", "-r", "1000000", "vcan0"], stdout=dump)
        canbusload = subprocess.Popen([*AHEAD, "canbusload", "vcan0@1000000"], stdout=subprocess.PIPE, text=True)

        def end() -> tuple[str, str]:
            time.sleep(2.0)  # candump leaves unread what is in its socket when it is stopped
            for process in (candump, canbusload):
                process.send_signal(signal.SIGINT)
            load, _ = canbusload.communicate(timeout=PATIENCE_S)
            candump.wait(PATIENCE_S)
            return dump_file.read_text(encoding="utf-8"), load

        yield end
        for process in (candump, canbusload):
            process.kill()
            process.wait(PATIENCE_S)


def frames(log: str) -> list[str]:
    return [line.split()[2] for line in log.splitlines()]


def test_candump_and_canbusload_see_what_the_run_says(configuration, tmp_path, witnesses):
    record = tmp_path / "record"
    done = run(configuration, "--repeat", "5", "--record", record)
    assert done.returncode == 0, done.stderr
    dump, load = witnesses()
    said = [frame for frame in frames((record / "bus.log").read_text(encoding="utf-8")) if frame.startswith("20")]
    seen = [frame for frame in frames(dump) if frame.startswith("20")]
    assert len(said) >= 3 * json.loads(done.stdout)["cycles"]
    assert seen[-len(said) :] == said
    assert 5 < max(int(percent) for percent in re.findall(r"(\d+)%", load)) < 40


def test_cansend_of_a_foreign_sync_is_a_second_master(configuration):
    """A foreign SYNC before the start: the run refuses, in one sentence."""
    chatter = subprocess.Popen(["sh", "-c", "while cansend vcan0 080#; do sleep 0.01; done"])
    try:
        refused = run(configuration)
    finally:
        chatter.kill()
        chatter.wait(PATIENCE_S)
    assert refused.returncode == 3
    assert refused.stderr.startswith("torquerig: another master speaks on the bus: ")
