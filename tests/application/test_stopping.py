"""Signals end what runs, once."""

import os
import signal
import sys
import time
from types import SimpleNamespace

import pytest

from torquerig.stopping import Stopped, orderly_stop


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_what_runs_and_says_which_one(number):
    with pytest.raises(Stopped, match=f"stopped by {number.name}") as caught, orderly_stop():
        os.kill(os.getpid(), number)
    assert caught.value.exit_code == 128 + number


def interrupted_thrice(reached: list[str]) -> None:
    with orderly_stop():
        try:
            os.kill(os.getpid(), signal.SIGTERM)
        finally:
            os.kill(os.getpid(), signal.SIGINT)
            os.kill(os.getpid(), signal.SIGTERM)
            reached.append("end")


def test_a_second_signal_does_not_disturb_the_way_out():
    reached: list[str] = []
    with pytest.raises(Stopped):
        interrupted_thrice(reached)
    assert reached == ["end"]


class SignalledWhileFinalised:
    """Python drops what is raised in here."""

    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)


def test_a_signal_that_falls_into_a_finaliser_is_not_lost():
    def run():
        with orderly_stop():
            SignalledWhileFinalised()
            time.sleep(20)

    began = time.monotonic()
    with pytest.raises(Stopped, match="stopped by SIGTERM"):
        run()
    assert time.monotonic() - began < 10


def test_other_things_that_python_drops_are_told_as_before(monkeypatch):
    told = []
    monkeypatch.setattr(sys, "unraisablehook", told.append)
    with orderly_stop():
        sys.unraisablehook(SimpleNamespace(exc_value=ValueError("mine")))
    assert [str(each.exc_value) for each in told] == ["mine"]


def test_the_handlers_of_before_come_back():
    before = signal.getsignal(signal.SIGTERM)
    with orderly_stop():
        assert signal.getsignal(signal.SIGTERM) != before
    assert signal.getsignal(signal.SIGTERM) == before
