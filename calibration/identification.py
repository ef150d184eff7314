"""Identification of I1, K1, K2 and Fc from a driven motion, three ways side by side (thesis 5.4.2).

- `thesis`: velocity and acceleration from causal windows of nine, the torque as commanded at the same sample, three
  unknowns, all samples. On a machine whose truth is known it is far off (docs/identification.md).
- `recommended`: zero-phase derivatives, the torque as it acted in their window, a Coulomb column, slow samples dropped.
- `smoothed`: the same with filterpy's Rauch-Tung-Striebel smoother for the derivatives.

The last two also allow for a torque scale that differs between the directions of an axis, as the thesis' does by 5.7 %
(Figure 5.5), while the driver knows the average slope only: 1 - d times as many counts make a newton metre in the
positive direction and 1 + d times as many in the negative, with one more unknown d an axis. Without it an average scale
puts K2 off by up to 20 %.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration import differentiation
from torquerig.calibration.differentiation import WINDOW, Kinematics
from torquerig.calibration.excitation import condition_number, moving
from torquerig.calibration.regression import Fit, least_squares_in_time
from torquerig.calibration.regressor import Actuation, Array, Equation, equation, motor_torques
from torquerig.mechanism import Manipulator

UNKNOWNS: Final = Actuation._fields
THESIS_UNKNOWNS: Final = UNKNOWNS[:3]
LOPSIDED: Final = ("d1", "d2", "d3")
"""By which share more torque an axis gives in its positive direction than its scale says, and less in the other."""
LAGS: Final = 2 * WINDOW
"""Residuals hang together over one differentiating window; twice that for Newey and West's falling weights."""


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """A driven motion at a steady sampling period.

    Attributes:
        period: [s].
        q: Joint angles at n samples, shape (n, 3) [rad].
        tau_m: Motor torques commanded after each sample, shape (n, 3) [N·m at the motor].
        delay: From a sample until its torque acts at each axis, shape (3,) [s]; it then holds for a period.
        good: Samples that all axes gave in time, and whose torque was in force; shape (n,).
    """

    period: float
    q: Array
    tau_m: Array
    delay: Array
    good: NDArray[np.bool_]


class Validation(NamedTuple):
    """How well a fit foretells the torques of a motion that it was not made from.

    Attributes:
        rmse: Of the motor torques [N·m at the motor].
        torque: Root mean square of these torques, less what the links' inertia takes [N·m at the motor].
        samples: How many were compared.
    """

    rmse: float
    torque: float
    samples: int


@dataclass(frozen=True, slots=True, eq=False)
class Identified:
    """What one way found.

    Attributes:
        way: Its name.
        unknowns: Names of the values: of `Actuation`, and for the better ways `LOPSIDED`.
        fit: Values, intervals and residuals [N].
        condition_number: Of the rows that were used, columns in the units of `excitation.SCALE`.
        kept: The share of the samples that was used.
        validation: On the other motion.
    """

    way: str
    unknowns: tuple[str, ...]
    fit: Fit
    condition_number: float
    kept: float
    validation: Validation

    @property
    def values(self) -> dict[str, float]:
        """Value by name."""
        return dict(zip(self.unknowns, self.fit.values.tolist(), strict=True))

    @property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """Interval of confidence by name."""
        pairs = zip(self.fit.low.tolist(), self.fit.high.tolist(), strict=True)
        return dict(zip(self.unknowns, pairs, strict=True))


class Prepared(NamedTuple):
    """The equation at the samples of a recording that a way can use.

    Attributes:
        equation: At m instants.
        lopsided: What a torque scale that differs between directions adds, shape (m, 2, 3): force [N] a unit of d.
        position: Of the end-effector, shape (m, 2) [m].
        kept: Which of them are fast and good, shape (m,).
    """

    equation: Equation
    lopsided: Array
    position: Array
    kept: NDArray[np.bool_]


Way = Callable[[Manipulator, Recording], Prepared]


def thesis(model: Manipulator, recording: Recording) -> Prepared:
    """The thesis' way: late derivatives, torque of the same sample, every sample."""
    found = differentiation.causal_window(model, recording.q, recording.period)
    both = equation(model, found.movement, recording.tau_m[found.rows])
    good = _undisturbed(recording.good, 2 * WINDOW - 1, found.rows, causal=True)
    return Prepared(both, np.zeros((len(good), 2, 0)), found.movement.position, good)


def recommended(model: Manipulator, recording: Recording) -> Prepared:
    """Savitzky and Golay's derivatives."""
    found = differentiation.savitzky_golay(model, recording.q, recording.period)
    return _moving_rows(model, recording, found)


def smoothed(model: Manipulator, recording: Recording) -> Prepared:
    """The Rauch-Tung-Striebel smoother's derivatives."""
    noise = differentiation.encoder_floor(model, recording.q)
    found = differentiation.smoothed(model, recording.q, recording.period, noise=noise)
    return _moving_rows(model, recording, found)


WAYS: Final[dict[str, Way]] = {"thesis": thesis, "recommended": recommended, "smoothed": smoothed}


def identify(model: Manipulator, way: str, recording: Recording, validation: Recording) -> Identified:
    """Fit one recording, and foretell another.

    Args:
        model: The manipulator; its own I1, K1 and K2 do not count.
        way: A key of `WAYS`.
        recording: What is fitted.
        validation: What is foretold.

    Returns:
        Values with intervals and figures of merit.

    Raises:
        ValueError: The recording does not determine the unknowns.
        ReachError, SingularPoseError: Joint angles that the mechanism cannot have.
    """
    names = THESIS_UNKNOWNS if way == "thesis" else UNKNOWNS
    rows = WAYS[way](model, recording)
    fit = _fit(rows, len(names))
    if rows.lopsided.size:
        d = fit.values[len(names) :]
        rows = WAYS[way](model, _straightened(recording, d))
        fit = _fit(rows, len(names))  # linear in d about what was found first: nothing is left to find
        fit = fit.shifted(np.concatenate([np.zeros(len(names)), d]))
    return Identified(
        way,
        names + LOPSIDED[: rows.lopsided.shape[2]],
        fit,
        condition_number(rows.equation.Y[rows.kept][..., : len(names)]),
        float(np.sum(rows.kept)) / len(recording.q),
        validate(model, fit.values, validation),
    )


class Foretold(NamedTuple):
    """A motion's torques, less what the links' inertia takes, as measured and as values foretell them.

    Attributes:
        rows: Which samples, shape (m,).
        measured: Motor torques, shape (m, 3) [N·m at the motor].
        foretold: The same.
    """

    rows: NDArray[np.int64]
    measured: Array
    foretold: Array


def foretold(model: Manipulator, values: Array, recording: Recording) -> Foretold:
    """The torques of a motion by values, always with the recommended derivatives: the better measurement.

    Args:
        model: The manipulator.
        values: I1, K1, K2, perhaps Fc and d1, d2, d3.
        recording: The motion.

    Raises:
        ValueError: The motion has no sample that can be used.
    """
    known = len(UNKNOWNS)
    rows = recommended(model, recording if len(values) <= known else _straightened(recording, values[known:]))
    if not rows.kept.any():
        raise ValueError("the validation has no sample in whose window all joints move")
    position, force = rows.position[rows.kept], rows.equation.force[rows.kept]
    by_values = rows.equation.Y[rows.kept][..., : len(values)] @ values[:known]
    measured, expected = (motor_torques(model, position, part) for part in (force, by_values))
    return Foretold(WINDOW // 2 + np.flatnonzero(rows.kept), measured, expected)


def validate(model: Manipulator, values: Array, recording: Recording) -> Validation:
    """How well values foretell a motion; as `foretold`."""
    seen = foretold(model, values, recording)
    return Validation(_rms(seen.foretold - seen.measured), _rms(seen.measured), len(seen.rows))


def _fit(rows: Prepared, unknowns: int) -> Fit:
    columns = np.concatenate([rows.equation.Y[..., :unknowns], rows.lopsided], axis=2)
    return least_squares_in_time(columns, rows.equation.force, rows.kept, lags=LAGS)


def _straightened(recording: Recording, d: Array) -> Recording:
    """The recording with the torques that the axes gave, if their slopes are 1 - d and 1 + d of the average."""
    return replace(recording, tau_m=recording.tau_m / (1.0 - d * np.sign(recording.tau_m)))


def _moving_rows(model: Manipulator, recording: Recording, found: Kinematics) -> Prepared:
    """The equation with torques averaged as the acceleration is, the slow and the bad samples marked."""
    tau, size = (
        differentiation.acting_torque(part, recording.period, recording.delay, found.weights)[found.rows]
        for part in (recording.tau_m, np.abs(recording.tau_m))
    )
    both = equation(model, found.movement, tau)
    S = np.array([model.jacobians(x)[1] for x in found.movement.position])
    good = _undisturbed(recording.good, WINDOW, found.rows, causal=False)
    return Prepared(
        both,
        -model.gear_ratio * np.transpose(S * size[:, :, None], (0, 2, 1)),
        found.movement.position,
        good & moving(both.rates, WINDOW),
    )


def _undisturbed(good: NDArray[np.bool_], window: int, rows: slice, *, causal: bool) -> NDArray[np.bool_]:
    """Samples in whose window, and the one before it, whose torque still acts, all are good; shape of `rows`."""
    bad = np.concatenate([[0], np.cumsum(~good)])
    k = np.arange(len(good))[rows]
    first = np.maximum(k - (window if causal else window // 2 + 1), 0)
    last = np.minimum(k + (0 if causal else window // 2), len(good) - 1)
    untouched: NDArray[np.bool_] = bad[last + 1] == bad[first]
    return untouched


def _rms(values: Array) -> float:
    return math.sqrt(float(np.mean(values**2))) if values.size else math.nan
