"""The DBC of a torque bench, judged by cantools: it decodes what the transducer sends to what the driver reads."""

import cantools.database
import pytest

from torquerig.axes import axis_settings, group_settings
from torquerig.bench import open_bench, transducer_settings
from torquerig.cli import main
from torquerig.configuration import load_configuration
from torquerig.driver.master.group import AxisGroup
from torquerig.driver.master.transducer import Transducer


def text_of(capsys, *arguments):
    assert main(["dbc", *arguments]) == 0
    return capsys.readouterr().out


def test_the_transducer_is_there_when_a_bench_is_configured_or_asked_for(tmp_path, capsys):
    assert "Transducer" not in text_of(capsys)
    assert "Transducer10_TPDO1" in text_of(capsys, "--bench")
    (tmp_path / "my.toml").write_text("[bench]\nnode_id = 20\nsign = -1\n")
    assert "Transducer20_TPDO1" in text_of(capsys, "--config", str(tmp_path / "my.toml"))


@pytest.mark.parametrize("sign", [1, -1])
def test_every_frame_of_a_bench_is_decoded_and_torques_as_the_driver_has_them(tmp_path, capsys, sign):
    (tmp_path / "my.toml").write_text(f"[bench]\nsign = {sign}\noffset = 0.25\n")
    text = text_of(capsys, "--config", str(tmp_path / "my.toml"))
    database = cantools.database.load_string(text, "dbc", strict=True)
    configuration = load_configuration(tmp_path / "my.toml")
    frames = []
    with (
        open_bench(configuration, lambda _at_ns, frame: frames.append(frame)) as rig,
        AxisGroup(rig.bus, axis_settings(configuration), group_settings(configuration.rig)) as group,
    ):
        transducer = Transducer(group.session, transducer_settings(configuration.rig))
        transducer.open()
        group.wait(0.1)
        read = [reading.torque for reading in transducer.take()]
        transducer.close()
    names = [database.get_message_by_frame_id(frame.can_id).name for frame in frames]
    assert {"Transducer10_TPDO1", "Transducer10_SDO_request", "Transducer10_heartbeat"} <= set(names)
    shown = [
        database.decode_message(frame.can_id, frame.data)
        for frame, name in zip(frames, names, strict=True)
        if name == "Transducer10_TPDO1"
    ]
    torques = [each["AI_input_PV_1"] for each in shown]
    assert torques[: len(read)] == pytest.approx(read)
    assert sum(torques) / len(torques) == pytest.approx(sign * 0.25, abs=1e-3)
