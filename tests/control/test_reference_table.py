import numpy as np
import pytest

from torquerig.control import Hold, Piece, SmoothMove, Surroundings, experiment_table, tabulate, thesis_motion
from torquerig.mechanism import HOME

AROUND = Surroundings(speed=0.05, acceleration=0.5, before=0.1, after=0.2)


@pytest.fixture(scope="session")
def table_of(model):
    def build(number=1, repeats=1, period_ns=4_000_000, stands_at=(0.095, 0.058)):
        return experiment_table(
            model, thesis_motion(number), stands_at=stands_at, repeats=repeats, period_ns=period_ns, around=AROUND
        )

    return build


@pytest.mark.parametrize(("number", "samples"), [(1, 50), (2, 40)])
def test_the_motion_has_the_thesis_number_of_samples(table_of, number, samples):
    table = table_of(number)
    assert np.count_nonzero(table.in_motion) == samples
    first = int(np.argmax(table.in_motion))
    assert table.in_motion[first : first + samples].all()
    motion = thesis_motion(number)
    for k in range(samples):
        assert table.position[first + k] == pytest.approx(motion.at(0.004 * k).position, abs=1e-15)


def test_an_experiment_is_approach_hold_motions_hold(table_of):
    table = table_of(1, repeats=3)
    move = SmoothMove.within((0.095, 0.058), HOME, speed=0.05, acceleration=0.5)
    approach = int(np.ceil(move.duration / 0.004))
    assert len(table) == approach + 25 + 3 * 50 + 50 + 1
    assert np.flatnonzero(table.in_motion).tolist() == list(range(approach + 25, approach + 175))
    assert table.position[0].tolist() == [0.095, 0.058]
    assert table.velocity[approach : approach + 25].tolist() == [[0.0, 0.0]] * 25
    assert table.position[-1] == pytest.approx(HOME)


@pytest.mark.parametrize("period_ns", [4_000_000, 1_000_000, 3_333_333])
def test_joins_are_continuous_in_position_and_velocity(table_of, period_ns):
    table, seconds = table_of(2, 2, period_ns), period_ns * 1e-9
    greatest = 15.0 * np.sqrt(2)
    assert np.max(np.linalg.norm(np.diff(table.velocity, axis=0), axis=1)) <= greatest * seconds * 1.001
    trapezoid = (table.velocity[1:] + table.velocity[:-1]) / 2 * seconds
    assert np.diff(table.position, axis=0) == pytest.approx(trapezoid, abs=greatest * seconds**2 / 2)


def test_the_joints_part_is_the_mechanisms(table_of, model):
    table = table_of(2)
    for k in range(0, len(table), 7):
        _, S = model.jacobians(table.position[k])
        assert table.q[k] == pytest.approx(model.inverse_kinematics(table.position[k]).theta)
        assert table.qd[k] == pytest.approx(S @ table.velocity[k], abs=1e-12)
    inside = slice(1, -1)
    assert np.gradient(table.q, 0.004, axis=0)[inside] == pytest.approx(table.qd[inside], abs=0.35)


def test_a_row_is_what_a_cycle_asks_for(table_of):
    table = table_of()
    desired = table.row(60)
    assert np.array_equal(desired.position, table.position[60])
    assert np.array_equal(desired.qd, table.qd[60])
    assert np.shares_memory(desired.q, table.q)


def test_standing_at_the_start_needs_no_approach(table_of):
    assert len(table_of(stands_at=HOME)) == 25 + 50 + 50 + 1


def test_a_remainder_shorter_than_a_period_gets_a_sample(model):
    table = tabulate(model, [Piece(thesis_motion(1, ramp=0.0), in_motion=True)], 5_000_000)
    assert np.count_nonzero(table.in_motion) == 35  # 172 ms
    assert table.position[-1] == pytest.approx(HOME)


def test_pieces_that_do_not_join_are_refused(model):
    with pytest.raises(ValueError, match="where the one before ended"):
        tabulate(model, [Piece(Hold(HOME, 0.1)), Piece(Hold((0.093, 0.062), 0.1))], 4_000_000)
    with pytest.raises(ValueError, match="no pieces"):
        tabulate(model, [], 4_000_000)


def test_no_repeat_at_all_is_refused(table_of):
    with pytest.raises(ValueError, match="0 repeats"):
        table_of(repeats=0)
