"""One cycle's work on the wire: SYNC out, three TPDOs in and decoded, three RPDOs encoded and out; four ways."""

import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from torquerig.benchmarks.enabled import enabled_rotors
from torquerig.benchmarks.harness import Turn, take_turns
from torquerig.benchmarks.wire_answered import AnsweredBus
from torquerig.benchmarks.wire_contestants import TORQUE, Canopen, Contestant, Floor, Ours, PythonCan
from torquerig.benchmarks.wire_places import DRIVES, Peer, Place, place_of

PERIOD_NS: Final = 100_000_000
"""Of the group, though cycles follow each other as they can: a drive has half of it to answer in."""


@dataclass(frozen=True, slots=True)
class WireCost:
    """What a cycle's frames cost, the peer's time and waiting left out.

    Attributes:
        bus: Where.
        ours_us: `AxisGroup.sample` and `.command`, in SI units, the median of the turns [us].
        floor_us: A bare socket and struct, raw counts [us].
        canopen_us: PDO objects of the canopen library, fed without its receive thread, which would cost more [us].
        python_can_us: python-can's messages and struct, raw counts [us].
        ours_over_floor: The median of the ratios in the same turn.
        python_can_over_ours: Likewise.
        canopen_over_ours: Likewise.
    """

    bus: str
    ours_us: float
    floor_us: float
    canopen_us: float
    python_can_us: float
    ours_over_floor: float
    python_can_over_ours: float
    canopen_over_ours: float

    def as_json(self) -> dict[str, Any]:
        """The figures."""
        return asdict(self)


def measure(url: str = "unix:", *, turns: int, turn_s: float) -> WireCost:
    """Time the four ways, in turns.

    Args:
        url: Where: one of `wire_places.URLS`.
        turns: How many turns each has.
        turn_s: How long a turn lasts, about [s].

    Raises:
        BusUrlError: The URL cannot be measured.
        BusError: The interface is down.
    """
    with tempfile.TemporaryDirectory(prefix="torquerig-") as folder, ExitStack() as stack:
        place = place_of(url, Path(folder))
        ours, counts = stack.enter_context(_ours(place))
        contestants: dict[str, Contestant] = {"ours": ours}
        others: dict[str, type[Floor | PythonCan | Canopen]] = {
            "floor": Floor,
            "python_can": PythonCan,
            "canopen": Canopen,
        }
        for name, kind in others.items():
            contestants[name] = kind(place, counts)
            stack.callback(contestants[name].close)
        variants: dict[str, Turn] = {name: each.turn for name, each in contestants.items()}
        timings = take_turns(variants, turns=turns, turn_s=turn_s)
        for name, each in contestants.items():
            _check(name, each.peer, counts)
    return WireCost(
        bus=url,
        ours_us=timings.median_us("ours"),
        floor_us=timings.median_us("floor"),
        canopen_us=timings.median_us("canopen"),
        python_can_us=timings.median_us("python_can"),
        ours_over_floor=timings.ratio("ours", "floor"),
        python_can_over_ours=timings.ratio("python_can", "ours"),
        canopen_over_ours=timings.ratio("canopen", "ours"),
    )


@contextmanager
def _ours(place: Place) -> Iterator[tuple[Ours, int]]:
    """A group on the bus, enabled with simulated drives, whose part the peer then takes over; and its counts."""
    opened, peer = place.ours()
    bus = AnsweredBus(opened, peer)
    try:
        with enabled_rotors(len(DRIVES), period_ns=PERIOD_NS, now_ns=bus.now_ns()) as rotors, rotors.moved_to(bus):
            scale = rotors.group.axes[0].scale
            assert scale is not None  # noqa: S101  (an enabled group knows its scales)
            yield Ours(rotors.group, peer), scale.torque_counts(TORQUE)
    finally:
        peer.close()
        bus.close()


def _check(name: str, peer: Peer, counts: int) -> None:
    """See that all did the same: each drive got the torque."""
    if peer.torques != dict.fromkeys(DRIVES, counts):
        raise RuntimeError(f"{name} told the drives {peer.torques}, not {counts} each")
