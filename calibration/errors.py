"""The errors of torquerig.calibration.

CalibrationError
├── NoReading (TimeoutError)     a person did not type what a display showed in time
└── WrongWay (RuntimeError)      a joint goes against its order, or the legs come apart
"""


class CalibrationError(Exception):
    """Root of this package's errors."""


class WrongWay(CalibrationError, RuntimeError):
    """What moves does not move as ordered: an axis is reversed, or reads another; the message names it."""


class NoReading(CalibrationError, TimeoutError):
    """Nobody typed a reading in time; the message names axis, level and time."""
