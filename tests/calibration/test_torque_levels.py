"""Schedules of levels, levels out of files, and readings that somebody types."""

import os
import select
from types import SimpleNamespace

import pytest

from torquerig.calibrating.keyboard import Keyboard
from torquerig.calibration.torque_levels import Schedule, read_levels
from torquerig.calibration.torque_sensors import TypedSensor
from torquerig.errors import ConfigurationError


def test_the_schedule_goes_up_beyond_and_down_in_both_directions():
    levels = [step.level for step in Schedule(3500, 8000, 3, 0.15).steps()]
    up, down = [3500, 5750, 8000], [8000, 5750, 3500]
    assert levels == [*up, 9200, *down, 0, *(-level for level in (*up, 9200, *down)), 0]


def test_what_is_only_passed_through_is_not_measured():
    assert {step.level for step in Schedule().steps() if not step.measured} == {9200, -9200, 0}


@pytest.mark.parametrize("values", [(0, 8000, 10), (8000, 3500, 10), (3500, 8000, 1), (3500, 30000, 10)])
def test_impossible_schedules_are_refused(values):
    with pytest.raises(ValueError, match="levels"):
        Schedule(*values)


def test_a_file_of_levels_tells_ways_up_from_ways_down():
    lines = ["level,reading", "", "3500, 0.149  # first", "8000,0.367", "8000,0.407", "3500,0.189", "-3500,-0.159"]
    given = read_levels(lines, "levels.csv")
    assert [(each.level, each.torque, each.rising) for each in given] == [
        (3500, 0.149, True),
        (8000, 0.367, True),
        (8000, 0.407, False),
        (3500, 0.189, False),
        (-3500, -0.159, True),
    ]


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ("4000", "levels.csv:2: '4000' is no level in counts and reading in N·m, as 3500,0.142"),
        ("4000,0.2,7", "levels.csv:2: '4000,0.2,7' is no level"),
        ("4e3,0.2", "levels.csv:2: '4e3,0.2' is no level"),
        ("4000,0.2x", "levels.csv:2: '4000,0.2x' is no level"),
        ("4000,nan", "levels.csv:2: a reading is a number of N·m, not nan"),
        ("0,0.0", "levels.csv:2: a level is a whole number of counts up to 32767, and not 0: 0"),
        ("40000,2", "levels.csv:2: a level is a whole number of counts up to 32767, and not 0: 40000"),
        ("torque,reading", "levels.csv:2: 'torque,reading' is no level"),
    ],
)
def test_a_wrong_line_is_named(line, complaint):
    with pytest.raises(ValueError, match=r"levels\.csv:2") as error:
        read_levels(["3500,0.149", line], "levels.csv")
    assert str(error.value).startswith(complaint)


def test_a_reading_in_a_file_is_as_uncertain_as_its_last_digit():
    (given,) = read_levels(["3500,0.149"], "levels.csv")
    assert given.spread == pytest.approx(1e-3 / 12**0.5)  # uniform, one step wide


def test_an_empty_file_is_told():
    with pytest.raises(ValueError, match="no level is in it"):
        read_levels(["# nothing"], "levels.csv")


class Typist:
    """Somebody who is asked, and types what he has."""

    def __init__(self, *lines):
        self.asked = []
        self.lines = list(lines)

    def ask(self, question):
        self.asked.append(question)

    def answer(self):
        return self.lines.pop(0) if self.lines else None


CONDUCTOR = SimpleNamespace(now_ns=lambda: 0)


def test_a_typed_reading_is_taken_with_its_sign_and_a_comma():
    typist = Typist("", "0,215")
    sensor = TypedSensor(CONDUCTOR, typist, patience=1.0, sign=-1)
    sensor.zero(2)
    sensor.begin(4000)
    assert sensor.result().torque == -0.215
    assert sensor.result() is None
    assert typist.asked == [
        "Axis 2 gives no torque now: set the display to zero, then press Enter.",
        "Level 4000 counts: what does the display show [N·m]?",
    ]


@pytest.mark.parametrize("line", ["", "0.2 Nm", "inf"])
def test_what_is_no_number_is_asked_for_again(line):
    typist = Typist(line)
    sensor = TypedSensor(CONDUCTOR, typist, patience=1.0)
    sensor.begin(4000)
    assert sensor.result() is None
    assert "is no number of N·m, such as 0.215. Level 4000 counts: again?" in typist.asked[-1]


@pytest.fixture
def terminal():
    person, program = os.openpty()
    yield person, Keyboard(wait=False, descriptor=program)
    os.close(person)
    os.close(program)


def typed(person, keyboard, text):
    """Type, and wait until the terminal has it."""
    os.write(person, text)
    select.select([keyboard._descriptor], [], [], 5.0)


def test_what_was_typed_before_the_question_is_no_answer(terminal):
    person, keyboard = terminal
    typed(person, keyboard, b"0.1\n0.2\n")
    keyboard.ask("what now?")
    assert keyboard.answer() is None
    typed(person, keyboard, b"0.3\n0.4\n")
    assert keyboard.answer() == "0.3"
    keyboard.ask("and now?")
    assert keyboard.answer() is None


def test_lines_of_a_program_are_taken_in_their_order():
    ours, theirs = os.pipe()
    os.write(theirs, b"0.1\n0.2\n")
    keyboard = Keyboard(wait=True, descriptor=ours)
    for expected in ("0.1", "0.2"):
        keyboard.ask("how much?")
        assert keyboard.answer() == expected
    os.close(theirs)
    with pytest.raises(ConfigurationError, match="standard input has ended"):
        keyboard.answer()
    os.close(ours)
