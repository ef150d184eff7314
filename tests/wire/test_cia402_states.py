"""The power state machine of CiA 402."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.driver.wire import cia402
from torquerig.driver.wire.cia402 import (
    AUTOMATIC_TRANSITIONS,
    FAULT_RESET,
    STATE_BITS,
    TRANSITIONS,
    Command,
    DriveState,
    Event,
    OperationMode,
    Transition,
    controlword_towards,
    decode_state,
    walk,
)

S = DriveState

# statuswords as drives send them: state bits of CiA 402's table, with voltage enabled (bit 4), remote (9) and others
STATUSWORDS = [
    (0x0000, S.NOT_READY),
    (0x0210, S.NOT_READY),
    (0x0250, S.SWITCH_ON_DISABLED),
    (0x0240, S.SWITCH_ON_DISABLED),
    (0x0270, S.SWITCH_ON_DISABLED),  # bit 5 does not matter here
    (0x0231, S.READY_TO_SWITCH_ON),
    (0x0233, S.SWITCHED_ON),
    (0x0237, S.OPERATION_ENABLED),
    (0x1637, S.OPERATION_ENABLED),
    (0x0217, S.QUICK_STOP_ACTIVE),
    (0x021F, S.FAULT_REACTION_ACTIVE),
    (0x023F, S.FAULT_REACTION_ACTIVE),
    (0x0218, S.FAULT),
    (0x0238, S.FAULT),
    (0x0088, S.FAULT),
]


@pytest.mark.parametrize(("statusword", "state"), STATUSWORDS)
def test_statuswords_tell_the_state(statusword, state):
    assert decode_state(statusword) is state


@pytest.mark.parametrize("statusword", [0x0001, 0x0211, 0x0213, 0x0261, 0x0077, 0x0022])
def test_bits_that_make_up_no_state_decode_to_none(statusword):
    assert decode_state(statusword) is None


def test_state_bits_decode_to_their_state_whatever_the_other_bits_are():
    others = (cia402.VOLTAGE_ENABLED, cia402.WARNING, cia402.REFERENCED, cia402.REMOTE, 1 << 12, 1 << 15)
    for state in DriveState:
        for bit in (0, *others):
            assert decode_state(STATE_BITS[state] | bit) is state


def test_quick_stop_bit_is_clear_only_during_quick_stop():
    enabled = {S.READY_TO_SWITCH_ON, S.SWITCHED_ON, S.OPERATION_ENABLED}
    assert all(STATE_BITS[state] & cia402.QUICK_STOP_INACTIVE for state in enabled)
    assert not STATE_BITS[S.QUICK_STOP_ACTIVE] & cia402.QUICK_STOP_INACTIVE


def test_all_transitions_of_the_standard_are_there_with_their_targets():
    both = {**TRANSITIONS, **AUTOMATIC_TRANSITIONS}
    made = {(source, step.number, step.target) for (source, _), step in both.items()}
    assert made == {
        (None, 0, S.NOT_READY),
        (S.NOT_READY, 1, S.SWITCH_ON_DISABLED),
        (S.SWITCH_ON_DISABLED, 2, S.READY_TO_SWITCH_ON),
        (S.READY_TO_SWITCH_ON, 3, S.SWITCHED_ON),
        (S.SWITCHED_ON, 4, S.OPERATION_ENABLED),
        (S.OPERATION_ENABLED, 5, S.SWITCHED_ON),
        (S.SWITCHED_ON, 6, S.READY_TO_SWITCH_ON),
        (S.READY_TO_SWITCH_ON, 7, S.SWITCH_ON_DISABLED),
        (S.OPERATION_ENABLED, 8, S.READY_TO_SWITCH_ON),
        (S.OPERATION_ENABLED, 9, S.SWITCH_ON_DISABLED),
        (S.SWITCHED_ON, 10, S.SWITCH_ON_DISABLED),
        (S.OPERATION_ENABLED, 11, S.QUICK_STOP_ACTIVE),
        (S.QUICK_STOP_ACTIVE, 12, S.SWITCH_ON_DISABLED),
        (S.NOT_READY, 13, S.FAULT_REACTION_ACTIVE),
        (S.SWITCH_ON_DISABLED, 13, S.FAULT_REACTION_ACTIVE),
        (S.READY_TO_SWITCH_ON, 13, S.FAULT_REACTION_ACTIVE),
        (S.SWITCHED_ON, 13, S.FAULT_REACTION_ACTIVE),
        (S.OPERATION_ENABLED, 13, S.FAULT_REACTION_ACTIVE),
        (S.QUICK_STOP_ACTIVE, 13, S.FAULT_REACTION_ACTIVE),
        (S.FAULT_REACTION_ACTIVE, 14, S.FAULT),
        (S.FAULT, 15, S.SWITCH_ON_DISABLED),
        (S.QUICK_STOP_ACTIVE, 16, S.OPERATION_ENABLED),
    }


def test_quick_stop_ends_by_itself_as_transition_12():
    assert AUTOMATIC_TRANSITIONS[S.QUICK_STOP_ACTIVE, Event.QUICK_STOP_DONE] == Transition(12, S.SWITCH_ON_DISABLED)


# state, controlword, transition numbers made
WALKS = [
    (S.SWITCH_ON_DISABLED, 0x0006, [2]),
    (S.SWITCH_ON_DISABLED, 0x000E, [2]),  # shutdown is x110
    (S.SWITCH_ON_DISABLED, 0x0007, []),
    (S.SWITCH_ON_DISABLED, 0x000F, []),
    (S.SWITCH_ON_DISABLED, 0x0000, []),
    (S.READY_TO_SWITCH_ON, 0x0007, [3]),
    (S.READY_TO_SWITCH_ON, 0x000F, [3, 4]),
    (S.READY_TO_SWITCH_ON, 0x0006, []),
    (S.READY_TO_SWITCH_ON, 0x0000, [7]),
    (S.READY_TO_SWITCH_ON, 0x0002, [7]),
    (S.SWITCHED_ON, 0x0007, []),
    (S.SWITCHED_ON, 0x000F, [4]),
    (S.SWITCHED_ON, 0x0006, [6]),
    (S.SWITCHED_ON, 0x000D, [10]),  # disable voltage is xx0x
    (S.SWITCHED_ON, 0x000B, [10]),  # quick stop is x01x
    (S.OPERATION_ENABLED, 0x000F, []),
    (S.OPERATION_ENABLED, 0x010F, []),  # halt moves no state
    (S.OPERATION_ENABLED, 0x0007, [5]),
    (S.OPERATION_ENABLED, 0x0006, [8]),
    (S.OPERATION_ENABLED, 0x0000, [9]),
    (S.OPERATION_ENABLED, 0x0002, [11]),
    (S.OPERATION_ENABLED, 0x000B, [11]),
    (S.OPERATION_ENABLED, 0x0082, [11]),  # a fault reset bit left set stops no stop
    (S.QUICK_STOP_ACTIVE, 0x0000, [12]),
    (S.QUICK_STOP_ACTIVE, 0x000F, [16]),
    (S.QUICK_STOP_ACTIVE, 0x0002, []),
    (S.QUICK_STOP_ACTIVE, 0x0006, []),
    (S.FAULT, 0x000F, []),
    (S.FAULT, 0x0080, [15]),
    (S.FAULT, 0x008F, [15]),
    (S.FAULT_REACTION_ACTIVE, 0x0080, []),
    (S.NOT_READY, 0x0006, []),
]


@pytest.mark.parametrize(("state", "controlword", "numbers"), WALKS)
def test_controlwords_make_the_standards_transitions(state, controlword, numbers):
    assert [step.number for step in walk(state, controlword, 0)] == numbers


def test_fault_reset_is_a_rising_edge():
    assert walk(S.FAULT, 0x80, 0x80) == ()
    assert walk(S.FAULT, 0x80, 0x7F) == (Transition(15, S.SWITCH_ON_DISABLED),)


def test_a_fault_reset_never_enables_in_the_same_breath():
    assert [step.target for step in walk(S.FAULT, 0x8F, 0x0F)] == [S.SWITCH_ON_DISABLED]


def test_a_barred_transition_is_not_made():
    assert walk(S.FAULT, 0x80, 0, barred={15}) == ()
    assert walk(S.QUICK_STOP_ACTIVE, 0x0F, 0, barred={16}) == ()
    assert [step.number for step in walk(S.READY_TO_SWITCH_ON, 0x0F, 0, barred={4})] == [3]


@given(st.sampled_from(DriveState), st.integers(0, 0xFFFF), st.integers(0, 0xFFFF))
def test_every_walk_ends_and_is_a_chain_of_the_table(state, controlword, previous):
    steps = walk(state, controlword, previous)
    assert len(steps) <= 2
    at = state
    for step in steps:
        assert step in {t for (source, _), t in TRANSITIONS.items() if source is at}
        at = step.target


@given(st.integers(0, 0xFFFF))
def test_every_controlword_is_exactly_one_command_save_that_0111_is_two(controlword):
    recognised = {c for c in Command if c is not Command.FAULT_RESET and controlword & c.mask == c.pattern}
    assert len(recognised) == 1 or recognised == {Command.SWITCH_ON, Command.DISABLE_OPERATION}


GOALS = [S.SWITCH_ON_DISABLED, S.READY_TO_SWITCH_ON, S.SWITCHED_ON, S.OPERATION_ENABLED]


@pytest.mark.parametrize(
    ("start", "goal"), list(itertools.product([*GOALS, S.QUICK_STOP_ACTIVE], GOALS)), ids=lambda s: s.name
)
def test_the_masters_path_reaches_its_goal_and_stays(start, goal):
    state, previous = start, 0
    for _ in range(4):
        controlword = controlword_towards(state, goal)
        for step in walk(state, controlword, previous, barred={16}):
            state = step.target
        previous = controlword
    assert state is goal


def test_the_master_enables_with_the_classic_sequence():
    goal = S.OPERATION_ENABLED
    words = [controlword_towards(s, goal) for s in (S.SWITCH_ON_DISABLED, S.READY_TO_SWITCH_ON, S.SWITCHED_ON, goal)]
    assert words == [0x06, 0x07, 0x0F, 0x0F]


def test_quick_stop_is_reached_from_operation_enabled_and_held():
    assert controlword_towards(S.OPERATION_ENABLED, S.QUICK_STOP_ACTIVE) == 0x02
    assert controlword_towards(S.QUICK_STOP_ACTIVE, S.QUICK_STOP_ACTIVE) == 0x02


def test_nothing_resets_a_fault_but_the_goal_switch_on_disabled():
    for goal in GOALS:
        assert bool(controlword_towards(S.FAULT, goal) & FAULT_RESET) == (goal is S.SWITCH_ON_DISABLED)


@pytest.mark.parametrize("goal", [S.NOT_READY, S.FAULT_REACTION_ACTIVE, S.FAULT], ids=lambda s: s.name)
def test_a_goal_that_no_command_leads_to_is_refused(goal):
    with pytest.raises(ValueError, match=goal.words):
        controlword_towards(S.OPERATION_ENABLED, goal)


def test_0228_announces_profile_torque_homing_and_cst():
    modes = {mode for mode in OperationMode if cia402.supports(0x228, mode)}
    assert modes == {OperationMode.PROFILE_TORQUE, OperationMode.HOMING, OperationMode.CST}
