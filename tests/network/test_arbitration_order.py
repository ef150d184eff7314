"""Who wins on a wire where a dominant bit is 0: compared with the arbitration field written out bit by bit."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from torquerig.device_sim.arbitration import rank_of
from torquerig.driver.wire.frame import Frame

frames = st.one_of(
    st.builds(Frame, st.integers(0, 0x7FF), st.just(b""), st.booleans(), st.just(False)),
    st.builds(Frame, st.integers(0, 0x1FFFFFFF), st.just(b""), st.booleans(), st.just(True)),
)


def field(frame: Frame) -> str:
    """ISO 11898-1: base 11 identifier bits, RTR, IDE = 0; extended 11 bits, SRR = 1, IDE = 1, 18 bits, RTR."""
    rtr = "1" if frame.remote else "0"
    if not frame.extended:
        return f"{frame.can_id:011b}{rtr}0"
    bits = f"{frame.can_id:029b}"
    return f"{bits[:11]}11{bits[11:]}{rtr}"


@given(frames, frames)
def test_the_rank_orders_frames_as_their_bits_do(one, other):
    a, b = field(one), field(other)
    shorter = min(len(a), len(b))
    if a[:shorter] != b[:shorter]:
        assert (rank_of(one) < rank_of(other)) == (a < b)
    else:
        assert rank_of(one) == rank_of(other)


@pytest.mark.parametrize(
    ("winner", "loser"),
    [
        (Frame(0x080), Frame(0x081)),
        (Frame(0x701), Frame(0x701, remote=True)),
        (Frame(0x701, remote=True), Frame(0x701 << 18, extended=True)),
        (Frame(0x080 << 18, extended=True), Frame(0x081)),
    ],
)
def test_the_dominant_bit_wins(winner, loser):
    assert rank_of(winner) < rank_of(loser)
