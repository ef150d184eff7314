"""The measuring device profile, CiA 404: what a transducer's objects mean.

Sources: CiA 404 V1.2, 7.1.2 (survey of the analogue input function block) and manuals of devices that follow it: Baumer
StrainLink V3.05, chapter 6 (1000, 6110 to 6150, 7130); Hydac VFL 4639928, 3.5.3 (9100 to 9130); esd CAN-CBX-Pt100
C.3032.21, 8.10.9 (6150). Units: CiA 303-2, the table of SI units and that of prefixes.
"""

from enum import IntFlag
from pathlib import Path
from typing import Final, NamedTuple

TRANSDUCER_EDS: Final = Path(__file__).parent.parent / "data" / "torquerig-transducer.eds"

PROFILE: Final = 404
"""What the lower half of a measuring device's type (1000) says."""

SENSOR_TYPE: Final = 0x6110
SAMPLE_RATE: Final = 0x6114
AUTOZERO: Final = 0x6125
PHYSICAL_UNIT: Final = 0x6131
DECIMAL_DIGITS: Final = 0x6132
STATUS: Final = 0x6150

PROCESS_VALUES: Final = (0x9130, 0x7130, 0x6130)
"""The process value as INTEGER32, INTEGER16 and REAL32, the finer integers first: a device has one or more of them."""
REAL_PROCESS_VALUE: Final = 0x6130
"""Is in the physical unit as it stands; integers have decimal digits (6132)."""

ZERO: Final = b"zero"
"""Signature that 6125 takes, first letter first."""

_NEWTON_METRE: Final = 0x56
_PREFIX_SHIFT, _NUMERATOR_SHIFT, _DENOMINATOR_SHIFT = 24, 16, 8


class AiStatus(IntFlag):
    """Bits of the status of a measurement, object 6150."""

    NOT_VALID = 1 << 0
    POSITIVE_OVERLOAD = 1 << 1
    NEGATIVE_OVERLOAD = 1 << 2


class Unit(NamedTuple):
    """A physical unit as 6131 and CiA 303-2 code it.

    Attributes:
        prefix: Power of ten.
        numerator: Code of the unit.
        denominator: Code of what it is divided by; 0 for nothing.
    """

    prefix: int
    numerator: int
    denominator: int

    @property
    def is_torque(self) -> bool:
        """Whether it is N·m, with whatever prefix."""
        return self.numerator == _NEWTON_METRE and self.denominator == 0


def split_unit(code: int) -> Unit:
    """The parts of a unit's code: prefix (signed) in the highest byte, numerator, denominator, and a reserved byte."""
    prefix = code >> _PREFIX_SHIFT & 0xFF
    signed = prefix - 0x100 if prefix & 0x80 else prefix
    return Unit(signed, code >> _NUMERATOR_SHIFT & 0xFF, code >> _DENOMINATOR_SHIFT & 0xFF)
