"""The loop in virtual time."""

from dataclasses import replace

import numpy as np
import pytest

from torquerig.control import (
    LimitExceeded,
    LoopLog,
    Pace,
    Progress,
    Surroundings,
    experiment_table,
    law_named,
    run_loop,
    thesis_motion,
    tracking,
)
from torquerig.mechanism import HOME

PERIOD = 4_000_000
START = 2_000_000_000
AT_START = Pace(start_ns=START)


@pytest.fixture(scope="session")
def table(model):
    around = Surroundings(speed=0.1, acceleration=1.0, before=0.04, after=0.04)
    return experiment_table(model, thesis_motion(1), stands_at=HOME, repeats=1, period_ns=PERIOD, around=around)


@pytest.fixture
def run(machine, controller, model, table, stopwatch):
    """Runs the table on the machine under computed torque; returns the log."""

    def go(*, pace=AT_START, law="computed-torque", log=None, progress=None, **parts):
        log = LoopLog.for_table(table) if log is None else log
        law = law_named(law).for_motion(model, 1)
        return run_loop(
            machine, controller(law, **parts), table, log, stopwatch_ns=stopwatch, pace=pace, progress=progress
        )

    return go


def test_every_cycle_is_sampled_at_its_absolute_deadline(run, machine, table):
    log = run()
    assert machine.sampled == [START + k * PERIOD for k in range(len(table))]
    assert log.rows == len(table)
    assert (log.due_ns + log.start_ns).tolist() == machine.sampled
    assert not log.lateness_ns.any()


def test_the_first_cycle_is_due_one_period_from_now_unless_told(run, machine):
    begin = machine.now
    run(pace=Pace())
    assert machine.sampled[0] == begin + PERIOD


def test_torques_leave_as_soon_as_computed(run, machine):
    log = run()
    assert [at for at, _ in machine.commanded] == [at + machine.answer_ns for at in machine.sampled]
    assert set(log.command_ns) == set(log.sample_ns) == {machine.answer_ns}


def test_torques_leave_at_the_time_that_was_set(run, machine):
    log = run(pace=Pace(start_ns=START, command_after_ns=3_180_000))
    assert [at for at, _ in machine.commanded] == [at + 3_180_000 for at in machine.sampled]
    assert set(log.command_ns) == {3_180_000}


def test_torques_that_are_computed_after_their_time_leave_at_once(run, machine):
    run(pace=Pace(start_ns=START, command_after_ns=200_000))
    assert [at for at, _ in machine.commanded] == [at + machine.answer_ns for at in machine.sampled]


@pytest.mark.parametrize("after", [-1, PERIOD])
def test_a_command_time_outside_the_period_is_a_mistake(run, after):
    with pytest.raises(ValueError, match="0 to 3999999 ns can be had"):
        run(pace=Pace(command_after_ns=after))


def test_missed_cycles_are_skipped_and_counted_never_caught_up(run, machine, table):
    machine.stall[10] = 3 * PERIOD + PERIOD // 2  # cycle 10 ends 3.6 periods after it began
    log = run()
    assert np.flatnonzero(log.skipped).tolist() == [11, 12]
    taken = [(at - START) / PERIOD for at in machine.sampled]
    assert taken[10:14] == [10, 13.625, 14, 15]  # cycle 13 began less than a period late, and the rest is on time
    assert len(machine.commanded) == len(table) - 2
    assert tracking.late_cycles(log) == 2
    assert tracking.overruns(log) == 3  # and cycle 10, whose torques left after cycle 11 was due
    assert log.lateness_ns[11:14].tolist() == [int(2.625 * PERIOD), int(1.625 * PERIOD), int(0.625 * PERIOD)]


def test_the_tolerance_decides_what_is_too_late(run, machine):
    machine.stall[10] = 3 * PERIOD + PERIOD // 2
    log = run(pace=Pace(start_ns=START, tolerance_ns=PERIOD // 2))
    assert np.flatnonzero(log.skipped).tolist() == [11, 12, 13]
    assert (machine.sampled[11] - START) / PERIOD == 14


def test_a_skipped_cycle_leaves_the_reference_on_time_and_no_number(run, machine, table):
    machine.stall[30] = 2 * PERIOD
    log = run()
    skipped = int(np.flatnonzero(log.skipped)[0])
    for column in (log.q, log.qd, log.position, log.velocity, log.tau, log.tau_law, log.tau_actual):
        assert np.isnan(column[skipped]).all()
    assert np.array_equal(log.desired_position, table.position)
    assert np.count_nonzero(tracking.motion_rows(log)) == 49
    assert tracking.position_rmse_mm(log) < 2.0


def test_an_incomplete_sample_is_used_and_counted(run, machine, table):
    machine.incomplete = {5, 6}
    log = run()
    assert np.flatnonzero(~log.complete).tolist() == [5, 6]
    assert len(machine.commanded) == len(table)
    assert tracking.incomplete_samples(log) == 2


def test_the_cycles_own_work_is_counted_without_the_waiting(run, machine):
    machine.answer_ns = 2_000_000
    log = run()
    assert set(log.work_ns) == {2000}  # from the first of four looks at the stopwatch to the next, and again
    assert set(log.law_ns) == {1000}  # from the sample to the torques
    assert tracking.work_us(log) == tracking.Percentiles(2.0, 2.0, 2.0)
    assert tracking.law_us(log) == tracking.Percentiles(1.0, 1.0, 1.0)


def test_the_log_holds_what_was_measured_asked_and_done(run, machine, table, model):
    log = run(pace=Pace(start_ns=START, command_after_ns=1_000_000))
    assert log.tau[:-1] == pytest.approx(log.tau_actual[1:])
    assert log.tau == pytest.approx(np.array([tau for _, tau in machine.commanded]))
    assert np.array_equal(log.tau, log.tau_law)
    assert log.position == pytest.approx(np.array([model.forward_kinematics(q) for q in log.q]))
    assert log.qd[1:] == pytest.approx(np.diff(log.q, axis=0) / 0.004)
    assert np.array_equal(log.in_motion, table.in_motion)


def test_the_log_holds_when_each_axis_answered_and_nothing_where_it_did_not(run, machine):
    machine.incomplete = {5}
    log = run()
    assert set(log.tpdo_ns[:, 1]) == {machine.answer_ns / 2}
    assert np.flatnonzero(np.isnan(log.tpdo_ns).any(axis=1)).tolist() == [5]
    assert np.isnan(log.tpdo_ns[5]).tolist() == [True, False, False]


def test_torques_beyond_the_limit_are_cut_and_counted(run, machine, limits):
    log = run(limits=replace(limits, torque=0.1))
    cut = np.abs(log.tau_law) > 0.1
    assert cut.any()
    assert np.array_equal(log.clipped, cut.sum(axis=1))
    assert np.max(np.abs(log.tau)) == 0.1
    assert tracking.clipped_cycles(log) == np.count_nonzero(cut.any(axis=1))
    assert max(np.max(np.abs(tau)) for _, tau in machine.commanded) == 0.1


def test_a_violated_limit_stops_the_loop_before_its_torque_and_keeps_the_log(run, machine, limits, table):
    log = LoopLog.for_table(table)
    with pytest.raises(LimitExceeded, match="joint speed"):
        run(log=log, limits=replace(limits, joint_speed=1.0))
    assert 0 < log.rows < len(table)
    assert len(machine.commanded) == log.rows - 1
    last = log.rows - 1
    assert np.max(np.abs(log.qd[last])) > 1.0
    assert np.isnan(log.tau[last]).all()
    assert np.isfinite(log.tau[:last]).all()
    assert np.isfinite(tracking.position_rmse_mm(log))
    assert np.isfinite(tracking.peak_torque(log))


def test_the_log_outlives_an_interrupt(run, table):
    log = LoopLog.for_table(table)

    def interrupt(done):
        if done == 20:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(log=log, progress=Progress(interrupt, every=10))
    assert log.rows == 20
    assert {len(column.values) for column in log.columns()} == {20}


def test_progress_is_told_once_in_a_while(run, table):
    told = []
    run(progress=Progress(told.append, every=25))
    assert told == list(range(25, len(table) + 1, 25))


def test_a_second_run_with_the_same_controller_forgets_the_first(machine, model, controller, table, stopwatch):
    both = []
    one = controller(law_named("coupled-pd").for_motion(model, 1))
    for _ in range(2):
        machine.__init__(model)
        log = LoopLog.for_table(table)
        both.append(run_loop(machine, one, table, log, stopwatch_ns=stopwatch, pace=Pace(start_ns=START)))
    assert np.array_equal(both[0].qd, both[1].qd)
    assert np.array_equal(both[0].tau, both[1].tau)


# the prototype on the identified plant (experiments.md): position mm, velocity m/s, peak torque N·m
PROTOTYPE = {
    (1, "decoupled-pd"): (0.768, 0.0594, 0.347),
    (1, "coupled-pd"): (1.158, 0.0564, 0.265),
    (1, "augmented-pd"): (0.387, 0.0303, 0.284),
    (1, "computed-torque"): (0.321, 0.0302, 0.313),
    (2, "decoupled-pd"): (1.882, 0.2812, 0.980),
    (2, "coupled-pd"): (1.013, 0.0923, 0.753),
    (2, "augmented-pd"): (0.583, 0.0833, 0.706),
    (2, "computed-torque"): (0.957, 0.2008, 0.980),
}


@pytest.mark.parametrize(("number", "name"), PROTOTYPE)
def test_the_prototypes_figures_come_out(machine, model, controller, limits, stopwatch, number, name):
    """Same motion, law, gains and delay on the same dynamics, but exact encoders: within 10 %."""
    around = Surroundings(speed=0.1, acceleration=1.0, before=0.1, after=0.02)
    motion = experiment_table(model, thesis_motion(number), stands_at=HOME, repeats=1, period_ns=PERIOD, around=around)
    law = law_named(name)
    pace = Pace(command_after_ns=law.running_time_ns)
    wide = replace(limits, joint_speed=50.0, torque_stop=50.0)
    parts = controller(law.for_motion(model, number), limits=wide)
    log = run_loop(machine, parts, motion, LoopLog.for_table(motion), stopwatch_ns=stopwatch, pace=pace)
    figures = tracking.position_rmse_mm(log), tracking.velocity_rmse(log), tracking.peak_torque(log)
    assert figures == pytest.approx(PROTOTYPE[number, name], rel=0.10)
