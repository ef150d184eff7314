"""Two procedures over the kernel's CAN, simulator and procedure as processes of their own."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

pytestmark = pytest.mark.vcan
PATIENCE_S = 240.0
# a shared machine may stand still for longer than a watchdog waits, and spinning starves a peer on the same processor
PATIENT = "[bus]\npatience = 5.0\n[loop]\nspin = 0.0\n"
SLOW = "rate_hz = 50.0\ncommand_after = 'computed'\n"  # a locked rotor does not need more
BUS = "socketcan:vcan1"


def torquerig(*arguments: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "torquerig", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@contextmanager
def simulator(configuration: Path, *arguments: object) -> Iterator[None]:
    process = torquerig("sim", "--bus", BUS, "--config", configuration, *arguments)
    try:
        assert process.stdout is not None
        assert process.stdout.readline().startswith("simulated drives 1, 2, 3")
        yield
    finally:
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=PATIENCE_S)


def configuration(folder: Path, text: str) -> Path:
    file = folder / "rig.toml"
    file.write_text(text, encoding="utf-8")
    return file


def calibrate(name: str, configuration: Path, place: Path, *arguments: object) -> dict:
    """Carry a procedure out, and return what it prints."""
    settings = ("--bus", BUS, "--config", configuration, "--out", place, "--yes", "--json")
    process = torquerig("calibrate", name, *settings, *arguments)
    output, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, errors
    return json.loads(output)


def test_home_closes_the_redundant_leg(tmp_path):
    rig = configuration(tmp_path, PATIENT)
    with simulator(rig):
        result = calibrate("home", rig, tmp_path / "out")
    assert result["verdict"] == "ok"
    assert result["truth"] == {}


def test_the_torque_scale_is_recovered(tmp_path):
    rig = configuration(tmp_path, PATIENT + SLOW)
    with simulator(rig, "--bench", "2"):
        result = calibrate("torque", rig, tmp_path / "out", "--axis", "2")
    (axis,) = result["axes"]
    assert axis["positive"]["counts_per_nm"] == pytest.approx(20670, rel=0.005)
    assert axis["negative"]["counts_per_nm"] == pytest.approx(19528, rel=0.005)
    written = tomllib.loads((tmp_path / "out" / "calibration.toml").read_text(encoding="utf-8"))
    assert written["axes"]["2"]["counts_per_nm_positive"] == pytest.approx(20100, abs=50)
