"""What the application adds to the latency procedure."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from torquerig.calibrating.offer import Offer, Option, Request
from torquerig.calibration.latency import Drawing, LatencyProcedure
from torquerig.calibration.procedure import Result
from torquerig.configuration import Configuration
from torquerig.delays import places_on_the_wire
from torquerig.driver.wire.pdo import EVENT_PROFILE
from torquerig.errors import ConfigurationError
from torquerig.picture import COLOURS, INK, drawing


def make(configuration: Configuration, request: Request) -> LatencyProcedure:
    """The procedure for a rig.

    Raises:
        ConfigurationError: An option is out of range, or one RPDO carries the commands of all drives.
    """
    rig = configuration.rig
    if rig.loop.group_rpdo:
        raise ConfigurationError(
            "latency measures drives that have RPDOs of their own: set loop.group_rpdo = false for it"
        )
    torque, steps = request.options["torque"], request.options["steps"]
    if not 0 < torque <= rig.limits.torque:
        raise ConfigurationError(
            f"--torque {torque:g} N·m cannot be: above 0, at most limits.torque = {rig.limits.torque:g}"
        )
    if not 40 <= steps <= 10_000:
        raise ConfigurationError(f"--steps {steps} cannot be: 40 to 10000")
    at_sync = rig.loop.rpdo_type != EVENT_PROFILE
    return LatencyProcedure(torque, steps, rig.bus.bitrate, at_sync, request.axes, places_on_the_wire(rig))


def truth(configuration: Configuration, _request: Request) -> Mapping[str, Any]:
    """What the simulated drives need."""
    rig = configuration.rig
    plant = rig.plant[rig.simulator.plant]
    return {
        "sample_us": 1e6 * rig.drive.sample,
        "reaction_us": 1e6 * rig.drive.reaction,
        "current_lag_us": 1e6 * plant.current_lag,
    }


def draw(result: Result, title: str, path: Path) -> None:
    """The step responses at equivalent times, and the answers to SYNC."""
    shown = result.drawing
    assert isinstance(shown, Drawing)  # noqa: S101  (its own procedure's)
    with drawing(title, path, (11.0, 6.0)) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1.6, 1))
        left.set_title("What the SYNC caught of a torque step (lines: fit)")
        for place, colour in enumerate(COLOURS):
            left.plot(1e6 * shown.x[1:], shown.steps.share[1:, place], ".", color=colour, label=f"axis {place + 1}")
            response = shown.responses[place]
            if response is not None:
                x = np.linspace(response.delay.value, float(shown.x.max()), 200)
                left.plot(
                    1e6 * x, -np.expm1(-(x - response.delay.value) / response.lag.value), color=colour, linewidth=1
                )
        left.set_xlabel("from the command to the drive's sample [µs]")
        left.set_ylabel("share of the step")
        left.legend(loc="lower right")
        right.set_title("From SYNC to TPDO")
        answers = 1e6 * shown.steps.answers
        for place, colour in enumerate(COLOURS):
            right.plot(answers[:, place], ".", markersize=4, color=colour)
            right.text(0, float(answers[:, place].mean()), f" axis {place + 1}", va="bottom", color=INK)
        right.set_ylim(0.0, 1.15 * float(answers.max()))
        right.set_xlabel("cycle")
        right.set_ylabel("[µs]")


OFFER: Final = Offer(
    make=make,
    draw=draw,
    truth=truth,
    options=(
        Option("torque", float, 0.01, "Height of the steps to each side [N·m at the motor].", "NM"),
        Option("steps", int, 200, "How many steps.", "N"),
    ),
)
