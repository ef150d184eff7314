"""Agreement to a plan and its limits, before anything moves."""

import getpass
import sys

import click

from torquerig.calibrating.task import Consent
from torquerig.calibration.procedure import Plan
from torquerig.cli.calibrate_text import print_plan
from torquerig.cli.failures import USAGE, Failure
from torquerig.driver.bus.url import LOCKSTEP


def agree(plan: Plan, url: str, *, yes: bool, quiet: bool, moves: bool = True) -> Consent:
    """Show a plan, and have a person agree to it; simulated drives of this process need nobody's consent.

    Args:
        plan: What is to be done.
        url: The bus.
        yes: Agreed to beforehand.
        quiet: Standard output is for something else.
        moves: Whether anything moves; a file is evaluated without anybody's consent.

    Returns:
        Who agreed.

    Raises:
        Failure: Nobody did.
    """
    called = " ".join(["torquerig", *sys.argv[1:]])
    if not quiet:
        print_plan(plan)
    if yes:
        return Consent(f"{_user()}, by --yes", called)
    if not moves or url.partition(":")[0] == LOCKSTEP:
        return Consent("nobody: nothing real moves", called)
    if quiet:
        print_plan(plan, err=True)
    if not sys.stdin.isatty():
        raise Failure("nobody is there to agree to the plan and its limits: read --dry-run, then add --yes", USAGE)
    if not click.confirm("Do you agree?", err=True):
        raise Failure("not agreed to: nothing has moved", USAGE)
    return Consent(f"{_user()}, at the prompt", called)


def _user() -> str:
    """Who is logged in, as far as the system knows."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return "unknown"
