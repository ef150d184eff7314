"""Manipulator as a value: checked, frozen, and careful with its arguments."""

import pickle
from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest

from torquerig.mechanism import HOME, Link, Manipulator, warm_up

THESIS = Manipulator.thesis()
V, A, TAU = (0.1, -0.2), (1.0, 2.0), (0.1, 0.2, -0.3)

CALLS = [
    ("inverse_kinematics", (HOME,)),
    ("forward_kinematics", ((0.85, 3.2, 4.39),)),
    ("closure_residuals", ((0.85, 3.2, 4.39),)),
    ("jacobians", (HOME,)),
    ("jacobian_rates", (HOME, V)),
    ("joint_rates", (HOME, V)),
    ("task_velocity", (HOME, TAU)),
    ("dynamics", (HOME, V)),
    ("task_inertia", (HOME,)),
    ("task_coriolis", (HOME, V)),
    ("task_viscous", (HOME,)),
    ("distribute", (HOME, A)),
    ("conditioning", (HOME,)),
    ("singularity_distance", (HOME,)),
    ("forward_dynamics", (HOME, V, TAU)),
    ("inverse_dynamics", (HOME, V, A)),
    ("joint_inertia", (TAU,)),
    ("joint_coriolis", (TAU, (*TAU, *TAU))),
]


def flat(result: object) -> list[float]:
    parts = result if isinstance(result, tuple) else (result,)
    return [float(value) for part in parts for value in np.ravel(np.asarray(part))]


@pytest.mark.parametrize(("method", "arguments"), CALLS)
def test_any_sequence_will_do_and_none_is_modified(method: str, arguments: tuple[Any, ...]) -> None:
    plain = flat(getattr(THESIS, method)(*arguments))
    spaced = [np.repeat(np.array(argument), 2)[::2] for argument in arguments]
    locked = [np.array(argument) for argument in arguments]
    for array in locked:
        array.setflags(write=False)
    for others in ([list(argument) for argument in arguments], spaced, locked):
        before = [list(argument) for argument in others]
        assert flat(getattr(THESIS, method)(*others)) == plain
        assert [list(argument) for argument in others] == before


@pytest.mark.parametrize(("method", "arguments"), CALLS)
def test_results_are_the_callers_own(method: str, arguments: tuple[Any, ...]) -> None:
    first = getattr(THESIS, method)(*arguments)
    kept = flat(first)
    for part in first if isinstance(first, tuple) else (first,):
        if isinstance(part, np.ndarray):
            part[...] = np.nan
    assert flat(getattr(THESIS, method)(*arguments)) == kept


@pytest.mark.parametrize(("method", "arguments"), CALLS)
def test_wrong_shapes_are_refused(method: str, arguments: tuple[Any, ...]) -> None:
    with pytest.raises(ValueError, match="shape"):
        getattr(THESIS, method)(*arguments[:-1], (1.0,))


def test_whole_numbers_count_as_floats() -> None:
    machine = replace(THESIS, bases=((-1, 0), (1, 0), (0, 1)), link_length=2)
    assert machine.forward_dynamics((0, 0), (0, 0), (1, 0, 0)).dtype == np.float64


def test_manipulator_is_frozen_equal_by_value_and_pickles() -> None:
    with pytest.raises(FrozenInstanceError):
        THESIS.gear_ratio = 1.0  # type: ignore[misc]
    again = pickle.loads(pickle.dumps(THESIS))  # noqa: S301 our own bytes
    assert again == THESIS
    assert hash(again) == hash(THESIS)
    assert again.task_inertia(HOME).tolist() == THESIS.task_inertia(HOME).tolist()


def test_packed_constants_are_a_copy() -> None:
    THESIS.packed[:] = 0.0
    assert THESIS.packed.any()
    assert THESIS.constants.tolist() == THESIS.packed.tolist()


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"link_length": 0.0}, r"link_length is 0\.0"),
        ({"gear_ratio": float("nan")}, "gear_ratio is nan"),
        ({"active_viscous": -1.0}, r"active_viscous is -1\.0"),
        ({"actuator_inertia": float("inf")}, "actuator_inertia is inf"),
        ({"bases": ((0.0, 0.0), (0.0, 0.0), (1.0, 0.0))}, "three different points"),
        ({"branches": (1, 0, 1)}, "three of"),
        ({"branches": (1, 1)}, "three of"),
    ],
)
def test_constants_out_of_range_are_named(change: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        replace(THESIS, **change)


def test_a_link_needs_mass_centre_and_inertia() -> None:
    with pytest.raises(ValueError, match=r"mass is 0\.0"):
        Link(0.0, 0.1, 0.1)


def test_bad_branches_in_a_call_are_named() -> None:
    with pytest.raises(ValueError, match=r"branches are \(1, 2, 1\)"):
        THESIS.inverse_kinematics(HOME, branches=(1, 2, 1))


def test_warm_up_can_be_repeated() -> None:
    warm_up()
    warm_up()
