"""How a rig's process ends: with its rig, with its parent, by accident."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import can
import pytest

from torquerig import SimulatedRig
from torquerig.errors import RigError
from torquerig.rig_process import RigProcess

PARENT = """
import signal, time
from torquerig import SimulatedRig
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs are begun with it ignored
with SimulatedRig() as rig:
    print(rig.channel, flush=True)
    {then}
"""


def start_parent(then: str) -> tuple[subprocess.Popen[str], Path]:
    """Start a script that has a rig; returns it and the folder of the rig's bus."""
    parent = subprocess.Popen(
        [sys.executable, "-c", PARENT.format(then=then)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert parent.stdout is not None
    return parent, Path(parent.stdout.readline().strip())


def child_of(process_id: int) -> int:
    """The only child of a process."""
    (child,) = Path(f"/proc/{process_id}/task/{process_id}/children").read_text(encoding="ascii").split()
    return int(child)


def host_of(rig: SimulatedRig) -> int:
    """The process of a rig, by its name in the folder of the bus."""
    (member,) = Path(rig.channel).glob("member-*")
    return int(member.name.split("-")[1])


def lives(process_id: int) -> bool:
    """Whether a process runs; one that has ended and that nobody has waited for does not."""
    try:
        return Path(f"/proc/{process_id}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_when_its_parent_is_killed_the_process_and_its_folder_are_gone(await_true):
    parent, folder = start_parent("time.sleep(600)")
    host = child_of(parent.pid)
    with can.Bus(interface="unix", channel=str(folder)) as listener:
        assert listener.recv(20.0) is not None
        parent.kill()
        parent.communicate()
        await_true(lambda: not lives(host), "the process ended")
        while listener.recv(0.0) is not None:
            pass
        assert listener.recv(0.2) is None
    assert not folder.parent.exists()


def test_ctrl_c_reaches_the_script_alone_and_ends_both(await_true):
    parent, folder = start_parent("time.sleep(600)")
    host = child_of(parent.pid)
    assert os.getpgid(host) != os.getpgid(parent.pid)
    parent.send_signal(signal.SIGINT)
    _, errors = parent.communicate(timeout=60.0)
    assert errors.rstrip().endswith("KeyboardInterrupt")
    assert not lives(host)
    await_true(lambda: not folder.parent.exists(), "the folder is gone")


def test_a_script_that_ends_without_leaving_the_rig_leaves_nothing_behind(await_true):
    parent, folder = start_parent("__import__('os')._exit(3)")
    parent.communicate(timeout=60.0)
    assert parent.returncode == 3
    await_true(lambda: not folder.parent.exists(), "the folder is gone")


def test_a_process_that_was_killed_is_named_with_its_signal(monkeypatch, tmp_path):
    monkeypatch.setenv("TMPDIR", str(tmp_path))  # nobody is left to remove the folder of its bus
    rig = SimulatedRig()
    with pytest.raises(RigError, match=r"^the process of the simulated drives ended \(killed by SIGKILL\)$"), rig:
        os.kill(host_of(rig), signal.SIGKILL)
    with pytest.raises(RigError, match="not running"):
        rig.power_cycle()


def test_a_process_that_was_killed_is_replaced_for_the_next_rig(monkeypatch, tmp_path):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    process = RigProcess()
    with pytest.raises(RigError, match="SIGKILL"), SimulatedRig(process=process) as rig:
        os.kill(host_of(rig), signal.SIGKILL)
    with SimulatedRig(process=process) as rig:
        assert rig.node_ids == (1, 2, 3)
    process.close()


def test_a_process_that_cannot_start_leaves_its_last_words(monkeypatch):
    monkeypatch.setattr("torquerig.rig_process.MODULE", "torquerig.no_such_module")
    with pytest.raises(RigError, match=r"ended \(exit status 1\): .*No module named torquerig\.no_such_module$"):
        SimulatedRig().__enter__()


def test_a_process_that_does_not_answer_is_ended(monkeypatch, tmp_path):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("torquerig.rig_process.ANSWER_LIMIT_S", 0.3)
    monkeypatch.setattr("torquerig.rig_process.ENDING_LIMIT_S", 0.3)
    rig = SimulatedRig()
    rig.__enter__()
    host = host_of(rig)
    os.kill(host, signal.SIGSTOP)
    with pytest.raises(RigError, match=r"did not answer within 0\.3 s, and were ended$"):
        rig.power_cycle()
    assert not lives(host)
    with pytest.raises(RigError, match="not running"):
        rig.__exit__(None, None, None)
