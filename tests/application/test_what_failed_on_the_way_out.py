"""Drives that nobody saw disabled are told of, whatever else went wrong before, and never passed off as disabled."""

import json

import pytest

from torquerig.cli import hold, main
from torquerig.cli.failures import Failure, told
from torquerig.driver.errors import BusError
from torquerig.stopping import Stopped

UNSEEN = "drive 2 does not confirm that it is disabled"


def stopped(number=15):
    stop = Stopped(number)
    stop.add_note(UNSEEN)
    return stop


@pytest.mark.parametrize("error", [BusError("the link is gone"), stopped()])
def test_a_note_is_part_of_the_sentence(error):
    if not hasattr(error, "__notes__"):
        error.add_note(UNSEEN)
    with pytest.raises(Failure, match=f"; {UNSEEN}$"), told():
        raise error


def perform(stop):
    def raising(*_):
        raise stop

    return raising


def test_hold_ends_well_when_the_drives_were_seen_disabled(monkeypatch, capsys):
    monkeypatch.setattr(hold, "perform", perform(Stopped(15)))
    assert main(["hold", "--seconds", "1", "--yes", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"ended": "stopped by SIGTERM"}


def test_hold_does_not_say_disabled_when_nobody_saw_it(monkeypatch, capsys):
    monkeypatch.setattr(hold, "perform", perform(stopped()))
    assert main(["hold", "--seconds", "1", "--yes"]) == 4
    said = capsys.readouterr()
    assert "drives disabled" not in said.out
    assert UNSEEN in said.err
