"""How much of the bus the cycle leaves, and how often objects may be read and written in it.

SDOs have more urgent identifiers than heartbeats (0x580 and 0x600 before 0x700; CiA 301, 7.3.5): transfers that take
all that the cycle leaves keep heartbeats from the bus, and every node that waits for them stops.
"""

from collections.abc import Sequence
from typing import Final

from torquerig.driver.master.process_data import STATUS_CYCLES, ProcessData
from torquerig.driver.wire import pdo
from torquerig.driver.wire.frame import MAX_DATA_LENGTH, worst_case_bits

_NS_PER_S: Final = 10**9
_TRANSFER_BITS: Final = 2 * worst_case_bits(MAX_DATA_LENGTH)  # a request and its answer
_SHARE: Final = 0.5  # of what the cycle leaves; our choice: heartbeats of 127 nodes take less than the other half
_ALONE: Final = 0.8  # of the bus before there is a cycle; our choice
_LEAST: Final = 0.05  # of the bus that transfers get at least, where the cycle leaves none: they would never end


def cycle_bits(drives: Sequence[ProcessData]) -> float:
    """Bits that SYNC and all PDOs take in a cycle, in the mean, with stuffing at its worst.

    Args:
        drives: The PDOs of each drive; one that several hear counts once.
    """
    frames: dict[int, float] = {}
    for drive in drives:
        for rpdo in drive.rpdos:
            frames[rpdo.cob_id] = worst_case_bits(rpdo.size) / (1 if rpdo.watched else STATUS_CYCLES)
        for tpdo in drive.tpdos:
            cycles = tpdo.transmission if pdo.is_cyclic(tpdo.transmission) else 1
            frames[tpdo.cob_id] = worst_case_bits(tpdo.size) / cycles
    return worst_case_bits(0) + sum(frames.values())


def transfer_spacing_ns(drives: Sequence[ProcessData], period_ns: int, bit_rate: int) -> int:
    """How long after the begin of one SDO transfer the next one may begin, of whichever drive [ns].

    Args:
        drives: The PDOs of each drive.
        period_ns: From SYNC to SYNC [ns].
        bit_rate: Of the bus [bit/s].
    """
    left = 1.0 - cycle_bits(drives) * _NS_PER_S / (period_ns * bit_rate)
    return round(_TRANSFER_BITS * _NS_PER_S / (bit_rate * max(_SHARE * left, _LEAST)))


def spacing_alone_ns(bit_rate: int) -> int:
    """As `transfer_spacing_ns`, before there is a cycle."""
    return round(_TRANSFER_BITS * _NS_PER_S / (bit_rate * _ALONE))
