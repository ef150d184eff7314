"""What the driver raises: one tree, whose leaves also inherit the builtin that fits.

    TorqueRigError
    ├── BusError (OSError)                a frame cannot be sent or received, the bus is closed
    │   └── LinkLost                      the interface is down or gone
    ├── BusUrlError (ValueError)          a bus URL that names nothing that can be opened
    ├── EdsError (ValueError)             an EDS that cannot be read, or an object the EDS does not hold
    ├── ProfileError (ValueError)         a drive profile with an unknown, missing or impossible entry
    ├── SdoAbort (RuntimeError)           an SDO transfer was aborted, by the drive or by us (wire.sdo)
    ├── NoAnswer (TimeoutError)           a drive did not answer in time
    ├── SecondMaster (RuntimeError)       another master speaks on the bus
    └── DriveError (RuntimeError)         a drive answers, but not as it must
        ├── DriveFault                    it is in fault, or fell into it
        ├── ConfigurationMismatch         what was read back is not what was written
        ├── EnablingRefused               it must not be enabled: a watchdog is not armed, a sibling is missing
        └── NotHomed                      its position has no meaning yet

Every message is one sentence that holds the datum and can be shown to a person as it stands.
"""


class TorqueRigError(Exception):
    """Root of what torquerig raises for reasons outside the program."""


class BusError(TorqueRigError, OSError):
    """A frame cannot be sent or received."""


class LinkLost(BusError):
    """The interface is down or gone."""


class BusUrlError(TorqueRigError, ValueError):
    """A bus URL names nothing that can be opened."""


class EdsError(TorqueRigError, ValueError):
    """An electronic data sheet cannot be read, or does not hold the object asked for."""


class ProfileError(TorqueRigError, ValueError):
    """A drive profile holds an unknown, missing or impossible entry."""


class NoAnswer(TorqueRigError, TimeoutError):
    """A drive did not answer in time."""


class SecondMaster(TorqueRigError, RuntimeError):
    """Another master speaks on the bus."""


class DriveError(TorqueRigError, RuntimeError):
    """A drive answers, but not as it must."""


class DriveFault(DriveError):
    """A drive is in fault, or fell into it."""


class ConfigurationMismatch(DriveError):
    """A drive reads back another value than was written."""


class EnablingRefused(DriveError):
    """A drive must not be enabled as it stands."""


class NotHomed(DriveError):
    """A drive's position has no meaning yet."""
