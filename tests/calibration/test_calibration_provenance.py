"""calibration.toml knows on which drives each value was measured: others are neither mixed with it nor driven by it."""

import tomllib
from threading import Thread

import pytest

from torquerig.calibrated import read_calibration
from torquerig.calibrating.deposit import deposit
from torquerig.calibration.procedure import Estimate, Result, Verdict
from torquerig.configuration import load_configuration
from torquerig.driver.master.identity import Identity
from torquerig.errors import ConfigurationError, RecordError
from torquerig.experiment import run_experiment
from torquerig.provenance import Drives, drives_told, notes_on_loaded

MAKER = 0x29A  # any but 0, which is nobody's


def drives(*serials, vendor=MAKER, revision=1, simulated=False):
    return Drives(simulated, {leg: Identity(vendor, 7, revision, each) for leg, each in enumerate(serials, 1)})


REAL = drives(11, 12, 13)
OTHERS = drives(11, 22, 13)
SIMULATED = drives(1, 2, 3, vendor=0, simulated=True)
FACTS = {"date": "2026-11-22T05:00:00+00:00"}
LATER = {"date": "2026-11-23T05:00:00+00:00"}


def result(*estimates, **settings):
    named = {key.replace("__", "."): value for key, value in settings.items()}
    return Result(Verdict(), tuple(Estimate(name, 1.0, 0.9, 1.1, "1") for name in estimates), settings=named)


@pytest.fixture
def place(tmp_path):
    return tmp_path / "calibration.toml"


def test_what_a_drive_says_of_itself_is_read_back(place):
    deposit(place, "direction", result(axes__1__sign=-1), FACTS, found=REAL)
    assert drives_told(read_calibration(place).provenance["direction"]) == REAL
    silent = Drives(False, {1: Identity(MAKER, None, None, None)})
    deposit(place, "direction", result(axes__1__sign=-1), FACTS, found=silent, replace=True)
    assert drives_told(read_calibration(place).provenance["direction"]) == silent


@pytest.mark.parametrize(
    ("before", "now", "words"),
    [
        (SIMULATED, REAL, r"measured on simulated drives \(direction, 2026-11-22\), and here are real ones"),
        (REAL, SIMULATED, r"measured on real drives \(direction, 2026-11-22\), and here are simulated ones"),
        (REAL, OTHERS, r"axis 2 with a drive of serial number 12 \(.*\), and here it is one of serial number 22"),
        (REAL, drives(11, 12, 13, vendor=5), r"a drive of vendor 666 .*, and here it is one of vendor 5"),
    ],
)
def test_a_calibration_of_other_drives_is_not_mixed_with_this_one(place, before, now, words):
    deposit(place, "direction", result(axes__1__sign=-1), FACTS, found=before)
    old = place.read_bytes()
    with pytest.raises(ConfigurationError, match=words) as told:
        deposit(place, "zeros", result(axes__1__encoder_zero=0.1), LATER, found=now)
    assert "--replace starts a new calibration and keeps this one beside it" in str(told.value)
    assert place.read_bytes() == old
    written = deposit(place, "zeros", result(axes__1__encoder_zero=0.1), LATER, found=now, replace=True)
    assert written.kept.read_bytes() == old
    assert read_calibration(place).settings == {"axes.1.encoder_zero": 0.1}


@pytest.mark.parametrize("now", [drives(11, 12, 13, revision=2), drives(11, None, 13), None])
def test_new_firmware_and_untold_numbers_make_no_other_drive(place, now):
    deposit(place, "direction", result(axes__1__sign=-1), FACTS, found=REAL)
    deposit(place, "zeros", result(axes__1__encoder_zero=0.1), LATER, found=now)
    assert set(read_calibration(place).settings) == {"axes.1.sign", "axes.1.encoder_zero"}


def test_a_procedure_on_one_axis_keeps_what_it_found_of_another_with_its_provenance(place):
    first = result("axis 1", axes__1__counts_per_nm_positive=1.0, axes__2__counts_per_nm_positive=2.0)
    deposit(place, "torque", first, FACTS | {"command": "all"}, found=REAL)
    again = result("axis 2", axes__2__counts_per_nm_positive=2.5)
    deposit(place, "torque", again, LATER | {"command": "one"}, found=REAL)
    calibration = read_calibration(place)
    assert calibration.provenance["torque"]["set"] == ["axes.2.counts_per_nm_positive"]
    older = f"torque of {FACTS['date']}"
    assert calibration.provenance[older]["set"] == ["axes.1.counts_per_nm_positive"]
    assert calibration.provenance[older]["command"] == "all"
    assert set(calibration.measured[older]) == {"axis 1"}
    assert "(torque, 2026-11-22)" in calibration.sources["axes.1.counts_per_nm_positive"]
    assert "(torque, 2026-11-23)" in calibration.sources["axes.2.counts_per_nm_positive"]
    deposit(place, "torque", first, LATER, found=REAL)
    assert list(read_calibration(place).provenance) == ["torque"]


def test_procedures_that_end_together_lose_nothing_of_each_other(place):
    keys = [f"axes__{leg}__{name}" for leg in (1, 2, 3) for name in ("encoder_zero", "counts_per_nm_positive")]
    threads = [Thread(target=deposit, args=(place, key, result(**{key: 0.5}), FACTS)) for key in keys]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(read_calibration(place).settings) == len(keys)
    kept = sorted(place.parent.glob("calibration.toml.*"))
    assert sorted(len(read_calibration(each).settings) for each in kept) == list(range(1, len(keys)))
    assert len(list(place.parent.iterdir())) == len(keys)


def test_an_old_calibration_is_kept_where_files_have_one_name_only(place, monkeypatch):
    monkeypatch.setattr("os.link", lambda *_: (_ for _ in ()).throw(PermissionError(1, "no links here")))
    for zero in (0.1, 0.2, 0.3):
        deposit(place, "zeros", result(axes__1__encoder_zero=zero), FACTS)
    assert tomllib.loads(place.with_name("calibration.toml.2").read_text())["axes"]["1"]["encoder_zero"] == 0.2


def test_a_folder_that_somebody_holds_is_one_sentence(place, monkeypatch):
    def held(*_):
        raise BlockingIOError

    monkeypatch.setattr("fcntl.flock", held)
    monkeypatch.setattr("torquerig.calibrating.deposit.PATIENCE", 0.0)
    with pytest.raises(RecordError, match="another procedure has been writing into"):
        deposit(place, "zeros", result(axes__1__encoder_zero=0.1), FACTS)


def loaded(path, found, *, any_drives=False):
    return notes_on_loaded(path, read_calibration(path).provenance, found, any_drives=any_drives)


def test_real_drives_are_not_driven_with_a_calibration_of_others(place):
    deposit(place, "direction", result(axes__1__sign=-1), FACTS, found=SIMULATED)
    with pytest.raises(ConfigurationError, match=r"on simulated drives .*, and here are real ones: measure these"):
        loaded(place, REAL)
    (note,) = loaded(place, REAL, any_drives=True)
    assert "measured on simulated drives" in note
    assert loaded(place, SIMULATED) == []


def test_simulated_drives_take_any_calibration_and_it_is_told(place):
    deposit(place, "direction", result(axes__1__sign=1), FACTS, found=REAL)
    outcome = run_experiment(load_configuration(options={"calibration.file": str(place)}))
    assert any(
        "measured on real drives (direction, 2026-11-22), and here are simulated" in note for note in outcome.notes
    )


def test_new_firmware_is_told(place):
    deposit(place, "direction", result(axes__1__sign=1), FACTS, found=REAL)
    notes = loaded(place, drives(11, 12, 13, revision=2))
    assert len(notes) == 3
    assert notes[0].startswith("The drive of axis 1 has revision 2; when ")
