"""Addresses of a transducer's objects: channel 1 of CiA 404's analogue input function block, as 32-bit integers."""

from typing import Final

SERIAL_NUMBER: Final = (0x1018, 4)
SAMPLE_RATE: Final = (0x6114, 1)  # AI ADC sample rate [us]
AUTOZERO: Final = (0x6125, 1)
DECIMAL_DIGITS: Final = (0x6132, 1)
STATUS: Final = (0x6150, 1)
FIELD_VALUE: Final = (0x9100, 1)
OFFSET: Final = (0x9124, 1)
PROCESS_VALUE: Final = (0x9130, 1)

ZERO_SIGNATURE: Final = int.from_bytes(b"zero", "little")
VOLATILE: Final = (AUTOZERO[0],)  # a command: 1010 does not store it
