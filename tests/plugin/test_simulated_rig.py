"""Simulated drives in a process of their own, as a user's script has them."""

from __future__ import annotations

import json
import time
from pathlib import Path

import can
import numpy as np
import pyarrow.parquet as pq
import pytest

from torquerig import SimulatedRig
from torquerig.errors import RigError

ENABLED, FAULT = 0x27, 0x08


def test_the_drives_have_booted_and_answer(rig, master):
    assert rig.node_ids == (1, 2, 3)
    assert [master.read(node_id, 0x1000) for node_id in rig.node_ids] == [0x00020192] * 3


def test_the_bus_is_one_that_python_can_opens_by_interface_and_channel(rig):
    assert rig.url == f"{rig.interface}:{rig.channel}"
    with can.Bus(interface=rig.interface, channel=rig.channel) as bus:
        assert bus.recv(20.0) is not None


def test_a_torque_moves_the_machine_and_the_truth_knows_it_afterwards(process, master_of, await_true):
    with SimulatedRig(plant="ideal", process=process) as rig:
        master = master_of(rig)
        master.enable(1, torque=4000)
        await_true(lambda: 200 <= master.read(1, 0x6064) < 2**32 - 200, "the encoder has counted, either way")
        master.push(1, 0, controlword=0)
        assert master.read(1, 0x6041) & 0x6F != ENABLED
    truth = rig.truth()
    assert truth.motor_torque[:, 0].max() == pytest.approx(4000 / 20670, rel=1e-3)
    assert np.all(truth.motor_torque[:, 1:] == 0.0)
    assert np.linalg.norm(truth.position[-1] - truth.position[0]) > 1e-4
    assert np.all(np.diff(truth.at_ns) > 0)


def test_truth_stands_on_the_monotonic_clock(rig):
    truth = rig.truth()
    now_ns = time.monotonic_ns()
    assert 0 <= now_ns - (rig.time_zero_ns + truth.at_ns[-1]) < 20 * 10**9
    np.testing.assert_allclose(truth.position[0], [0.092, 0.062])


def test_a_power_cycle_boots_the_drive_and_forgets_what_was_not_stored(rig, master):
    master.write(2, 0x1017, 70, size=2)
    master.write(3, 0x1017, 70, size=2)
    rig.power_cycle(2)
    master.hear(0x702, b"\x00")
    assert [master.read(node_id, 0x1017) for node_id in (2, 3)] == [50, 70]


def test_a_power_cycle_without_a_node_id_is_one_of_all(rig, master):
    assert rig.bus is master.bus
    rig.power_cycle()
    heard = set()
    while heard != {0x701, 0x702, 0x703}:
        message = master.bus.recv(20.0)
        assert message is not None
        if message.data == b"\x00":
            heard.add(message.arbitration_id)


def test_an_injected_fault_is_told_and_lasts_until_it_is_cleared(rig, master):
    rig.inject(2, "undervoltage")
    assert master.hear(0x082)[:2] == b"\x20\x32"
    for lasts in (True, False):
        if not lasts:
            rig.inject(2, "clear")
        for controlword in (0x00, 0x80):
            master.write(2, 0x6040, controlword, size=2)
        assert bool(master.read(2, 0x6041) & FAULT) is lasts


def test_frozen_drives_say_nothing_and_no_time_passes_for_them(rig, master):
    with rig.frozen():
        before, zero_ns = rig.truth().at_ns[-1], rig.time_zero_ns
        while rig.bus.recv(0.0) is not None:
            pass
        assert rig.bus.recv(0.2) is None
        assert rig.truth().at_ns[-1] == before
    assert rig.time_zero_ns - zero_ns >= 200_000_000
    master.hear(0x701)


def test_what_comes_while_the_drives_are_frozen_is_heard_when_they_go_on(rig, master):
    with rig.frozen():
        master.send(0x601, bytes.fromhex("4000100000000000"))
        time.sleep(0.1)
    assert master.hear(0x581) == bytes.fromhex("4300100092010200")


def test_the_record_is_complete_when_the_rig_has_ended(process, tmp_path):
    with SimulatedRig(record=tmp_path / "record", options={"drive.boot": 0.5}, process=process):
        pass
    facts = json.loads((tmp_path / "record" / "run.json").read_text(encoding="utf-8"))
    assert facts["configuration"]["drive"]["boot"] == 0.5
    assert pq.read_table(tmp_path / "record" / "truth.parquet").num_rows > 0
    with can.LogReader(tmp_path / "record" / "bus.log") as reader:
        assert [message.arbitration_id for message in reader][:3] == [0x701, 0x702, 0x703]


def test_a_file_of_the_configuration_holds(process, tmp_path):
    (tmp_path / "my.toml").write_text("[axes.3]\nnode_id = 9\n", encoding="utf-8")
    with SimulatedRig(config=tmp_path / "my.toml", process=process) as rig:
        assert rig.node_ids == (1, 2, 9)


def test_two_rigs_at_once_do_not_hear_each_other(rig, master, master_of):
    with SimulatedRig() as other:
        assert other.channel != rig.channel
        master.write(1, 0x1017, 70, size=2)
        assert master_of(other).read(1, 0x1017) == 50
        other.power_cycle(1)
        master_of(other).hear(0x701, b"\x00")
        master.send(0x601, bytes.fromhex("4000100000000000"))
        heard = []
        while not heard or heard[-1].arbitration_id != 0x581:
            message = master.bus.recv(20.0)
            assert message is not None
            heard.append(message)
        assert b"\x00" not in [bytes(message.data) for message in heard]


def test_a_rig_that_is_left_by_an_exception_is_gone_and_the_exception_is_not(process):
    rig = SimulatedRig(process=process)
    folders = []

    def fail() -> None:
        with rig:
            folders.append(Path(rig.channel))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert not folders[0].exists()
    assert len(rig.truth().at_ns) > 0


def test_a_rig_may_be_used_again_and_is_a_new_one(process, master_of):
    rig = SimulatedRig(process=process)
    with rig:
        master_of(rig).write(1, 0x1017, 70, size=2)
    with rig:
        assert master_of(rig).read(1, 0x1017) == 50


def test_before_its_with_a_rig_says_so():
    rig = SimulatedRig()
    for use in (lambda: rig.url, lambda: rig.bus, rig.power_cycle, rig.truth):
        with pytest.raises(RigError, match=r"^this rig (is not running|has not run)"):
            use()


def test_after_its_with_a_rig_knows_what_was_but_has_no_drives(process):
    with SimulatedRig(process=process) as rig:
        zero_ns = rig.time_zero_ns
    assert rig.time_zero_ns == zero_ns
    for use in (lambda: rig.bus, rig.power_cycle):
        with pytest.raises(RigError, match=r"^this rig is not running"):
            use()


def test_a_folder_is_meant_where_the_rig_is_made(process, tmp_path, monkeypatch):
    with SimulatedRig(process=process):
        pass
    monkeypatch.chdir(tmp_path)
    with SimulatedRig("unix:here", process=process) as rig:
        assert rig.channel == str(tmp_path / "here")
