"""At 1 kHz three drives leave a quarter of the bus: procedures begin and end there as at any rate."""

import pytest

from torquerig.calibrating.catalogue import offer
from torquerig.calibrating.conducting import conduct
from torquerig.calibrating.offer import Request
from torquerig.calibrating.task import Consent, Task
from torquerig.calibration.procedure import Grade, Unwatched
from torquerig.configuration import load_configuration


@pytest.mark.parametrize(("name", "options"), [("home", {"reach": 0.5}), ("latency", {"steps": 40})])
def test_a_procedure_runs_and_loses_no_heartbeat(tmp_path, name, options):
    made = offer(name)
    request = Request(None, {each.name: each.default for each in made.options} | options)
    task = Task.prepare(name, made, load_configuration(options={"loop.rate_hz": 1000.0}), request)
    outcome = conduct(task, tmp_path, Consent("me", "test"), Unwatched())
    assert outcome.result.verdict.grade is Grade.OK
    emergencies = [line for line in (outcome.record / "bus.log").read_text().splitlines() if " 08" in line]
    assert {line.split()[2].partition("#")[0] for line in emergencies} <= {"080"}
