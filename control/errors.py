"""The errors of torquerig.control.

ControlError
├── EstimatorFileError (ValueError)     a file of the estimators' package is none, or does not say what one must
├── LawFileError (ValueError)           a file of the laws' package is none, or does not say what a law must
├── LimitExceeded (RuntimeError)        a soft limit stops the machine
├── UnknownEstimatorError (LookupError) no estimator has this name
├── UnknownLawError (LookupError)       no file of the laws' package defines this law
└── UnknownMotionError (LookupError)    no such test motion, or no gains for it
"""


class ControlError(Exception):
    """Root of this package's errors."""


class EstimatorFileError(ControlError, ValueError):
    """An estimator's file cannot be imported, or it has no name or that of another; the message names the file."""


class LawFileError(ControlError, ValueError):
    """A law's file cannot be imported, lacks what every law must say, or has another's name; it names the file."""


class LimitExceeded(ControlError, RuntimeError):
    """A soft limit is violated: the machine has to stop.

    Attributes:
        limit: Which limit, in words ("joint speed").
        axis: What exceeds it ("joint 2", "x").
        value: The value met, in SI units.
        bound: The bound it exceeds, in the same unit.
        unit: That unit, empty for a ratio.
    """

    def __init__(self, limit: str, axis: str, value: float, bound: float, unit: str) -> None:
        """Keep the facts and put them in one sentence."""
        super().__init__(limit, axis, value, bound, unit)
        self.limit = limit
        self.axis = axis
        self.value = value
        self.bound = bound
        self.unit = unit

    def __str__(self) -> str:
        return f"{self.limit} limit: {self.axis} at {self.value:.6g} {self.unit}".rstrip() + (
            f", the bound is {self.bound:.6g} {self.unit}".rstrip()
        )


class UnknownEstimatorError(ControlError, LookupError):
    """No velocity estimator has the name asked for."""


class UnknownLawError(ControlError, LookupError):
    """No control law has the name asked for."""


class UnknownMotionError(ControlError, LookupError):
    """There is no such test motion, or a law has no gains for it."""
