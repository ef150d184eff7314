"""The closed loop through the adapter, in two processes: serial port, python-can's interface, driver, law."""

import json
import subprocess
import sys
from pathlib import Path

RATE = 100.0  # real time on a shared machine, and python-can's interface reads its port byte by byte
LIMIT_S = 120
PATIENT = "[bus]\npatience = 5.0\n"  # a shared machine may stand still for longer than a watchdog waits


def test_the_loop_runs_through_the_adapter_to_its_end(link: Path, tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(f"{PATIENT}[loop]\nrate_hz = {RATE}\n", encoding="utf-8")
    simulator = [sys.executable, "-m", "torquerig", "sim", "--slcan", str(link), "--config", str(rig)]
    run = [sys.executable, "-m", "torquerig", "run", "--bus", f"slcan:{link}", "--config", str(rig), "--json"]
    with subprocess.Popen(simulator, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            assert process.stdout.readline().startswith(
                f"simulated drives 1, 2, 3 on the serial port {link}, which is "
            )
            done = subprocess.run(run, capture_output=True, text=True, timeout=LIMIT_S, check=False)
            assert done.returncode == 0, done.stderr
            summary = json.loads(done.stdout)
            assert summary["cycles"] > RATE * 0.1
            assert 0 < summary["position_rmse_mm"] < 20  # the limit at which the loop would have stopped
        finally:
            process.terminate()
    assert not link.is_symlink()
