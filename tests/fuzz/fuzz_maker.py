"""Bursts of frames of all kinds, spoilt and repeated: what a hostile wire says."""

from collections import deque
from typing import Final

import fuzz_frames as frames
import fuzz_services as services
from fuzz_frames import Burst
from fuzz_source import Source, choose, in_one_of

_REMEMBERED: Final = 16
_SPOILT: Final = 30  # one frame in so many

_KINDS: Final = (
    *[frames.anything] * 4,
    *[frames.anything_extended] * 2,
    *[frames.remote] * 3,
    *[frames.known] * 4,
    *[frames.sync] * 6,
    *[frames.nmt] * 2,
    *[frames.rpdo] * 6,
    *[frames.enabling] * 4,
    *[frames.heartbeat] * 3,
    *[frames.emergency] * 2,
    *[services.sdo_write] * 6,
    *[services.sdo_read] * 2,
    *[services.sdo_anything] * 2,
    *[services.segmented_download] * 1,
    *[services.block] * 1,
    *[services.remapping] * 1,
    *[services.supervision] * 2,
    *[services.injected_fault] * 1,
)


class FrameMaker:
    """Makes bursts, and remembers some of their frames, to repeat and to spoil them."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self._recent: deque[frames.Frame] = deque(maxlen=_REMEMBERED)

    def burst(self) -> Burst:
        """The next frames, each of them perhaps spoilt."""
        source = self._source
        if self._recent and in_one_of(source, 10):
            return [frames.spoilt(source, choose(source, self._recent)) for _ in range(source.integer(1, 4))]
        burst = choose(source, _KINDS)(source)
        self._recent.extend(burst)
        return [frames.spoilt(source, each) if in_one_of(source, _SPOILT) else each for each in burst]
