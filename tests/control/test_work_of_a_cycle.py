"""What a cycle computes: in one compiled call or step by step it is the same, and so are its errors and its log."""

from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np
import pytest

from torquerig.control import (
    LimitExceeded,
    LoopLog,
    Pace,
    Surroundings,
    experiment_table,
    load_laws,
    run_loop,
    thesis_motion,
)
from torquerig.control.compensation import Compensation
from torquerig.control.log import quantities
from torquerig.control.row import ROW, Row
from torquerig.mechanism import HOME, ReachError

PERIOD = 4_000_000
START = 2_000_000_000
TIMES = {"work_ns", "law_ns"}


@pytest.fixture(scope="session")
def table(model):
    around = Surroundings(speed=0.1, acceleration=1.0, before=0.02, after=0.02)
    return experiment_table(model, thesis_motion(1), stands_at=HOME, repeats=1, period_ns=PERIOD, around=around)


class Sample(NamedTuple):
    at_ns: int
    q: np.ndarray
    torque: np.ndarray
    complete: bool = True
    answered_ns: np.ndarray | None = None


def sample_at(q, at_ns):
    return Sample(at_ns, q, np.zeros(3))


def in_numpy(law):
    """The same law by its own equation: whoever writes one of his own has no more."""
    parent = type(law)

    @dataclass(frozen=True, slots=True)
    class Own(parent):
        def torque(self, state, desired):
            return parent.torque(self, state, desired)

    return Own(*(getattr(law, each.name) for each in fields(law)))


@pytest.fixture
def run(machine, controller, model, table, stopwatch):
    """Runs a law on the machine, merged or by its equation; returns the log and what stopped it."""

    def go(law, *, merged=True, lead=0.0, coulomb=0.0, **parts):
        machine.__init__(model)
        machine.incomplete = {7}
        compensation = Compensation(lead=lead, coulomb=coulomb)
        whole = controller(law if merged else in_numpy(law), compensation=compensation, **parts)
        log, ahead = LoopLog.for_table(table), compensation.ahead(model, table)
        try:
            run_loop(machine, whole, table, log, stopwatch_ns=stopwatch, pace=Pace(start_ns=START), ahead=ahead)
        except (LimitExceeded, ReachError) as error:
            return log, str(error)
        return log, None

    return go


def assert_same(log, other):
    assert log.rows == other.rows
    for name in quantities().keys() - TIMES:
        assert getattr(log, name) == pytest.approx(getattr(other, name), rel=1e-9, abs=1e-9, nan_ok=True), name


@pytest.mark.parametrize("compensation", [{}, {"lead": 0.0013}, {"lead": 0.0013, "coulomb": 0.01}, {"coulomb": 0.01}])
@pytest.mark.parametrize("name", load_laws())
def test_a_run_is_the_same_in_one_call_and_step_by_step(run, model, name, compensation):
    law = load_laws()[name].for_motion(model, 1, friction=True, stiction=0.02)
    log, stopped = run(law, **compensation)
    assert stopped is None
    assert_same(log, run(law, merged=False, **compensation)[0])


@pytest.mark.parametrize(
    ("bounds", "words"),
    [
        ({"joint_speed": 1.0}, "joint speed limit: joint"),
        ({"position_error": 1e-5}, "position error limit: end-effector"),
        ({"x": (0.07, 0.0925)}, "workspace limit: x"),
        ({"conditioning": 0.99}, "conditioning limit: S"),
        ({"singularity_distance": 0.045}, "singularity distance limit"),
        ({"torque_stop": 0.05}, "torque limit: joint"),
    ],
)
def test_a_limit_is_told_and_logged_alike_in_one_call_and_step_by_step(run, model, limits, bounds, words):
    law = load_laws()["computed-torque"].for_motion(model, 1)
    log, stopped = run(law, limits=replace(limits, **bounds))
    stepped, said = run(law, merged=False, limits=replace(limits, **bounds))
    assert words in stopped
    assert stopped == said
    assert_same(log, stepped)
    last = log.rows - 1
    assert np.isfinite(log.q[last]).all()
    assert np.isnan(log.tau[last]).all()
    assert np.isfinite(log.tau_law[last]).all() == ("torque_stop" in bounds)


def test_where_no_law_can_be_worked_out_it_is_said_alike(model, controller, table):
    """Asked for an instant in which the end-effector would be out of reach, which no limit looks at."""
    law = load_laws()["computed-torque"].for_motion(model, 1)
    far = replace(table, position=table.position + np.array((0.0, 0.2)))
    said = []
    for form in (law, in_numpy(law)):
        compute = controller(form).along(table, far, Row())
        with pytest.raises(ReachError, match="leg 1") as caught:
            compute(0, sample_at(table.q[0], 0))
        said.append(str(caught.value))
    assert said[0] == said[1]


@pytest.mark.parametrize("form", [lambda law: law, in_numpy])
def test_a_sample_that_is_not_later_is_refused_and_nothing_is_made_of_it(form, model, controller, table):
    row = Row()
    compute = controller(form(load_laws()["coupled-pd"].for_motion(model, 1))).along(table, None, row)
    compute(0, sample_at(table.q[0], PERIOD))
    with pytest.raises(ValueError, match="not later"):
        compute(1, sample_at(table.q[0] + 1e-4, PERIOD))
    assert np.array_equal(row.q, table.q[0] + 1e-4)
    assert np.isnan(row.numbers[3:16]).all()


def test_a_law_of_ones_own_gets_the_loops_arrays_and_what_it_returns_is_copied(model, controller, table):
    row, law = Row(), in_numpy(load_laws()["coupled-pd"].for_motion(model, 1))
    controller(law).along(table, None, row)(0, sample_at(table.q[0], 0))
    assert row.numbers.shape == (ROW,)
    assert np.array_equal(row.tau, row.tau_law)
    assert not np.shares_memory(row.tau, row.tau_law)


def test_a_log_that_was_read_back_is_not_run_into(run, model, machine, controller, table, stopwatch):
    log, _ = run(load_laws()["coupled-pd"].for_motion(model, 1))
    columns = {column.name: column.values for column in log.columns()}
    again = LoopLog.from_columns(columns, start_ns=log.start_ns, period_ns=log.period_ns)
    with pytest.raises(ValueError, match="read back"):
        run_loop(
            machine,
            controller(load_laws()["coupled-pd"].for_motion(model, 1)),
            table,
            again,
            stopwatch_ns=stopwatch,
        )


def test_a_sample_without_times_of_answer_leaves_none(table):
    row = Row()
    row.report(sample_at(table.q[0], 0)._replace(answered_ns=np.ones(3)))
    row.report(sample_at(table.q[0], 0))
    assert np.isnan(row.numbers[19:]).all()
