"""Rigs whose truth is varied by a seed, a procedure on each over the simulated wire, and what it found."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from torquerig.calibrating.catalogue import offer
from torquerig.calibrating.conducting import perform
from torquerig.calibrating.offer import Request
from torquerig.calibrating.task import Task
from torquerig.calibration.procedure import Result, Unwatched
from torquerig.configuration import load_configuration

WIRED: Final = "simulator.installation."
GAINS: Final = {"positive": 20670.0, "negative": 19528.0}


class Found(NamedTuple):
    """A value beside its truth.

    Attributes:
        name: What it is.
        value: What was found.
        low: Begin of its interval; NaN where it has none.
        high: Its end.
        truth: What is true.
    """

    name: str
    value: float
    low: float
    high: float
    truth: float

    @property
    def is_covered(self) -> bool:
        """Whether the interval holds the truth."""
        return self.low <= self.truth <= self.high


@dataclass(frozen=True)
class Trial:
    """A procedure on a rig.

    Attributes:
        name: The procedure.
        keys: What is true of the rig, as keys of the configuration.
        options: The procedure's own options.
        compare: What it found beside the truth.
        seed: Of the procedure's chance.
    """

    name: str
    keys: dict[str, Any]
    options: dict[str, Any]
    compare: Callable[[Result, dict[str, Any]], Iterator[Found]]
    seed: int

    def run(self) -> list[Found]:
        """Carry it out over the simulated wire."""
        made = offer(self.name)
        configuration = load_configuration(options=self.keys)
        defaults = {each.name.replace("-", "_"): each.default for each in made.options}
        request = Request(None, defaults | self.options)
        result, _ = perform(Task.prepare(self.name, made, configuration, request), Unwatched(), seed=self.seed)
        return list(self.compare(result, dict(made.truth(configuration, request))))


def known_gains() -> dict[str, Any]:
    """The drives' true scale, as the torque procedure would have found it."""
    return {f"axes.{leg}.counts_per_nm_{way}": gain for leg in (1, 2, 3) for way, gain in GAINS.items()}


def direction(seed: int) -> Trial:
    """One or two mistakes, or none, on a plant with dry friction or without it."""
    rng = np.random.default_rng([1, seed])
    plant = ("fitted", "identified", "ideal")[seed // 3 % 3]
    # without dry friction no torque rises to where a coupling gives way: see docs/calibration.md
    kinds = [kind for kind in MISTAKES if kind != "slip" or plant == "fitted"]
    chosen = rng.choice(len(kinds), size=seed % 3, replace=False)
    friction = rng.uniform(0.8, 3.0, 3).tolist()
    keys: dict[str, Any] = {
        "simulator.plant": plant,
        "plant.fitted.coulomb": friction,
        "plant.fitted.breakaway": friction,
    }
    words: list[str] = []
    for kind in sorted(kinds[each] for each in chosen):
        fault, told = MISTAKES[kind](int(rng.integers(3)))
        keys |= {WIRED + key: value for key, value in fault.items()}
        words.append(told)

    def compare(result: Result, _truth: dict[str, Any]) -> Iterator[Found]:
        sets = result.facts.get("could_be") or [result.facts["faults"]]
        named = any(
            len(told) == len(words) and all(any(word in each for each in told) for word in words) for told in sets
        )
        yield Found("+".join(words) or "no mistake", float(named), np.nan, np.nan, 1.0)

    return Trial("direction", keys, {"rate": 0.4}, compare, seed)


def _flipped(axis: int) -> list[int]:
    return [-1 if each == axis else 1 for each in range(3)]


def _with(axis: int, value: float, others: float) -> list[float]:
    return [value if each == axis else others for each in range(3)]


def _swapped(axis: int) -> tuple[list[int], str]:
    order = [1, 2, 3]
    one, other = axis, (axis + 1) % 3
    order[one], order[other] = order[other], order[one]
    return order, f"axes {min(one, other) + 1} and {max(one, other) + 1} are swapped"


MISTAKES: Final[dict[str, Callable[[int], tuple[dict[str, Any], str]]]] = {
    "encoder sign": lambda axis: ({"encoder_sign": _flipped(axis)}, f"axis {axis + 1}: wrong encoder sign"),
    "swap": lambda axis: (
        {"motors": _swapped(axis)[0], "encoders": _swapped(axis)[0]},
        _swapped(axis)[1],
    ),
    "gear": lambda axis: ({"gear_factor": _with(axis, 1.06, 1.0)}, "it shows 1.0"),
    "slip": lambda axis: (
        {"coupling": _with(axis, 0.05, 1e3)},
        f"axis {axis + 1}: its motor turns and the joint does not",
    ),
    "torque sign": lambda axis: ({"torque_sign": _flipped(axis)}, "wrong torque sign"),
}


def home(seed: int) -> Trial:
    """A fixture that is up to 2 mm off."""
    way = np.random.default_rng([2, seed]).uniform(-1.5e-3, 1.5e-3, 2)
    keys = {"simulator.stands_at": [0.092 + float(way[0]), 0.062 + float(way[1])]}

    def compare(result: Result, truth: dict[str, Any]) -> Iterator[Found]:
        yield Found("residual [um]", result.facts["residual_um"], np.nan, np.nan, truth["residual_um"])

    return Trial("home", keys, {}, compare, seed)


def latency(seed: int) -> Trial:
    """Drives that are quick or slow."""
    rng = np.random.default_rng([3, seed])
    reaction, sample, lag = rng.uniform(3e-5, 2e-4), rng.uniform(1e-5, 1e-4), rng.uniform(6e-5, 2e-4)
    keys = {"drive.reaction": float(reaction), "drive.sample": float(sample), "plant.fitted.current_lag": float(lag)}

    def compare(result: Result, truth: dict[str, Any]) -> Iterator[Found]:
        for name in ("sample_us", "reaction_us", "current_lag_us"):
            yield Found(
                f"{name[:-3]} [us]", *(result.facts[name][part] for part in ("value", "low", "high")), truth[name]
            )
        for axis in result.facts["axes"]:
            found = axis["delay_us"]
            delay = truth["reaction_us"] + 95.0 * axis["axis"]  # a command of 95 bits, and those before it
            yield Found("delay of an axis [us]", found["value"], found["low"], found["high"], delay)

    return Trial("latency", keys, {}, compare, seed)


def stiction(seed: int) -> Trial:
    """Joints with unlike friction, the torque scale known."""
    friction = np.random.default_rng([4, seed]).uniform(1.0, 1.8, 3).tolist()
    keys = known_gains() | {"plant.fitted.coulomb": friction, "plant.fitted.breakaway": friction}

    def compare(result: Result, truth: dict[str, Any]) -> Iterator[Found]:
        for axis, true in zip(result.facts["axes"], truth["motor_nm"], strict=True):
            for side in ("positive", "negative"):
                found = axis[side]
                yield Found("friction [N·m]", found["motor_nm"], found["low"], found["high"], true)

    return Trial("stiction", keys, {"repeats": 3, "rate": 0.03}, compare, seed)


def zeros(seed: int) -> Trial:
    """A fixture that is up to 2 mm off."""
    way = np.random.default_rng([5, seed]).uniform(-1.5e-3, 1.5e-3, 2)
    keys = {"simulator.stands_at": [0.092 + float(way[0]), 0.062 + float(way[1])]}

    def compare(result: Result, truth: dict[str, Any]) -> Iterator[Found]:
        values, ends = result.facts["zeros_deg"], result.facts["intervals_deg"]
        for value, (low, high), true in zip(values, ends, truth["zeros_deg"], strict=True):
            yield Found("zero [deg]", value, low, high, true)

    return Trial("zeros", keys, {}, compare, seed)


def identify(seed: int) -> Trial:
    """Actuators 30 % about the thesis', torque slopes that differ by up to 6 %, latency known."""
    rng = np.random.default_rng([6, seed])
    scale, d = rng.uniform(0.7, 1.3, 4), float(rng.uniform(-0.03, 0.03))
    reaction, lag = float(rng.uniform(3e-5, 2e-4)), float(rng.uniform(6e-5, 2e-4))
    coulomb = [float(1.64 * scale[3])] * 3
    keys = {
        "plant.fitted.actuator_inertia": float(0.0289 * scale[0]),
        "plant.fitted.active_viscous": float(0.8315 * scale[1]),
        "plant.fitted.passive_viscous": float(0.0938 * scale[2]),
        "plant.fitted.coulomb": coulomb,
        "plant.fitted.breakaway": coulomb,
        "drive.gain_positive": 20100.0 * (1.0 + d),
        "drive.gain_negative": 20100.0 * (1.0 - d),
        "drive.reaction": reaction,
        "latency.reaction": reaction,
        "plant.fitted.current_lag": lag,
        "latency.current_lag": lag,
    }

    def compare(result: Result, truth: dict[str, Any]) -> Iterator[Found]:
        for name, true in truth.items():
            low, high = result.facts["intervals"][name]
            yield Found(
                f"{name} [% of the truth]",
                *(100 * v / true for v in (result.facts["recommended"][name], low, high)),
                100.0,
            )

    return Trial("identify", keys, {}, compare, seed)


TRIALS: Final[dict[str, Callable[[int], Trial]]] = {
    "direction": direction,
    "home": home,
    "latency": latency,
    "stiction": stiction,
    "zeros": zeros,
    "identify": identify,
}
