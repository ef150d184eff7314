"""Where a picture goes is judged before any work, in one sentence, by every command that draws."""

import errno

import pytest

from torquerig.cli.app import main
from torquerig.errors import PictureError
from torquerig.picture import drawing

COMMANDS = (
    ("run", "--picture"),
    ("show", "norecord", "--picture"),
    ("compare", "norecord", "norecord", "--picture"),
    ("timing", "norecord", "--picture"),
    ("estimators", "--out"),
)
PLACES = (
    ("a.txt", "a.txt cannot be a picture: its name must end in .png, .svg or .pdf"),
    ("plain2", "plain2 cannot be a picture: its name must end in .png, .svg or .pdf"),
    ("nosuch/a.png", "nosuch/a.png cannot be written: there is no folder nosuch"),
    ("file/a.png", "file/a.png cannot be written: file is no folder"),
)


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(("place", "sentence"), PLACES)
@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command[0])
def test_a_place_that_cannot_be_is_refused_before_any_work(elsewhere, capsys, command, place, sentence):
    assert main([*command, place]) == 2
    told = capsys.readouterr()
    assert sentence in told.err
    assert told.err.count("\n") == 1
    assert not told.out
    assert [path.name for path in elsewhere.iterdir()] == ["file"]


@pytest.mark.parametrize("command", [("maps", "--out"), ("calibrate", "latency", "--out")], ids=" ".join)
def test_a_folder_that_cannot_be_made_is_refused_before_any_work(capsys, command):
    assert main([*command, "file/new/place"]) == 2
    told = capsys.readouterr()
    assert "file/new/place cannot be made: file is no folder" in told.err
    assert told.err.count("\n") == 1
    assert not told.out


def test_a_folder_without_leave_to_write_is_refused(capsys, monkeypatch):
    monkeypatch.setattr("torquerig.cli.places.os.access", lambda _path, _mode: False)  # root may write everywhere
    for arguments in (["show", "norecord", "--picture", "a.png"], ["run"], ["maps"]):
        assert main(arguments) == 2
        told = capsys.readouterr().err
        assert "permission" in told
        assert told.count("\n") == 1


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf", ".PNG"])
def test_a_picture_replaces_the_one_before(elsewhere, suffix):
    place = elsewhere / f"a{suffix}"
    place.write_text("old", encoding="utf-8")
    with drawing("title", place, (2, 2)):
        pass
    assert place.read_bytes()[:4] in {b"\x89PNG", b"<?xm", b"%PDF"}


def test_a_disk_that_is_full_while_drawing_is_told_in_one_sentence(elsewhere, monkeypatch):
    def full(*_arguments, **_options):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", full)
    with pytest.raises(PictureError, match=r"a\.png cannot be written: No space left on device"):  # noqa: SIM117
        with drawing("title", elsewhere / "a.png", (2, 2)):
            pass
