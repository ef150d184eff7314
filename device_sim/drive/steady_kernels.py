"""The regular cycle of drives in steady operation, compiled; records are those of `steady_memory`.

It is what `Encoder`, `TorquePath`, `TorqueCommand`, `Watchdogs`, `Protection`, `Tpdo` and `Rpdo` do with a SYNC, with a
target, and when a target takes effect; a test holds both to the same frames and torques. Whatever is not regular is
left alone, before anything has changed, and told.
"""

from typing import Any

from torquerig.device_sim.drive.steady_memory import ALARM, ASIDE, DONE, LEAVE, NEVER_NS
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
def take_frame(fleet: Any, lent: Any, frame: Any, at_ns: int) -> int:  # noqa: ANN401
    """Do with a frame what the drives do."""
    if frame.flags:
        return LEAVE
    if frame.can_id != fleet.sync_id:
        return receive(fleet, lent, frame, at_ns)
    if frame.length != fleet.sync_length:
        return LEAVE
    return synchronise(fleet, lent, at_ns)


@compiled
def live(fleets: Any, lent: Any, frames: Any, until_ns: int) -> int:  # noqa: ANN401
    """Let effects of targets happen until a time, and then the drives hear the frame that came, if there is one.

    Returns:
        What is needed before it can go on, if it can.
    """
    drives, effects, rpdos, _, _, _, motors = lent
    fleet, frame = fleets[0], frames[0]
    while True:
        axis, alarm_ns = next_effect(fleet, drives, effects), next_alarm_ns(fleet, drives, rpdos)
        effect_ns = effects[axis, 0].at_ns if axis >= 0 else NEVER_NS
        if alarm_ns <= min(effect_ns, fleet.aside_ns, until_ns):
            return ALARM
        if fleet.aside_ns <= min(effect_ns, until_ns):
            fleet.now_ns = fleet.wanted_ns = fleet.aside_ns
            return ASIDE
        fleet.next_ns = min(effect_ns, fleet.aside_ns, alarm_ns)
        if effect_ns <= until_ns:
            needed = take_effect(fleet, drives[axis], motors, axis, effects[axis])
            if needed != DONE:
                return needed
            fleet.now_ns = effect_ns
        elif frame.waits:
            needed = take_frame(fleet, lent, frame, until_ns)
            if needed != DONE:
                return needed
            frame.waits = 0
        else:
            fleet.now_ns = until_ns
            return DONE
