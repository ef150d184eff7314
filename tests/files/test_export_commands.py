"""`torquerig dbc` and `torquerig pcap` as a person types them."""

import pytest

from torquerig.axes import axis_settings
from torquerig.cli import main
from torquerig.configuration import load_configuration
from torquerig.exports.dbc import dbc_text
from torquerig.exports.drives import rig_messages
from torquerig.record import BUS_FILE


@pytest.fixture
def log(tmp_path):
    log = tmp_path / BUS_FILE
    log.write_text("(0000000000.000065) lockstep 701#00\n(0000000000.004055) lockstep 080#\n", "ascii")
    return log


def test_dbc_goes_to_standard_output_or_into_a_file(tmp_path, capsys):
    expected = dbc_text(rig_messages(axis_settings(load_configuration()), 127))
    assert main(["dbc"]) == 0
    assert capsys.readouterr().out == expected
    assert main(["dbc", "--output", str(tmp_path / "rig.dbc")]) == 0
    assert (tmp_path / "rig.dbc").read_text("ascii") == expected


def test_dbc_follows_the_configuration(tmp_path, capsys):
    config = tmp_path / "rig.toml"
    config.write_text("[master]\nnode_id = 100\n[axes.2]\nnode_id = 20\nsign = -1\n", "utf-8")
    assert main(["dbc", "--config", str(config), "--pdos", "eds"]) == 0
    text = capsys.readouterr().out
    assert "BU_: Master Drive1 Drive20 Drive3\n" in text
    assert f"BO_ {0x700 + 100} Master_heartbeat: 1 Master\n" in text
    assert "BO_ 404 Drive20_TPDO1: 8 Drive20\n" in text
    assert "Position_actual_value : 16|32@1- (-3.141592653589793e-05,0)" in text


@pytest.mark.parametrize("named", ["the folder", "the log"])
def test_pcap_lies_beside_the_log(tmp_path, log, capsys, named):
    assert main(["pcap", str(tmp_path if named == "the folder" else log)]) == 0
    assert capsys.readouterr().out == f"2 frames: {tmp_path / 'bus.pcap'}\n"
    assert (tmp_path / "bus.pcap").stat().st_size == 24 + 16 + 9 + 16 + 8


def test_pcap_can_be_piped(tmp_path, log, capsysbinary):
    assert main(["pcap", str(log), "--output", str(tmp_path / "other.pcap")]) == 0
    capsysbinary.readouterr()
    assert main(["pcap", str(log), "--output", "-"]) == 0
    assert capsysbinary.readouterr().out == (tmp_path / "other.pcap").read_bytes()


def test_a_bad_log_leaves_an_older_pcap_alone(tmp_path, log, capsys):
    (tmp_path / "bus.pcap").write_bytes(b"older")
    log.write_text("(0000000000.000065) lockstep 701#00\nnonsense\n", "ascii")
    assert main(["pcap", str(tmp_path)]) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"torquerig: {log}:2: 'nonsense' is no classic CAN frame")
    assert told.count("\n") == 1
    assert {path.name for path in tmp_path.iterdir()} == {"bus.log", "bus.pcap"}
    assert (tmp_path / "bus.pcap").read_bytes() == b"older"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["pcap", "{}/nowhere"], "the log {}/nowhere cannot be read: No such file or directory"),
        (["pcap", "{}", "--output", "{}/no/x.pcap"], "{}/no/x.pcap cannot be written: No such file or directory"),
        (["dbc", "--output", "{}/no/rig.dbc"], "{}/no/rig.dbc cannot be written: No such file or directory"),
        (["dbc", "--config", "{}/no.toml"], "cannot read the configuration {}/no.toml: No such file or directory"),
        (["dbc", "--pdos", "mine"], "'mine' is not one of 'driver', 'eds'"),
    ],
)
@pytest.mark.usefixtures("log")
def test_what_cannot_be_done_is_told_in_one_sentence(tmp_path, capsys, arguments, words):
    assert main([word.format(tmp_path) for word in arguments]) == 2
    told = capsys.readouterr().err
    assert words.format(tmp_path) in told
    assert told.count("\n") == 1
