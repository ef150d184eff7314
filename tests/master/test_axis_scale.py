"""Counts to rad and N·m and back, both directions, both signs."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.driver.errors import EnablingRefused, ProfileError
from torquerig.driver.master.profile import load_profile
from torquerig.driver.master.scale import AxisScale, AxisSettings, axis_scale

OURS = AxisSettings(1, load_profile(), counts_per_nm_positive=20670.0, counts_per_nm_negative=19528.0)


def test_a_joint_revolution_is_200000_counts():
    scale = axis_scale(OURS, None)
    assert scale.angle(200_000) == pytest.approx(2 * math.pi, rel=1e-15)
    assert scale.position(math.radians(48.9177)) == 27177


def test_each_direction_of_the_counts_has_its_own_slope():
    scale = axis_scale(OURS, None)
    assert scale.torque_counts(0.1) == 2067
    assert scale.torque_counts(-0.1) == -1953
    assert scale.torque(2067) == pytest.approx(0.1)
    assert scale.torque(-19528) == pytest.approx(-1.0)


def test_the_sign_turns_angle_and_torque_and_keeps_the_slopes_with_the_drives_direction():
    scale = axis_scale(replace(OURS, sign=-1), None)
    assert scale.angle(200_000) == pytest.approx(-2 * math.pi)
    assert scale.torque_counts(0.1) == -1953
    assert scale.torque(-1953) == pytest.approx(0.1, rel=1e-3)


def test_without_settings_the_profile_says_20100():
    assert axis_scale(AxisSettings(1, load_profile()), None).torque_counts(1.0) == 20100


def test_counts_end_where_the_object_ends():
    scale = axis_scale(OURS, None)
    assert scale.torque_counts(100.0) == 32767
    assert scale.torque_counts(-100.0) == -32768
    assert scale.torque_counts(math.inf) == 32767


def test_what_is_not_a_number_is_no_torque():
    with pytest.raises(ValueError, match="nan is no torque"):
        axis_scale(OURS, None).torque_counts(math.nan)


@given(
    st.floats(-1.5, 1.5, allow_nan=False),
    st.sampled_from([-1, 1]),
    st.floats(19000, 21000),
    st.floats(19000, 21000),
)
def test_a_torque_comes_back_within_half_a_count(torque, sign, positive, negative):
    scale = AxisScale(rad_per_count=1e-5, sign=sign, positive=positive, negative=negative)
    assert abs(scale.torque(scale.torque_counts(torque)) - torque) <= 0.5 / min(positive, negative) + 1e-12


@given(st.integers(-(2**31), 2**31 - 1), st.sampled_from([-1, 1]))
def test_a_position_comes_back_exactly(position, sign):
    scale = axis_scale(replace(OURS, sign=sign), None)
    assert scale.position(scale.angle(position)) == position


def test_per_mille_of_the_rated_torque_are_scaled_by_what_the_drive_says():
    elmo = AxisSettings(1, load_profile("elmo"), counts_per_revolution=8000)
    assert axis_scale(elmo, 319).torque_counts(0.319) == 1000


def test_per_mille_of_the_rated_current_need_the_torque_constant():
    nanotec = AxisSettings(1, load_profile("nanotec"), counts_per_revolution=3600)
    with pytest.raises(ProfileError, match="torque_constant"):
        axis_scale(nanotec, 2000)
    assert axis_scale(replace(nanotec, torque_constant=0.05), 2000).torque_counts(0.1) == 1000


def test_per_mille_of_nothing_are_refused():
    elmo = AxisSettings(3, load_profile("elmo"), counts_per_revolution=8000)
    with pytest.raises(EnablingRefused, match=r"drive 3: its rated torque \(6076:0\) is 0"):
        axis_scale(elmo, 0)


def test_a_profile_without_counts_per_revolution_needs_the_axis_to_say_it():
    with pytest.raises(ProfileError, match="counts_per_revolution"):
        axis_scale(AxisSettings(1, load_profile("elmo")), 319)


@pytest.mark.parametrize(
    "wrong",
    [{"node_id": 0}, {"sign": 0}, {"gear": 0.0}, {"counts_per_nm_negative": -1.0}, {"home": math.inf}],
)
def test_impossible_settings_are_refused_at_once(wrong):
    with pytest.raises(ValueError, match=r"is|\d"):
        replace(OURS, **wrong)


def test_a_make_without_an_eds_asks_for_one():
    with pytest.raises(ProfileError, match="drive 2: the profile nanotec has no EDS"):
        _ = AxisSettings(2, load_profile("nanotec")).eds_path
