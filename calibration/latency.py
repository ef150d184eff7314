"""The latency procedure: from SYNC to TPDO and from RPDO to torque, over the wire only."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration.conductor import SECOND_NS, Conductor
from torquerig.calibration.latency_fit import (
    Interval,
    Response,
    Times,
    fit_response,
    latch_wait,
    mean_interval,
    mean_of,
    median_interval,
)
from torquerig.calibration.procedure import Bounds, Column, Doubt, Estimate, Plan, Result, Start, Table, Verdict
from torquerig.driver.wire.frame import worst_case_bits

Vector = NDArray[np.float64]

_SYNC_BITS: Final = worst_case_bits(0)
_EARLIEST: Final = 1.2e-3  # [s] before SYNC: well before any drive's delay and lag are over
_TRAVEL: Final = 0.1  # [rad]: the torques change sign and average to nothing
_SPEED: Final = 3.0  # [rad/s]: 0.01 N·m without dry friction gives 0.03 in a cycle
_MICRO: Final = 1e6


class Steps(NamedTuple):
    """What was measured, n steps.

    Attributes:
        before: How long before the SYNC each step was commanded, shape (n,) [s].
        share: Which share of it each drive's torque had made by the SYNC, shape (n, axes).
        answers: From SYNC to each drive's TPDO, shape (m, axes) [s].
    """

    before: Vector
    share: Vector
    answers: Vector


class Drawing(NamedTuple):
    """What the figure shows.

    Attributes:
        steps: What was measured.
        x: From command to sample, shape (n,) [s].
        responses: Of each axis; None where nothing rose.
    """

    steps: Steps
    x: Vector
    responses: tuple[Response | None, ...]


@dataclass(frozen=True, slots=True)
class LatencyProcedure:
    """Steps of torque at many times before SYNC.

    Attributes:
        torque: Height of the steps, half of it to each side [N·m at the motor].
        steps: How many.
        bitrate: Of the bus [bit/s].
        acts_at_sync: Whether RPDOs act at the next SYNC (transmission type 1), not on reception.
        axes: Which ones are reported, from 1.
        places: How many commands of other drives go over the wire before that of each axis.
        name: As the command line calls it.
        start: Positions need no meaning.
    """

    torque: float
    steps: int
    bitrate: int
    acts_at_sync: bool
    axes: tuple[int, ...]
    places: tuple[int, ...]
    name: str = "latency"
    start: Start = Start.ENABLED

    def plan(self) -> Plan:
        """Small steps, too small to move anything."""
        return Plan(
            "Latency: from SYNC to TPDO, and from RPDO to torque",
            ("The machine stands free; it need not be homed.",),
            (
                f"All motors get {self.torque:g} N·m to and fro, {self.steps} times: too little to overcome friction.",
                f"Each step is sent up to {1e3 * _EARLIEST:g} ms before a SYNC, which catches it on its way.",
            ),
            Bounds(torque=self.torque, speed=_SPEED, travel=_TRAVEL, duration=10.0 + self.steps * 0.1),
            lasts=self.steps * 0.008,
        )

    def measure(self, conductor: Conductor) -> Steps:
        """All steps, each followed by a cycle in which its torque settles."""
        heard: dict[int, int] = {}
        period_ns = conductor.period_ns
        before, share, answers = [], [], []
        pattern = np.full(conductor.axes, self.torque)
        # one step in each of as many equal parts of the time, so that a few are enough
        parts = (conductor.rng.permutation(self.steps) + conductor.rng.uniform(size=self.steps)) / self.steps
        conductor.say("steps of torque")
        with _listening(conductor, heard):
            due_ns = conductor.now_ns() + period_ns // 2
            sample = conductor.sample(due_ns)
            last = sample.torque
            for number in range(2 * self.steps):
                target = pattern if (number // 2) % 2 else -pattern
                ahead_ns = round(parts[number // 2] * _EARLIEST * SECOND_NS) if number % 2 == 0 else period_ns
                due_ns = sample.at_ns + period_ns
                conductor.command(target, due_ns - ahead_ns)
                sent_ns = conductor.now_ns()
                heard.clear()
                sample = conductor.sample(due_ns)
                # commands that go out just before a SYNC delay it on the wire
                if number % 2 and len(heard) == conductor.axes:
                    answers.append([(heard[place] - sample.at_ns) / SECOND_NS for place in range(conductor.axes)])
                if number % 2 == 0:
                    caught, before_step = sample.torque, last
                    before.append((sample.at_ns - sent_ns) / SECOND_NS)
                else:
                    share.append(_shares(caught - before_step, sample.torque - before_step))
                    last = sample.torque
        return Steps(np.array(before), np.array(share), np.array(answers))

    def evaluate(self, measured: Steps) -> Result:
        """Delay and lag of each axis, and how fast they answer."""
        count = measured.share.shape[1]
        x = measured.before + self._sync + latch_wait(measured.before, self._command, count)
        # the first step starts from rest, not from the other side
        responses = tuple(fit_response(x[1:], measured.share[1:, place]) for place in range(count))
        answers = [mean_interval(measured.answers[:, place]) for place in range(count)]
        rows = tuple(_answer_rows(answers, self.axes))
        drawing = Drawing(measured, x, responses)
        found = {axis: response for axis in self.axes if (response := responses[axis - 1]) is not None}
        if len(found) < len(self.axes):
            return Result(
                Verdict.of(failures=[self._no_rise(axis) for axis in self.axes if axis not in found]),
                estimates=rows,
                facts={"axes": [{"axis": axis, "answer_us": _us(answers[axis - 1])} for axis in self.axes]},
                drawing=drawing,
            )
        times = self._times(measured, found)
        return Result(
            Verdict.of(suspicions=[*_suspicions(found), *_too_early(times.reaction.value, self.bitrate)]),
            estimates=(*rows, *_response_rows(found), *times.rows()),
            settings={key: max(interval.value, 0.0) for key, interval in times.by_key().items()},
            facts=self._facts(answers, found) | {f"{name}_us": _us(each) for name, each in times._asdict().items()},
            tables=(_table(measured, x),),
            drawing=drawing,
        )

    @property
    def _sync(self) -> float:
        """Time of SYNC on the wire [s]."""
        return _SYNC_BITS / self.bitrate

    @property
    def _command(self) -> float:
        """Time of one axis' command on the wire [s]."""
        return worst_case_bits(4) / self.bitrate

    def _before(self, axis: int) -> float:
        """From handing the commands over until an axis has heard its own [s]: those before it, and its own."""
        return (self.places[axis - 1] + 1) * self._command

    def _times(self, measured: Steps, found: dict[int, Response]) -> Times:
        """What the drives need, as their mean; the quickest to answer is not kept from it by the others' TPDOs."""
        quickest = measured.answers[:, int(np.argmin(np.median(measured.answers, axis=0)))]
        wire = self._sync + worst_case_bits(8) / self.bitrate
        return Times(
            median_interval(quickest).shifted(-wire),
            mean_of([each.delay.shifted(-self._before(axis)) for axis, each in found.items()]),
            mean_of([each.lag for each in found.values()]),
        )

    def _facts(self, answers: list[Interval], found: dict[int, Response]) -> dict[str, Any]:
        """Each axis for JSON."""
        return {
            "axes": [
                {
                    "axis": axis,
                    "answer_us": _us(answers[axis - 1]),
                    "delay_us": _us(response.delay),
                    "lag_us": _us(response.lag),
                    "reaction_us": _MICRO * (response.delay.value - self._before(axis)),
                }
                for axis, response in found.items()
            ]
        }

    def _no_rise(self, axis: int) -> Doubt:
        """Why nothing rose within the time before SYNC."""
        if self.acts_at_sync:
            return Doubt(
                f"axis {axis}: its torque changes at the next SYNC (loop.rpdo_type = 1): the delay is one period",
                "Set loop.rpdo_type = 255 to measure what the drive itself needs.",
            )
        return Doubt(
            f"axis {axis}: no torque follows within {1e3 * _EARLIEST:g} ms",
            "See whether the drive's torque slope (6087) is too low, or it takes more than a cycle.",
        )


def _shares(caught: Vector, step: Vector) -> Vector:
    """Which share of each axis' step was caught; 0 where there was no step."""
    shares: Vector = np.divide(caught, step, out=np.zeros_like(step), where=np.abs(step) > 0.0)
    return shares


@contextmanager
def _listening(conductor: Conductor, heard: dict[int, int]) -> Iterator[None]:
    """Note when each axis' TPDO arrives, by its place."""
    handlers = conductor.group.session.pump.handlers
    kept = {axis.tpdo_cob: handlers[axis.tpdo_cob] for axis in conductor.group.axes}

    def noting(place: int, handler: Callable[[int, bytes], None]) -> Callable[[int, bytes], None]:
        def hear(at_ns: int, data: bytes) -> None:
            heard.setdefault(place, at_ns)
            handler(at_ns, data)

        return hear

    for place, (cob_id, handler) in enumerate(kept.items()):
        handlers[cob_id] = noting(place, handler)
    try:
        yield
    finally:
        handlers.update(kept)


def _suspicions(found: dict[int, Response]) -> Iterator[Doubt]:
    """Delays that are known badly, or cannot be."""
    for axis, response in found.items():
        width = response.delay.high - response.delay.low
        if width > 0.5 * _EARLIEST:
            yield Doubt(f"axis {axis}: its delay is known to {_MICRO * width:.0f} µs only", "Repeat with more --steps.")
        if response.delay.value < 0.0:
            yield Doubt(
                f"axis {axis}: torque comes {-_MICRO * response.delay.value:.0f} µs before its command",
                "See whether the bus' time stamps are those of this machine's clock.",
            )


def _too_early(reaction: float, bitrate: int) -> Iterator[Doubt]:
    """Commands that act before the wire can have brought them."""
    if reaction < 0.0:
        yield Doubt(
            f"torque comes {-_MICRO * reaction:.0f} µs before commands can have crossed a wire of {bitrate} bit/s",
            "Set bus.bitrate right; a bus without bit times (unix:, vcan) tells nothing of the drives' reaction.",
        )


def _answer_rows(answers: list[Interval], axes: tuple[int, ...]) -> Iterator[Estimate]:
    for axis in axes:
        answer = answers[axis - 1]
        low, high = (_MICRO * end for end in (answer.low, answer.high))
        yield Estimate(f"axis {axis}: SYNC to TPDO", _MICRO * answer.value, low, high, "µs")


def _response_rows(found: dict[int, Response]) -> Iterator[Estimate]:
    for axis, response in found.items():
        for words, (value, low, high) in (("RPDO to torque", response.delay), ("current lag", response.lag)):
            yield Estimate(f"axis {axis}: {words}", _MICRO * value, _MICRO * low, _MICRO * high, "µs")


def _us(interval: Interval) -> dict[str, Any]:
    """An interval in microseconds for JSON; ends that are unknown are null."""
    return {
        name: None if np.isnan(value) else _MICRO * value
        for name, value in zip(("value", "low", "high"), interval, strict=True)
    }


def _table(steps: Steps, x: Vector) -> Table:
    columns = [Column("before", "s", steps.before), Column("x", "s", x)]
    columns += [Column(f"share_{axis}", "1", values) for axis, values in enumerate(steps.share.T, start=1)]
    return Table("steps", tuple(columns))
