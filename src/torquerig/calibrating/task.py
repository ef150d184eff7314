"""A procedure that is ready to be conducted, and what a person says to it."""

from dataclasses import dataclass
from typing import Any, NamedTuple

from torquerig.axes import axis_settings, refuse_unheard
from torquerig.calibrating.offer import Offer, Request
from torquerig.calibration.procedure import Plan, Procedure
from torquerig.configuration import Configuration


class Consent(NamedTuple):
    """How somebody came to agree to a plan.

    Attributes:
        who: Who agreed, and how.
        command: What was called.
    """

    who: str
    command: str


@dataclass(frozen=True, slots=True)
class Task:
    """A procedure that is ready to be conducted.

    Attributes:
        name: The procedure's name.
        offer: The application's part of it.
        configuration: Of the rig.
        request: What was asked for.
        procedure: Made of the two.
        plan: What it will do.
        recorded: What was measured before and is only to be evaluated; None to measure.
    """

    name: str
    offer: Offer
    configuration: Configuration
    request: Request
    procedure: Procedure[Any]
    plan: Plan
    recorded: Any = None

    @classmethod
    def prepare(cls, name: str, offer: Offer, configuration: Configuration, request: Request) -> "Task":
        """Make the procedure, and have it plan; nothing is opened.

        Raises:
            ConfigurationError: The request and the configuration do not go together, or the drives.
            RecordError: What was measured before cannot be read.
        """
        refuse_unheard(axis_settings(configuration))
        procedure = offer.make(configuration, request)
        recorded = offer.recorded(configuration, request)
        return cls(name, offer, configuration, request, procedure, procedure.plan(), recorded)
