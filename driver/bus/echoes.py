"""Own frames that a bus gives back."""

from collections import deque
from typing import Final

from torquerig.driver.wire.frame import Arrival, Frame

ECHO_PATIENCE_NS: Final = 100_000_000
"""A bus that gives own frames back does so within this time of the first one."""

OUTSTANDING: Final = 512
"""So many own frames at most are waited for: a bus that loses some must not make the memory grow."""


class EchoFilter:
    """Tells own frames that a bus gives back from frames of others.

    Whether a bus does is learnt from the first frame sent; until then both are possible.
    """

    def __init__(self, patience_ns: int = ECHO_PATIENCE_NS) -> None:
        """Know nothing yet.

        Args:
            patience_ns: How long after the first own frame one may still come back for the first time [ns].
        """
        self._patience_ns = patience_ns
        self._outstanding: deque[Frame] = deque(maxlen=OUTSTANDING)
        self._decide_by_ns: int | None = None
        self._decided = False
        self._echoes = False

    @property
    def outstanding(self) -> int:
        """How many own frames may still come back."""
        return len(self._outstanding)

    def sent(self, frame: Frame, now_ns: int) -> None:
        """Take note of an own frame."""
        if self._decide_by_ns is None:
            self._decide_by_ns = now_ns + self._patience_ns
        if self._echoes or not self._decided:
            self._outstanding.append(frame)

    def is_echo(self, arrival: Arrival) -> bool:
        """Whether a frame that arrived is an own one that comes back."""
        if not self._decided and self._decide_by_ns is not None and arrival.at_ns > self._decide_by_ns:
            self._decided = True
            self._outstanding.clear()
        if not self._outstanding:  # as always on a bus without echo: a vain search costs 4 us, most of it for words
            return False
        try:
            self._outstanding.remove(arrival.frame)
        except ValueError:
            return False
        self._echoes = self._decided = True
        return True
