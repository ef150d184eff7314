"""The errors of the application, each a sentence for the person at the machine.

ApplicationError
├── ConfigurationError (ValueError)   a key, value, file or option that cannot be used
├── RecordError (OSError)             a record that cannot be written
└── RigError (RuntimeError)           simulated drives that did not start, or are gone
"""


class ApplicationError(Exception):
    """Root of the application's errors."""


class ConfigurationError(ApplicationError, ValueError):
    """A configuration that cannot be used; the message names table.key."""


class RecordError(ApplicationError, OSError):
    """A record that cannot be written; the message names the place."""


class RigError(ApplicationError, RuntimeError):
    """Simulated drives that did not start, or are gone; the message says why."""
