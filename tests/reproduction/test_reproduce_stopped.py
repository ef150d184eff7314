"""A reproduction that is stopped, or cannot write: one sentence, and no empty folders."""

import pytest

from torquerig.cli import main
from torquerig.reproduction import experiments
from torquerig.stopping import Stopped

FULL = OSError(28, "No space left on device")


@pytest.fixture
def run_ends(monkeypatch):
    """Lets the runs end with errors, each with its folder begun, the first `kept` with something in it."""

    def use(error, kept=0):
        begun = []

        def run(_configuration, *, record, watcher):
            del watcher
            if record is not None:
                record.mkdir(parents=True)
            begun.append(record)
            if len(begun) <= kept:
                (record / "run.json").write_text("{}")
                raise experiments.MechanismError("out of reach")
            raise error

        monkeypatch.setattr(experiments, "run_experiment", run)

    return use


def test_stopped_before_the_first_record_nothing_is_left(run_ends, tmp_path, capsys):
    run_ends(Stopped(2))
    assert main(["reproduce", "--out", str(tmp_path / "out")]) == 130
    assert not (tmp_path / "out").exists()
    assert "stopped by SIGINT" in capsys.readouterr().err


def test_stopped_later_what_is_left_is_told_and_the_next_says_what_to_do(run_ends, tmp_path, capsys):
    run_ends(Stopped(2), kept=2)
    place = tmp_path / "out"
    assert main(["reproduce", "--out", str(place)]) == 130
    assert f"{place} keeps 2 records and no report" in capsys.readouterr().err
    assert len(list((place / "records").iterdir())) == 2
    assert main(["reproduce", "--out", str(place)]) == 2
    assert "remove it, or name another folder" in capsys.readouterr().err


def test_a_full_disk_is_one_sentence(run_ends, tmp_path, capsys):
    run_ends(FULL)
    assert main(["reproduce", "--plant", "fitted", "--out", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err.splitlines()[-1]
    assert told.startswith("torquerig: cannot write the record")
    assert told.endswith("No space left on device")
    assert not (tmp_path / "out").exists()


def test_a_stop_without_a_folder_is_told_as_such(run_ends, capsys):
    run_ends(Stopped(15))
    assert main(["reproduce", "--json"]) == 143
    assert "stopped by SIGTERM" in capsys.readouterr().err
