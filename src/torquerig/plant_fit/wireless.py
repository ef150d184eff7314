"""The simulated machine without its wire: the same instants, counts, gains and limits, no frame on the way.

A fit needs thousands of closed loops. What the wire does to one is known beforehand: SYNC latches the encoders when its
frame ends, and each drive acts on its RPDO when the frames before it and its own have passed, and a reaction later.
What is left out is what meets those frames by chance: a heartbeat, a TPDO2.
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from torquerig.assembly import nanoseconds
from torquerig.driver.master.samples import AxisSample
from torquerig.driver.master.scale import AxisScale
from torquerig.driver.wire.frame import worst_case_bits
from torquerig.machines import machine_of
from torquerig.schema import Rig
from torquerig.schema_machines import Plant

RPDO_BYTES: Final = 4  # controlword and raw torque
TPDO_BYTES: Final = 8  # statusword, position, actual torque
_NS_PER_S: Final = 1_000_000_000


class WirelessJoints:
    """Joints of a machine that stands at home when it is made; satisfies `control.joints.Joints`."""

    def __init__(self, settings: Rig, plant: Plant, scales: Sequence[AxisScale], home: Sequence[float]) -> None:
        """The machine at rest at time 0, its encoders at zero, its torques zero.

        Args:
            settings: The rig: geometry, drives, bit rate.
            plant: The true machine.
            scales: Counts of each axis.
            home: Joint angles that the fixture holds, shape (3,) [rad].
        """
        self._machine = machine_of(settings, plant, position=settings.model.home)
        self._scales = tuple(scales)
        self._gains = (settings.drive.gain_positive, settings.drive.gain_negative)
        self._limit = plant.torque_limit
        bit_ns = _NS_PER_S / settings.bus.bitrate
        reaction_ns = nanoseconds(settings.drive.reaction)
        self._sync_ns = round(worst_case_bits(0) * bit_ns)
        rpdo_ns = round(worst_case_bits(RPDO_BYTES) * bit_ns)
        self._acts_after_ns = [(place + 1) * rpdo_ns + reaction_ns for place in range(len(self._scales))]
        tpdos_ns = round(len(self._scales) * worst_case_bits(TPDO_BYTES) * bit_ns)
        self._answer_ns = nanoseconds(settings.drive.sample) + tpdos_ns
        self._counts_per_radian = [counts / math.tau for counts in settings.simulator.installation.encoder_counts]
        edges = [self._edge(axis, 0) for axis in range(len(self._scales))]
        fixture = [scale.position(angle) for scale, angle in zip(self._scales, home, strict=True)]
        self._zeros = [position - edge for position, edge in zip(fixture, edges, strict=True)]
        self._pending: list[tuple[int, int, float]] = []
        self._now_ns = 0

    def now_ns(self) -> int:
        """Simulated time [ns]."""
        return self._now_ns

    def sample(self, due_ns: int) -> AxisSample:
        """The joints when a SYNC sent at `due_ns` has ended; returns when the last TPDO would have come."""
        latch_ns = max(due_ns, self._now_ns) + self._sync_ns
        self._apply_until(latch_ns)
        axes = range(len(self._scales))
        q = [
            scale.angle(self._edge(axis, latch_ns) + zero)
            for axis, scale, zero in zip(axes, self._scales, self._zeros, strict=True)
        ]
        torque = [self._machine.motor_torque(axis, latch_ns) for axis in axes]
        self._now_ns = latch_ns + self._answer_ns
        return AxisSample(latch_ns, np.array(q), np.array(torque), complete=True)

    def command(self, tau_m: NDArray[np.float64], due_ns: int) -> None:
        """Send torques at `due_ns`, shape (3,) [N·m at the motor]; each drive acts when its frame is there."""
        self._now_ns = max(due_ns, self._now_ns)
        for axis, (scale, torque) in enumerate(zip(self._scales, tau_m.tolist(), strict=True)):
            counts = scale.torque_counts(torque)
            self._pending.append((self._now_ns + self._acts_after_ns[axis], axis, self._torque_of(counts)))

    def _torque_of(self, counts: int) -> float:
        """What counts do: the amplifier's gain in their direction, up to what the current loop can give [N·m]."""
        positive, negative = self._gains
        return min(max(counts / (positive if counts >= 0 else negative), -self._limit), self._limit)

    def _apply_until(self, to_ns: int) -> None:
        """Let the torques act that are due; they were appended in the order of their times."""
        kept = []
        for at_ns, axis, torque in self._pending:
            if at_ns <= to_ns:
                self._machine.set_torque_demand(axis, torque, at_ns)
            else:
                kept.append((at_ns, axis, torque))
        self._pending = kept

    def _edge(self, axis: int, at_ns: int) -> int:
        """The encoder's edges passed."""
        return math.floor(self._machine.motor_angle(axis, at_ns) * self._counts_per_radian[axis])
