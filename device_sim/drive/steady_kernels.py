"""The regular cycle of drives in steady operation, compiled; records are those of `steady_memory`.

It is what `Encoder`, `TorquePath`, `TorqueCommand`, `Watchdogs`, `Protection`, `Tpdo` and `Rpdo` do with a SYNC, with a
target, and when a target takes effect; a test holds both to the same frames and torques. Whatever is not regular is
left alone, before anything has changed, and told.
"""

from typing import Any

from torquerig.device_sim.drive.steady_memory import DONE, LEAVE, NEVER_NS, SEND
from torquerig.device_sim.drive.steady_samples import synchronise
from torquerig.device_sim.drive.steady_targets import next_effect, receive, take_effect
from torquerig.mechanism.compiled import compiled


@compiled
def next_alarm_ns(fleet: Any, drives: Any, rpdos: Any) -> int:  # noqa: ANN401
    """When a deadline passes if nothing comes, or something happens that is not regular."""
    due_ns = fleet.others_ns
    for axis in range(fleet.drives):
        due_ns = min(due_ns, drives[axis].watchdogs.deadline_ns)
    for place in range(fleet.rpdos):
        due_ns = min(due_ns, rpdos[place].deadline_ns)
    return int(due_ns)


@compiled
def next_frame_ns(fleet: Any, entries: Any) -> int:  # noqa: ANN401
    """When the next of the frames that came was complete; not before what has happened."""
    if fleet.taken == fleet.entries:
        return NEVER_NS
    return max(int(entries[fleet.taken].at_ns) - int(fleet.origin_ns), int(fleet.now_ns))


@compiled
def take_frame(fleet: Any, lent: Any, entry: Any, at_ns: int) -> int:  # noqa: ANN401
    """Do with the next frame what the drives do."""
    if entry.flags:
        return LEAVE
    if entry.can_id != fleet.sync_id:
        return receive(fleet, lent, entry, at_ns)
    if entry.length != fleet.sync_length:
        return LEAVE
    return synchronise(fleet, lent, at_ns)


@compiled
def live(fleets: Any, lent: Any, entries: Any, until_ns: int) -> int:  # noqa: ANN401
    """Let happen what is due: all frames that came, or effects of targets until a time if there is no frame any more.

    Returns:
        What is needed before it can go on, if it can.
    """
    drives, effects, rpdos, _, _, _, motors = lent
    fleet = fleets[0]
    while True:
        frame_ns, axis = next_frame_ns(fleet, entries), next_effect(fleet, drives, effects)
        effect_ns = effects[axis, 0].at_ns if axis >= 0 else NEVER_NS
        alarm_ns = next_alarm_ns(fleet, drives, rpdos)
        horizon_ns = until_ns if frame_ns == NEVER_NS else frame_ns
        if alarm_ns <= min(effect_ns, horizon_ns):
            return LEAVE
        if effect_ns <= horizon_ns:
            needed = take_effect(fleet, drives[axis], motors, axis, effects[axis])
            if needed != DONE:
                return needed
            fleet.now_ns = effect_ns
        elif frame_ns < NEVER_NS:
            needed = take_frame(fleet, lent, entries[fleet.taken], frame_ns)
            if needed not in (DONE, SEND):
                return needed
            fleet.now_ns = frame_ns
            fleet.taken += 1
            if needed == SEND:
                return needed
        else:
            fleet.now_ns = max(fleet.now_ns, until_ns)
            fleet.next_ns = min(effect_ns, alarm_ns)
            return DONE
