"""What one key alone cannot tell: values that must fit each other, and names that must exist."""

from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

from torquerig.buses import bus_urls, is_simulated, same_place
from torquerig.busload import HIGHEST_LOAD, SHORT_TPDO_BYTES, TPDO_BYTES, Plan, budget
from torquerig.complaints import suggestion
from torquerig.control.estimators import load_estimators
from torquerig.control.laws import load_laws
from torquerig.control.profile import TrapezoidalAcceleration
from torquerig.schema import Rig


class Problem(NamedTuple):
    """Something that does not fit.

    Attributes:
        key: The dotted key to change.
        sentence: What is wrong, naming it.
    """

    key: str
    sentence: str


def check(rig: Rig) -> Iterator[Problem]:
    """Every problem of a configuration whose single values are in range.

    Args:
        rig: The configuration.

    Yields:
        The problems, the most likely ones first.
    """
    for part in _CHECKS:
        yield from part(rig)


def _names(rig: Rig) -> Iterator[Problem]:
    """Laws and plants that do not exist."""
    laws = load_laws()
    if rig.loop.law not in laws:
        yield Problem("loop.law", f"loop.law = {rig.loop.law!r} is not a law{suggestion(rig.loop.law, laws)}")
    for name in rig.laws:
        if name not in laws:
            yield Problem(f"laws.{name}", f"laws.{name} is not a law{suggestion(name, laws)}")
    yield from _estimators(rig)
    if rig.simulator.plant not in rig.plant:
        plant = rig.simulator.plant
        yield Problem("simulator.plant", f"simulator.plant = {plant!r} is not a plant{suggestion(plant, rig.plant)}")


def _estimators(rig: Rig) -> Iterator[Problem]:
    """Estimators that do not exist, and parameters that they cannot have."""
    estimators = load_estimators()
    chosen = rig.loop.estimator
    if chosen not in estimators:
        yield Problem(
            "loop.estimator", f"loop.estimator = {chosen!r} is not an estimator; there are {', '.join(estimators)}"
        )
    for name, given in rig.estimators.items():
        table = f"estimators.{name}"
        if name not in estimators:
            yield Problem(table, f"{table} is not an estimator{suggestion(name, estimators)}")
            continue
        for parameter, words in estimators[name].objections(given):
            key = f"{table}.{parameter}"
            yield Problem(key, f"{key} = {given[parameter]!r} cannot be: {words}")


def _timing(rig: Rig) -> Iterator[Problem]:
    """Commands that would leave after the next SYNC."""
    period_ms = 1e3 / rig.loop.rate_hz
    after = rig.loop.command_after
    if isinstance(after, float | int) and not 0 <= after < period_ms:
        yield Problem(
            "loop.command_after",
            f"loop.command_after = {after:g} ms cannot be: at loop.rate_hz = {rig.loop.rate_hz:g} it must be at least 0"
            f" and below the period of {period_ms:g} ms",
        )


def _buses(rig: Rig) -> Iterator[Problem]:
    """Buses that cannot be those of one rig."""
    main, used = rig.bus.url, [axis.bus or rig.bus.url for axis in rig.axes.legs]
    if main not in used:
        yield Problem("bus.url", f"bus.url = {main!r} cannot be: no drive is there, since every axis names another bus")
    named = {same_place(main): main}
    for leg, url in enumerate(used, start=1):
        key = f"axes.{leg}.bus"
        if (name := named.setdefault(same_place(url), url)) != url:
            yield Problem(key, f"{key} = {url!r} cannot be: it is {name!r} by another name, and a bus has one name")
        if is_simulated(url) != is_simulated(main):
            yield Problem(
                key,
                f"{key} = {url!r} cannot be beside bus.url = {main!r}: simulated time does not pass on a real bus, so"
                " that either all buses are lockstep: or none is",
            )


def _load(rig: Rig) -> Iterator[Problem]:
    """Cycles that the bus, or the fullest of several, cannot carry beside heartbeats and SDOs, or not in time."""
    shared, buses = rig.loop.group_rpdo, len(bus_urls(rig))
    tpdo_bytes = SHORT_TPDO_BYTES if shared else TPDO_BYTES
    legs, rate_hz, bitrate = len(rig.axes.legs), rig.loop.rate_hz, rig.bus.bitrate
    plan = Plan(legs, rate_hz, bitrate, buses, tpdo_bytes=tpdo_bytes, group_rpdo=shared, answer_s=rig.latency.sample)
    taken = budget(plan)
    if taken.fits:
        return
    words = f"loop.rate_hz = {rate_hz:g} cannot be: "
    if rate_hz > taken.roomy_hz:
        drives = plan.drives_on_fullest
        rpdos = "one RPDO" if shared else f"{drives} RPDOs"
        words += f"SYNC, {drives} TPDOs and {rpdos} a cycle would load"
        words += f" bus.bitrate = {bitrate} to {100 * taken.cyclic_load:.0f} %"
        words += f"; at most {taken.roomy_hz:.0f} Hz ({100 * HIGHEST_LOAD:.0f} %) leave room for the rest"
        if taken.answered_hz < taken.roomy_hz:
            words += f", and at most {taken.answered_hz:.0f} Hz bring every TPDO within half a period"
    else:
        words += f"at bus.bitrate = {bitrate} the last TPDO comes {taken.answered_ns / 1e3:.0f} us after SYNC, and the"
        words += f" driver waits half a period, {5e5 / rate_hz:.0f} us; at most {taken.fastest_hz:.0f} Hz"
    yield Problem("loop.rate_hz", words)


def _motions(rig: Rig) -> Iterator[Problem]:
    """Motions whose phases do not fit into their stroke, and sides of no length."""
    for number in (1, 2):
        motion = rig.motion.of(number)
        try:
            TrapezoidalAcceleration(motion.stroke, motion.speed, motion.acceleration, motion.tj)
        except ValueError as error:
            yield Problem(f"motion.{number}", f"motion.{number} cannot be driven: {error}")
    corners = rig.motion.corner.corners
    for number, (corner, following) in enumerate(zip(corners, (*corners[1:], corners[0]), strict=True)):
        if corner == following:
            key = "motion.corner.corners"
            yield Problem(
                key,
                f"{key} cannot be: {list(corner)} stands twice at number {number + 1}; the way back from the last to"
                " the first is made without being named",
            )


def _frictions(rig: Rig) -> Iterator[Problem]:
    """Joints that would hold less at rest than they brake while moving."""
    for name, plant in rig.plant.items():
        for leg, (coulomb, breakaway) in enumerate(zip(plant.coulomb, plant.breakaway, strict=True), start=1):
            if breakaway < coulomb:
                key = f"plant.{name}.breakaway"
                yield Problem(
                    key, f"{key} of leg {leg} = {breakaway:g} N·m cannot be: at least plant.{name}.coulomb, {coulomb:g}"
                )


def _intervals(rig: Rig) -> Iterator[Problem]:
    """Limits whose ends are exchanged, or that exclude home."""
    for name, (low, high), home in (
        ("limits.workspace_x", rig.limits.workspace_x, rig.model.home[0]),
        ("limits.workspace_y", rig.limits.workspace_y, rig.model.home[1]),
    ):
        if not low < home < high:
            yield Problem(name, f"{name} = [{low:g}, {high:g}] cannot be: model.home = {home:g} must lie inside it")


def _nodes(rig: Rig) -> Iterator[Problem]:
    """Node-ids that are given twice."""
    seen = {rig.master.node_id: "master.node_id"}
    for leg, axis in enumerate(rig.axes.legs, start=1):
        key = f"axes.{leg}.node_id"
        if axis.node_id in seen:
            yield Problem(key, f"{key} = {axis.node_id} cannot be: {seen[axis.node_id]} has this node-id already")
        seen[axis.node_id] = key
    bench = rig.bench.node_id
    if bench in seen:
        yield Problem("bench.node_id", f"bench.node_id = {bench} cannot be: {seen[bench]} has this node-id already")


def _installation(rig: Rig) -> Iterator[Problem]:
    """Cables of the simulated machine that would end nowhere, or at one place twice."""
    for name in ("motors", "encoders"):
        legs = getattr(rig.simulator.installation, name)
        if sorted(legs) != [1, 2, 3]:
            key = f"simulator.installation.{name}"
            yield Problem(key, f"{key} = {list(legs)} cannot be: each of 1, 2 and 3 must be there once")


_CHECKS: Final[tuple[Callable[[Rig], Iterator[Problem]], ...]] = (
    _names,
    _timing,
    _buses,
    _load,
    _motions,
    _frictions,
    _intervals,
    _nodes,
    _installation,
)
