"""Simulator and controller as processes of their own, with drives on two unix buses.

Both sides have patience, so that a shared machine's stalls do not decide.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import can
import pytest

PATIENCE_S = 120.0
LOCKSTEP_MM = 0.856  # `torquerig run` with axes.3.bus = "lockstep:b"
TWO = """
[bus]
url = "unix:{folder}/right"
patience = 5.0

[axes.3]
bus = "unix:{folder}/left"

[loop]
spin = 0.0
"""


def torquerig(*arguments: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "torquerig", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@contextmanager
def simulator(configuration: Path, record: Path) -> Iterator[str]:
    """A running simulator and what it said; it ends cleanly on SIGTERM."""
    process = torquerig("sim", "--config", configuration, "--record", record)
    try:
        assert process.stdout is not None
        yield process.stdout.readline()
    finally:
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, errors) == (0, "")


def test_a_run_over_two_buses_errs_as_in_lockstep(tmp_path):
    two = tmp_path / "two.toml"
    two.write_text(TWO.format(folder=tmp_path), encoding="utf-8")
    buses = f"unix:{tmp_path}/right and unix:{tmp_path}/left"
    with simulator(two, tmp_path / "truth") as said:
        assert said.startswith(f"simulated drives 1, 2, 3 on {buses}, plant")
        controller = torquerig("run", "--config", two, "--json")
        output, errors = controller.communicate(timeout=PATIENCE_S)
    assert (controller.returncode, errors) == (0, "")
    summary = json.loads(output)
    assert summary["bus"] == buses
    assert summary["position_rmse_mm"] == pytest.approx(LOCKSTEP_MM, rel=0.2)
    assert set(summary["bus_loads"]) == {"right", "left"}
    heard: Counter[tuple[str, int]] = Counter()
    with can.LogReader(tmp_path / "truth" / "bus.log") as reader:
        for message in reader:
            heard[message.channel, message.arbitration_id] += 1
    assert heard["right", 0x080] == heard["left", 0x080] >= summary["cycles"]
    assert {("right", 0x181), ("right", 0x182), ("left", 0x183)} <= set(heard)
    assert {("right", 0x703), ("left", 0x701), ("left", 0x702)} <= set(heard)  # passed on to the siblings
    assert ("right", 0x183) not in heard
