"""The machine as a procedure's script sees it: the joints within the bounds that were agreed, and a notebook.

A conductor satisfies `control.joints.Joints`, so that `run_loop` can be run over it too.
"""

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from torquerig.calibration.notebook import Notebook, Trace
from torquerig.calibration.procedure import Bounds, Unwatched, Watcher
from torquerig.control.errors import LimitExceeded
from torquerig.driver.master.group import AxisGroup
from torquerig.driver.master.samples import AxisSample, RawSample

SECOND_NS: Final = 1_000_000_000
STILL: Final = 0.06
"""How long a joint must not move to be at rest [s]: at least one count in it would be 0.0005 rad/s."""
_COUNT: Final = 1.5  # [counts] one is the encoder's flicker
_ROUNDING: Final = 1e-9  # a torque at its bound is within it, however it was computed

Vector = NDArray[np.float64]


class Moment(NamedTuple):
    """A cycle of a script.

    Attributes:
        t: Time since the stretch began [s], a multiple of the period unless cycles were lost.
        q: Joint angles, shape (n,) [rad].
        qd: Joint rates by the last two samples, shape (n,) [rad/s].
        torque: Actual motor torques, shape (n,) [N·m at the motor].
    """

    t: float
    q: Vector
    qd: Vector
    torque: Vector


Script = Callable[[Moment], Vector | None]
"""Motor torques for a cycle, shape (n,) [N·m at the motor]; None ends the stretch."""


class Conductor:
    """Leads the drives through a script.

    Every sample is held against `bounds.travel`, `speed` and `duration`, every command against `bounds.torque`; beyond
    them nothing is commanded and LimitExceeded ends the procedure.

    Attributes:
        group: The drives, for what is not cyclic: `read`, `write`, `home`, `enable`, `wait`.
        bounds: What was agreed.
        period_ns: From SYNC to SYNC [ns].
        rng: The script's chance; the same seed, the same procedure.
        notebook: Every cycle so far.
    """

    def __init__(
        self,
        group: AxisGroup,
        bounds: Bounds,
        *,
        period_ns: int,
        seed: int = 0,
        lasts: float | None = None,
        watcher: Watcher | None = None,
    ) -> None:
        """Begin with an empty notebook.

        Args:
            group: The drives, entered.
            bounds: What was agreed.
            period_ns: From SYNC to SYNC [ns].
            seed: Of `rng`.
            lasts: How long the script is expected to last [s]; None: as long as it may.
            watcher: Is told how far it is.
        """
        self.group: Final = group
        self.bounds: Final = bounds
        self.period_ns: Final = period_ns
        self.rng: Final = np.random.default_rng(seed)
        self.notebook: Final = Notebook(len(group.axes))
        self._watcher = watcher or Unwatched()
        self._lasts_ns = SECOND_NS * (bounds.duration if lasts is None else lasts)
        self._words = ""
        self._began_ns: int | None = None
        self._first: Vector | None = None
        self._last: tuple[int, Vector] | None = None
        self._rates = np.zeros(len(group.axes))

    @property
    def axes(self) -> int:
        """How many axes there are."""
        return len(self.group.axes)

    def now_ns(self) -> int:
        """The bus clock [ns]."""
        return self.group.now_ns()

    def drive(self, words: str, seconds: float, script: Script) -> Trace:
        """Run a stretch of cycles, each a sample and the script's torques for it; then command zero torque.

        Args:
            words: What is being done, for the progress and the notebook.
            seconds: The longest that it lasts [s].
            script: Torques for a moment, or None to end early; it has to be quick.

        Returns:
            The cycles of the stretch.

        Raises:
            LimitExceeded: A bound was met.
            ValueError: A torque is not a number.
            DriveFault, NoAnswer, SecondMaster, BusError: As in `AxisGroup.sample`.
        """
        self.say(words)
        stretch = self.notebook.begin(words)
        start_ns = self.now_ns() + self.period_ns // 2
        due_ns = start_ns
        while True:
            sample = self.sample(due_ns)
            t = (sample.at_ns - start_ns) / SECOND_NS
            wanted = script(Moment(t, sample.q, self._rates, sample.torque)) if t < seconds else None
            self.command(np.zeros(self.axes) if wanted is None else wanted, self.now_ns())
            if wanted is None:
                return stretch.trace()
            due_ns = max(due_ns + self.period_ns, sample.at_ns + self.period_ns // 2)

    def rest(self, words: str, seconds: float) -> Trace:
        """A stretch of cycles at zero torque; see `drive`."""
        zero = np.zeros(self.axes)
        return self.drive(words, seconds, lambda _: zero)

    def settle(self, words: str = "settling", *, most: float = 1.0) -> Trace:
        """A stretch at zero torque until no joint has moved by more than a count for `STILL` seconds.

        Args:
            words: As in `drive`.
            most: The longest that it lasts [s]; a machine without dry friction may never be still.
        """
        zero = np.zeros(self.axes)
        steps = np.array([abs(axis.scale.rad_per_count) for axis in self.group.axes if axis.scale is not None])
        anchor: list[tuple[float, Vector]] = []

        def script(now: Moment) -> Vector | None:
            if not anchor or (np.abs(now.q - anchor[0][1]) > _COUNT * steps).any():
                anchor[:] = [(now.t, now.q)]
            return zero if now.t - anchor[0][0] < STILL else None

        return self.drive(words, most, script)

    def say(self, words: str) -> None:
        """Tell the watcher what is being done now."""
        self._words = words
        self._tell()

    def sample(self, due_ns: int) -> AxisSample:
        """Wait until `due_ns`, SYNC, and return all axes, held against the bounds; see `AxisGroup.sample`."""
        sample = self.group.sample(due_ns)
        self._check(sample.at_ns, sample.q)
        self.notebook.sampled(sample)
        return sample

    def sample_raw(self, due_ns: int) -> RawSample:
        """As `sample`, in the drives' own counts; the notebook has it in SI units."""
        raw = self.group.sample_raw(due_ns)
        scales = [axis.scale for axis in self.group.axes]
        q = [scale.angle(int(n)) for scale, n in zip(scales, raw.positions, strict=True) if scale is not None]
        torque = [scale.torque(int(n)) for scale, n in zip(scales, raw.torques, strict=True) if scale is not None]
        sample = AxisSample(raw.at_ns, np.array(q), np.array(torque), raw.complete)
        self._check(sample.at_ns, sample.q)
        self.notebook.sampled(sample)
        return raw

    def command(self, tau_m: Vector, due_ns: int) -> None:
        """Wait until `due_ns`, then send torques, if they are within the bounds; see `AxisGroup.command`."""
        self._hold_torques(tau_m.tolist())
        self.group.command(tau_m, due_ns)
        self.notebook.commanded(self.now_ns(), tau_m)

    def command_raw(self, counts: Sequence[int], due_ns: int) -> None:
        """As `command`, in the drives' own counts; the bounds and the notebook see them as torques."""
        scales = [axis.scale for axis in self.group.axes]
        tau_m = np.array(
            [scale.torque(value) for scale, value in zip(scales, counts, strict=True) if scale is not None]
        )
        self._hold_torques(tau_m.tolist())
        self.group.command_raw(counts, due_ns)
        self.notebook.commanded(self.now_ns(), tau_m)

    def _hold_torques(self, torques: Sequence[float]) -> None:
        bound = self.bounds.torque
        for axis, torque in enumerate(torques, start=1):
            if not abs(torque) <= bound + _ROUNDING:
                raise LimitExceeded("agreed torque", f"axis {axis}", torque, bound, "N·m")

    def _check(self, at_ns: int, q: Vector) -> None:
        """Hold a sample against the bounds; every check is written so that NaN violates it."""
        if self._first is None or self._last is None or self._began_ns is None:
            self._began_ns, self._first = at_ns, q
        else:
            before_ns, before = self._last
            self._rates = (q - before) * (SECOND_NS / (at_ns - before_ns))
        self._last = at_ns, q
        bounds = self.bounds
        elapsed = (at_ns - self._began_ns) / SECOND_NS
        for axis, (way, rate) in enumerate(zip((q - self._first).tolist(), self._rates.tolist(), strict=True), start=1):
            if not abs(way) <= bounds.travel:
                raise LimitExceeded("agreed travel", f"axis {axis}", way, bounds.travel, "rad")
            if not abs(rate) <= bounds.speed:
                raise LimitExceeded("agreed speed", f"axis {axis}", rate, bounds.speed, "rad/s")
        if not elapsed <= bounds.duration:
            raise LimitExceeded("agreed duration", "the procedure", elapsed, bounds.duration, "s")
        self._tell()

    def _tell(self) -> None:
        elapsed = 0 if self._began_ns is None else self.now_ns() - self._began_ns
        self._watcher.advance(min(elapsed / self._lasts_ns, 1.0), self._words)
