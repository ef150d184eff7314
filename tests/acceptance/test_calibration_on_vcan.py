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

from torquerig.driver.master.profile import PROFILES

pytestmark = pytest.mark.vcan
PATIENCE_S = 240.0
TRIES = 5  # a shared machine may stand still for longer than a watchdog waits
NO_SPIN = "[loop]\nspin = 0.0\n"  # spinning starves a peer that shares the processor
SLOW = NO_SPIN + "rate_hz = 50.0\ncommand_after = 'computed'\n[master]\nwatchdog_periods = 25\nheartbeat_limit = 2.0\n"
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


def patient(folder: Path) -> str:
    """A rig at full rate whose drives wait for 0.2 s: what is tested here is not how punctual a shared machine is."""
    shipped = (PROFILES / "torquerig.toml").read_text(encoding="utf-8")
    few = 'object = "2120:1", value = 3'
    assert few in shipped
    profile = folder / "patient.toml"
    profile.write_text(shipped.replace(few, 'object = "2120:1", value = 50'), encoding="utf-8")
    axes = "".join(f"[axes.{leg}]\nprofile = {str(profile)!r}\n" for leg in (1, 2, 3))
    return f"{NO_SPIN}[master]\nwatchdog_periods = 50\nheartbeat_limit = 2.0\n{axes}"


def configuration(folder: Path, text: str) -> Path:
    file = folder / "rig.toml"
    file.write_text(text, encoding="utf-8")
    return file


def calibrate(name: str, configuration: Path, place: Path, *arguments: object) -> dict:
    """Carry a procedure out, again if the machine did not leave it in peace."""
    settings = ("--bus", BUS, "--config", configuration, "--out", place, "--yes", "--json")
    for _ in range(TRIES):
        process = torquerig("calibrate", name, *settings, *arguments)
        output, errors = process.communicate(timeout=PATIENCE_S)
        if process.returncode == 0:
            return json.loads(output)
    return pytest.fail(f"calibrate {name} was stopped {TRIES} times; the last: {errors}")


def test_home_closes_the_redundant_leg(tmp_path):
    rig = configuration(tmp_path, patient(tmp_path))
    with simulator(rig):
        result = calibrate("home", rig, tmp_path / "out")
    assert result["verdict"] == "ok"
    assert result["truth"] == {}


def test_the_torque_scale_is_recovered(tmp_path):
    rig = configuration(tmp_path, SLOW)  # half a minute without a stall of 12 ms is more than a shared machine grants
    with simulator(rig, "--bench", "2"):
        result = calibrate("torque", rig, tmp_path / "out", "--axis", "2")
    (axis,) = result["axes"]
    assert axis["positive"]["counts_per_nm"] == pytest.approx(20670, rel=0.005)
    assert axis["negative"]["counts_per_nm"] == pytest.approx(19528, rel=0.005)
    written = tomllib.loads((tmp_path / "out" / "calibration.toml").read_text(encoding="utf-8"))
    assert written["axes"]["2"]["counts_per_nm_positive"] == pytest.approx(20100, abs=50)
