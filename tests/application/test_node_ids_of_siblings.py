"""Node-ids that the drives' own objects have no room for are refused before a bus is opened."""

import pytest

from torquerig.cli import main

UNHEARD = "axes.3.node_id = 9 cannot be: the drive of axis 1 hears emergencies of node-ids 1 to 8 only"


@pytest.mark.parametrize(
    "command", [["run"], ["calibrate", "latency"], ["jog", "--x", "1"], ["hold", "--seconds", "1"]]
)
def test_a_node_id_beyond_object_1028_is_one_sentence(tmp_path, capsys, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my.toml").write_text("[axes.3]\nnode_id = 9\n")
    assert main([*command, "--config", "my.toml", "--bus", "unix:/nowhere/at/all"]) == 2
    printed = capsys.readouterr().err
    assert UNHEARD in printed
    assert printed.count("\n") == 1


def test_node_ids_up_to_8_run(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    nodes = "".join(f"[axes.{leg}]\nnode_id = {node}\n" for leg, node in enumerate((8, 2, 5), 1))
    (tmp_path / "my.toml").write_text(nodes)
    assert main(["hold", "--seconds", "0.1", "--json", "--config", "my.toml"]) == 0
    capsys.readouterr()
