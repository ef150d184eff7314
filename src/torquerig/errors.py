"""The errors of the application, each a sentence for the person at the machine.

ApplicationError
├── ConfigurationError (ValueError)   a key, value, file or option that cannot be used
└── RecordError (OSError)             a record that cannot be written
"""


class ApplicationError(Exception):
    """Root of the application's errors."""


class ConfigurationError(ApplicationError, ValueError):
    """A configuration that cannot be used; the message names table.key."""


class RecordError(ApplicationError, OSError):
    """A record that cannot be written; the message names the place."""
