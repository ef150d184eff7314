"""Signals end what runs, once."""

import os
import signal

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


def test_the_handlers_of_before_come_back():
    before = signal.getsignal(signal.SIGTERM)
    with orderly_stop():
        assert signal.getsignal(signal.SIGTERM) != before
    assert signal.getsignal(signal.SIGTERM) == before
