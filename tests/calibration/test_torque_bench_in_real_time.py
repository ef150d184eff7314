"""`torquerig sim --bench`: the bench in real time, on a bus between processes."""

import subprocess
import sys

import can

PATIENCE_S = 30.0  # real time on a shared machine: order and content are asserted, never speed


def test_the_bench_joins_a_bus_with_its_transducer_and_leaves_a_record(tmp_path):
    folder, record = tmp_path / "bus", tmp_path / "record"
    command = [sys.executable, "-m", "torquerig", "sim", "--bench", "2"]
    command += ["--bus", f"unix:{folder}", "--record", str(record)]
    with can.Bus(interface="unix", channel=str(folder)) as bus:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            missing = {0x701, 0x702, 0x703, 0x70A}  # boot-up messages of the drives and of node 10
            while missing:
                message = bus.recv(PATIENCE_S)
                assert message is not None, process.poll()
                if message.data == b"\0":
                    missing.discard(message.arbitration_id)
        finally:
            process.terminate()
            output, errors = process.communicate(timeout=PATIENCE_S)
    assert "axis 2 locked against the torque transducer, node 10" in output
    assert "Traceback" not in errors
    assert {path.name for path in record.iterdir()} >= {"run.json", "bus.log"}
