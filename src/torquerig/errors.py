"""The errors of the application, each a sentence for the person at the machine.

ApplicationError
├── ConfigurationError (ValueError)   a key, value, file or option that cannot be used
├── MotionError (ValueError)          a motion that cannot be read, or that the machine could not follow
├── PictureError (OSError)            a picture that cannot be written
├── RecordError (OSError)             a record that cannot be written, or read back
└── RigError (RuntimeError)           simulated drives that did not start, or are gone
"""


class ApplicationError(Exception):
    """Root of the application's errors."""


class ConfigurationError(ApplicationError, ValueError):
    """A configuration that cannot be used; the message names table.key."""


class MotionError(ApplicationError, ValueError):
    """A motion that cannot be read or followed; the message names file and line, or table, and what would be right."""


class PictureError(ApplicationError, OSError):
    """A picture that cannot be written; the message names the file."""


class RecordError(ApplicationError, OSError):
    """A record that cannot be written, or read back; the message names the place."""


class RigError(ApplicationError, RuntimeError):
    """Simulated drives that did not start, or are gone; the message says why."""
