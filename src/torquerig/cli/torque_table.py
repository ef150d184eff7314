"""What a record's torques are made of: as an object for --json, and as a table."""

from typing import Any

from rich.markup import escape
from rich.table import Table

from torquerig.building import manipulator
from torquerig.control.components import TorqueComponents
from torquerig.control.tracking import rms
from torquerig.errors import RecordError
from torquerig.json_numbers import finite_number
from torquerig.records import RecordedRun
from torquerig.torque_parts import TorqueParts
from torquerig.torque_picture import COMPONENTS


def parts_of(record: RecordedRun) -> TorqueParts | None:
    """What the torques of a record's motion are made of.

    Args:
        record: The record.

    Returns:
        The torques, by the model that the controller had; None where no cycle of a motion was run.

    Raises:
        RecordError: The record's configuration, which tells the model, is not one of this version; or drives did not
            tell their torque in every cycle.
        ReachError, SingularPoseError: The model has no torque at a position that was asked for or measured.
    """
    log = record.log
    if log is None or not log.in_motion[: log.rows].any():
        return None
    rig = record.rig()
    if rig.loop.group_rpdo:
        raise RecordError("with loop.group_rpdo the drives do not tell their torque in every cycle")
    model = rig.model
    return TorqueParts.of(manipulator(model, model), log)


def parts_as_object(parts: TorqueParts) -> dict[str, Any]:
    """The torques' root mean squares, and each component's share of its total, as JSON holds them."""
    return {
        "reference": _components_as_object(parts.reference),
        "measured": _components_as_object(parts.measured),
        "recorded_rms_nm": finite_number(rms(parts.recorded)),
        "residual_rms_nm": finite_number(rms(parts.residual)),
    }


def parts_table(parts: TorqueParts) -> Table:
    """The same as a table for a person."""
    facts = parts_as_object(parts)
    table = Table(title=escape("torque components, rms over motion and motors [N·m]"), title_justify="left")
    table.add_column("", no_wrap=True)
    for heading in ("reference", "share", "measured", "share"):
        table.add_column(heading, justify="right")
    for part, name in COMPONENTS.items():
        cells = [facts[which][part] for which in ("reference", "measured")]
        table.add_row(name, *(text for cell in cells for text in (_shown(cell["rms_nm"], 4), _percent(cell["share"]))))
    table.add_row("recorded torque", "", "", _shown(facts["recorded_rms_nm"], 4), "")
    table.add_row("residual, recorded less total", "", "", _shown(facts["residual_rms_nm"], 4), "")
    return table


def _components_as_object(components: TorqueComponents) -> dict[str, dict[str, float | None]]:
    """Each component's root mean square and share; the total's share is 1."""
    shares = {"total": 1.0, **components.share._asdict()}
    return {
        part: {"rms_nm": finite_number(rms(getattr(components, part))), "share": finite_number(shares[part])}
        for part in COMPONENTS
    }


def _shown(value: float | None, digits: int) -> str:
    """A number with its digits, a dash for none."""
    return "-" if value is None else f"{value:.{digits}f}"


def _percent(share: float | None) -> str:
    """A share in percent, a dash for none."""
    return "-" if share is None else f"{100 * share:.1f} %"
