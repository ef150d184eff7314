"""Tracking figures of logs that are typed here."""

import math

import numpy as np
import pytest

from torquerig.control import LoopLog, ReferenceTable, tracking


@pytest.fixture
def log():
    """Six cycles, the middle four in the motion; every one is measured 3 mm and 4 mm away, as fast as its number."""
    n = 6
    table = ReferenceTable(
        period_ns=4_000_000,
        position=np.tile([0.1, 0.06], (n, 1)),
        velocity=np.zeros((n, 2)),
        acceleration=np.zeros((n, 2)),
        q=np.zeros((n, 3)),
        qd=np.zeros((n, 3)),
        in_motion=np.array([False, True, True, True, True, False]),
    )
    log = LoopLog.for_table(table)
    log.rows = n
    log.complete[:] = True
    log.position[:] = (0.103, 0.056)
    log.velocity[:] = np.arange(n)[:, None] * (0.3, 0.4)
    log.tau[:] = 0.0
    log.tau_actual[:] = np.arange(n)[:, None] * (0.01, -0.1, 0.0)
    log.work_ns[:] = [1000, 2000, 3000, 4000, 5000, 9000]
    return log


def test_position_rmse_is_the_rms_of_the_distance_in_the_plane(log):
    assert tracking.position_rmse_mm(log) == pytest.approx(5.0)


def test_velocity_rmse_counts_the_motions_samples_only(log):
    assert tracking.velocity_rmse(log) == pytest.approx(0.5 * math.sqrt((1 + 4 + 9 + 16) / 4))


def test_torque_figures_count_all_motors_in_the_motion(log):
    assert tracking.peak_torque(log) == pytest.approx(0.4)
    assert tracking.rms_torque(log) == pytest.approx(math.sqrt(30 * (0.01**2 + 0.1**2) / 12))


def test_skipped_rows_do_not_count(log):
    log.skip(4, 5_000_000)
    log.rows = 6
    log.tau[4] = np.nan
    assert tracking.motion_rows(log).tolist() == [False, True, True, True, False, False]
    assert tracking.velocity_rmse(log) == pytest.approx(0.5 * math.sqrt((1 + 4 + 9) / 3))
    assert tracking.late_cycles(log) == 1


def test_an_overrun_is_a_cycle_not_done_within_its_period(log):
    log.command_ns[:] = [0, 4_000_000, 4_000_001, 0, 0, 0]
    assert tracking.overruns(log) == 1


def test_work_is_told_by_its_percentiles(log):
    work = tracking.work_us(log)
    assert (work.p50, work.max) == (3.5, 9.0)
    assert 5.0 < work.p99 < 9.0


def test_of_a_run_stopped_before_its_motion_there_is_no_figure(log):
    log.rows = 1
    assert math.isnan(tracking.position_rmse_mm(log))
    assert math.isnan(tracking.velocity_rmse(log))
    assert math.isnan(tracking.peak_torque(log))
    assert math.isnan(tracking.rms_torque(log))
    log.rows = 0
    assert math.isnan(tracking.work_us(log).p50)


def test_every_column_has_a_name_a_unit_and_one_number_a_row(log):
    columns = {column.name: column for column in log.columns()}
    assert all(column.values.shape == (6,) and column.unit for column in columns.values())
    assert columns["position_x"].unit == "m"
    assert columns["q_3"].unit == "rad"
    assert columns["tau_2"].unit == "N·m"
    assert columns["desired_acceleration_y"].unit == "m/s²"
    assert columns["work_ns"].unit == "ns"
    assert columns["skipped"].unit == "1"
    assert columns["tau_2"].values.tolist() == pytest.approx(log.tau[:, 1].tolist())
    assert len(columns) == 10 + 8 * 3 + 5 * 2  # numbers, joint vectors, plane vectors
