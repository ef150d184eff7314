"""What the thesis found (6.2 and 6.5), each finding judged on the runs of one plant: a verdict and its number.

The bounds are the thesis' words or numbers; nothing here depends on what comes out.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from statistics import fmean
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from torquerig.control.comparison import published_runs
from torquerig.control.components import TorqueComponents
from torquerig.control.log import LoopLog
from torquerig.control.tracking import rms
from torquerig.experiment import Outcome
from torquerig.mechanism import Manipulator
from torquerig.reproduction.experiments import (
    MODEL_BASED_LAWS,
    MOTIONS,
    PD_LAWS,
    THESIS_LAWS,
    PlantRuns,
)
from torquerig.reproduction.torques import at_constant_velocity, dry_and_viscous
from torquerig.reproduction.verdicts import Claim, Finding
from torquerig.summary import Summary
from torquerig.torque_parts import measured_components, recorded_torque, reference_components

PEAK_TORQUE: Final = {1: (0.2, 0.45), 2: (0.2, 0.5)}
"""Between what the greatest torque of a run lies, motion by motion [N·m at the motor] (Figures 6.9 and 6.10)."""
CORIOLIS_SHARE: Final = 0.05
"""What counts as insignificant (6.2) here: our choice."""
_PUBLISHED: Final = {(run.law, run.motion): run.position_rmse_mm for run in published_runs()}

Part = TypeVar("Part")
Errors = Mapping[tuple[str, int], float]
"""Position RMSE by law and motion [mm]."""


def findings(plant: PlantRuns) -> tuple[Finding, ...]:
    """Judge every finding of the thesis on its own four laws.

    Args:
        plant: The runs on one plant.

    Returns:
        The findings, those of one claim side by side.
    """
    errors = {(run.law, run.motion): run.summary.position_rmse_mm for run in plant.runs if run.summary is not None}
    judged = [*_model_based_gain(errors), *_alike(errors)]
    for motion in MOTIONS:
        summaries = _of_thesis_laws(plant, motion, lambda outcome: outcome.summary)
        logs = _of_thesis_laws(plant, motion, lambda outcome: outcome.log)
        judged += [_less_torque(motion, summaries), _peak(motion, summaries, _true_peaks(plant, motion))]
        judged += [*_parts(plant.model, motion, logs), _contrast(plant.model, motion, logs)]
    order = list(dict.fromkeys(finding.key for finding in judged))
    return tuple(sorted(judged, key=lambda finding: order.index(finding.key)))


def _of_thesis_laws(plant: PlantRuns, motion: int, part: Callable[[Outcome], Part]) -> dict[str, Part]:
    """A part of what each of the thesis' laws left; nothing if one of them was stopped."""
    outcomes = {run.law: run.outcome for run in plant.of(motion) if run.law in THESIS_LAWS}
    parts = {law: part(outcome) for law, outcome in outcomes.items() if outcome is not None}
    return parts if len(parts) == len(THESIS_LAWS) else {}


def _model_based_gain(errors: Errors) -> Iterator[Finding]:
    """Model-based laws beat PD, more so in the fast motion."""
    ours, theirs = ({motion: _gain(each, motion) for motion in MOTIONS} for each in (errors, _PUBLISHED))
    measure = "mean position RMSE of the two PD laws over that of the two model-based laws"
    for motion in MOTIONS:
        claim = "Model-based control tracks more accurately than PD control."
        yield Claim(
            "model-based-beats-pd", claim, motion, measure, "1", "above 1", lambda gain: gain > 1.0, theirs[motion]
        ).judged(ours[motion])
    yield Claim(
        "gain-greater-in-fast-motion",
        "The improvement is greater in the fast motion.",
        None,
        "that ratio in motion 2 over motion 1",
        "1",
        "above 1",
        lambda growth: growth > 1.0,
        _over(theirs[2], theirs[1]),
    ).judged(_over(ours[2], ours[1]))


def _alike(errors: Errors) -> Iterator[Finding]:
    """The laws of a pair perform alike: not further apart than the thesis' own pairs."""
    pairs = {
        "model-based-laws-alike": (MODEL_BASED_LAWS, "Computed torque and augmented PD perform similarly."),
        "pd-laws-alike": (PD_LAWS, "Decoupled and coupled PD perform nearly the same."),
    }
    widest = max(_apart(_PUBLISHED, pair) or 0.0 for pair, _ in pairs.values())
    for key, (pair, claim) in pairs.items():
        measure = "greater position RMSE of the two over the lesser, the motion where they are further apart"
        bound = f"at most {widest:.2f}, the thesis' widest pair"
        theirs = _apart(_PUBLISHED, pair)
        yield Claim(key, claim, None, measure, "1", bound, lambda apart: apart <= widest, theirs).judged(
            _apart(errors, pair)
        )


def _less_torque(motion: int, summaries: Mapping[str, Summary]) -> Finding:
    """Coupled PD takes less torque than decoupled PD."""
    rms_torques = {law: summary.rms_torque_nm for law, summary in summaries.items()}
    return Claim(
        "coupled-pd-takes-less-torque",
        "Coupled PD takes less torque than decoupled PD.",
        motion,
        "rms torque of coupled PD over that of decoupled PD",
        "1",
        "below 1",
        lambda ratio: ratio < 1.0,
    ).judged(_over(rms_torques.get("coupled-pd"), rms_torques.get("decoupled-pd")))


def _true_peaks(plant: PlantRuns, motion: int) -> dict[str, float]:
    """By law, what its greatest recorded torque was in truth [N·m]."""
    return {run.law: peak for run in plant.of(motion) if (peak := run.true_peak_torque_nm) is not None}


def _peak(motion: int, summaries: Mapping[str, Summary], in_truth: Mapping[str, float]) -> Finding:
    """Peaks lie where the thesis' do: judged on the peak nearest to an end of the range, or furthest outside."""
    low, high = PEAK_TORQUE[motion]
    peaks = [(summary.peak_torque_nm, law) for law, summary in summaries.items()]
    peak, law = min(peaks, key=lambda peak: min(peak[0] - low, high - peak[0]), default=(None, ""))
    truth = in_truth.get(law)
    note = "" if truth is None else f"as the driver counts; {truth:.3g} N·m by the drive's own gain"
    return Claim(
        "peak-torque",
        "The peak torques lie in the range of the thesis' figures.",
        motion,
        "peak torque of the law that comes nearest to an end of the range, or lies furthest outside",
        "N·m",
        f"{low:g} to {high:g}",
        lambda peak: low <= peak <= high,
    ).judged(peak, law, note)


def _parts(model: Manipulator, motion: int, logs: Mapping[str, LoopLog]) -> Iterator[Finding]:
    """What the torque is made of: along the reference, as the thesis parted it, and along what was measured."""
    coriolis = Claim(
        "coriolis-insignificant",
        "Coriolis and centrifugal torque is insignificant.",
        motion,
        "its rms torque over that of the total, along the reference and the measured motions; the greatest",
        "1",
        f"below {CORIOLIS_SHARE:g}",
        lambda share: share < CORIOLIS_SHARE,
    )
    friction = Claim(
        "friction-dominates-at-constant-velocity",
        "At constant velocity friction dominates the torque.",
        motion,
        "rms torque of the model's friction over that of inertia and Coriolis terms, along the reference",
        "1",
        "above 1",
        lambda ratio: ratio > 1.0,
        of_model=True,
    )
    measured = friction._replace(
        key="friction-dominates-as-measured",
        measure="the same along the measured motions, while the reference's velocity is constant; the least",
        of_model=False,
    )
    along = {law: measured_components(model, log) for law, log in logs.items()}
    steady = {law: at_constant_velocity(log) for law, log in logs.items()}
    reference = [reference_components(model, log) for log in logs.values()][:1]
    shares = [(parts.share.coriolis, law) for law, parts in along.items()]
    yield coriolis.judged(*max([*shares, *((parts.share.coriolis, "") for parts in reference)], default=(None, "")))
    yield friction.judged(min((_dominance(reference[0], rows) for rows in steady.values()), default=None))
    yield measured.judged(*min(((_dominance(along[law], steady[law]), law) for law in along), default=(None, "")))


def _dominance(parts: TorqueComponents, rows: NDArray[np.bool_]) -> float:
    """Friction's torque, viscous and the thesis' stiction, over what inertia and Coriolis terms take, in some rows."""
    return rms(dry_and_viscous(parts)[rows]) / rms((parts.inertia + parts.coriolis)[rows])


def _contrast(model: Manipulator, motion: int, logs: Mapping[str, LoopLog]) -> Finding:
    """The model explains the torque worse while the velocity is constant.

    Judged on the motion that was measured: against the reference's torque, a machine that follows late or swings would
    count as an error of the model. Position and torque are those of one row (`recorded_torque`).
    """
    claim = Claim(
        "model-worse-at-constant-velocity",
        "The model explains the recorded torque worse while the velocity is constant.",
        motion,
        "rms(recorded torque - the model's along the measured motion) / rms(recorded torque) of all four laws, while"
        " the reference's velocity is constant over elsewhere",
        "1",
        "above 1",
        lambda ratio: ratio > 1.0,
    )
    if not logs:
        return claim.judged(None)
    recorded = np.concatenate([recorded_torque(log) for log in logs.values()])
    modelled = np.concatenate([measured_components(model, log).total for log in logs.values()])
    steady = np.concatenate([at_constant_velocity(log) for log in logs.values()])
    at_constant, elsewhere = (rms((recorded - modelled)[rows]) / rms(recorded[rows]) for rows in (steady, ~steady))
    return claim.judged(at_constant / elsewhere if elsewhere else None)


def _gain(errors: Errors, motion: int) -> float | None:
    """Mean error of the PD laws over that of the model-based ones; None if one is missing."""
    means = [_mean(errors, laws, motion) for laws in (PD_LAWS, MODEL_BASED_LAWS)]
    return _over(*means)


def _mean(errors: Errors, laws: Sequence[str], motion: int) -> float | None:
    """Mean error of some laws; None if one is missing."""
    values = [errors[law, motion] for law in laws if (law, motion) in errors]
    return fmean(values) if len(values) == len(laws) else None


def _apart(errors: Errors, pair: Sequence[str]) -> float | None:
    """The greater error of two laws over the lesser, in the motion where they are further apart."""
    both = [[errors[law, motion] for law in pair if (law, motion) in errors] for motion in MOTIONS]
    if any(len(values) < len(pair) for values in both):
        return None
    return max(max(values) / min(values) for values in both)


def _over(above: float | None, below: float | None) -> float | None:
    """A quotient; None without both of its parts."""
    return None if above is None or below is None else above / below
