"""Figures 2.2, 2.3 and 6.2 to 6.10 of the thesis, with our curves over its axes."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from torquerig.control.log import LoopLog
from torquerig.maps import stiffness_figure, transmission_figure
from torquerig.mechanism import Manipulator
from torquerig.picture import COLOURS, DESIRED, INK
from torquerig.reproduction import thesis_axes
from torquerig.reproduction.experiments import MOTIONS, PlantRuns, Run
from torquerig.reproduction.plots import Picture, draw_panels, look_of, png_of
from torquerig.torque_parts import TorqueParts, motion_part, reference_components
from torquerig.torque_picture import MOTORS, Curve, component_curves

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

COMPONENT_LAW: Final = "computed-torque"
"""Whose runs Figures 6.4 and 6.5 show: the model-based law with the best errors in motion 1."""
_JOINTS: Final = ("joint 1", "joint 2", "joint 3")
_NOT_AS_NUMBERS: Final = "The thesis' own curves exist in print only; axes and ranges are its own."


def pictures(plants: Sequence[PlantRuns], watch: Callable[[str], None]) -> Iterator[Picture]:
    """Draw all figures, in the thesis' order; one that shows runs once a plant.

    Args:
        plants: The runs.
        watch: Is told which figure is being drawn.

    Yields:
        The pictures. A figure of runs that were all stopped is left out.
    """
    model = plants[0].model
    watch("drawing Figures 2.2 and 2.3")
    yield from _maps(model)
    for motion in MOTIONS:
        watch(f"drawing Figure 6.{motion + 1}")
        run = next((run for plant in plants for run in plant.of(motion)), None)
        if run is not None:
            yield _profiles(model, motion, _log(run))
    for number, draw in _OF_RUNS.items():
        for plant in plants:
            watch(f"drawing Figure {number}, {plant.plant}")
            if (picture := draw(plant)) is not None:
                yield picture


def _maps(model: Manipulator) -> Iterator[Picture]:
    """Figures 2.2 and 2.3."""
    yield Picture(
        "2.2",
        "",
        "Cartesian stiffness with and without the third actuator",
        "Euclidean norm of k S'S at k = 1 N·m/rad; the thesis' surface plot reaches from 300 to 900 N/m. It does not"
        " say which two actuators its non-redundant machine has: legs 1 and 3 are shown.",
        "Maps of the stiffness norm in N/m over x and y in mm: three actuators, legs 1 and 3 alone, and their ratio.",
        png_of(stiffness_figure(model)),
    )
    yield Picture(
        "2.3",
        "",
        "Evenness of the force transmission with and without the third actuator",
        "Ratio of the least to the greatest singular value of S, 0 at a singularity; the thesis' ordinate reaches from"
        " 0 to 1.",
        "Maps of the ratio of singular values over x and y in mm, with three actuators and with any two of them.",
        png_of(transmission_figure(model)),
    )


def _profiles(model: Manipulator, motion: int, log: LoopLog) -> Picture:
    """Figure 6.2 or 6.3: the reference as it was tabulated for the runs."""
    part = motion_part(log)
    place, velocity, acceleration = (
        values[part] for values in (log.desired_position, log.desired_velocity, log.desired_acceleration)
    )
    qdd = np.array(
        [
            model.jacobians(x)[1] @ a + model.jacobian_rates(x, v)[:3] @ v
            for x, v, a in zip(place, velocity, acceleration, strict=True)
        ]
    )
    one = {"color": INK, "linewidth": 1.6}
    plane = [[Curve("", values, one)] for values in (acceleration[:, 0], velocity[:, 0], place[:, 0], place[:, 1])]
    joints = [
        [Curve(name, column, {"color": colour}) for name, column, colour in zip(_JOINTS, q.T, COLOURS, strict=True)]
        for q in (log.desired_qd[part], qdd)
    ]
    return Picture(
        f"6.{motion + 1}",
        "",
        f"Desired motion {motion}",
        "The reference that all runs of this motion follow. " + _NOT_AS_NUMBERS,
        "Desired acceleration in m/s², velocity in m/s and position in m of the end-effector, and velocity in rad/s and"
        " acceleration in rad/s² of the three joints, over the sample.",
        draw_panels(thesis_axes.PROFILES[motion], [*plane, *joints], columns=2, height=8.6),
    )


def _components(motion: int, plant: PlantRuns) -> Picture | None:
    """Figure 6.4 or 6.5."""
    log = next((_log(run) for run in plant.of(motion) if run.law == COMPONENT_LAW), None)
    if log is None:
        return None
    parts = TorqueParts.of(plant.model, log)
    curves = [component_curves(parts, motor) for motor in range(MOTORS)]
    return Picture(
        f"6.{motion + 3}",
        plant.plant,
        f"Torque components, motion {motion}",
        "Lines: along the reference, with the thesis' stiction of 0.02 N·m on motor 1. Dots: along the motion that was"
        f" measured under {COMPONENT_LAW}, by central differences, the same components. Residual: the torque recorded"
        " at that instant less their total. The machine's dry friction beyond the stiction is in it, not in the model. "
        + _NOT_AS_NUMBERS,
        "Torques of the three motors in N·m over the sample: total, inertia, Coriolis and centrifugal, friction and"
        " stiction, the recorded torque, and what of it the model does not explain.",
        draw_panels(thesis_axes.COMPONENTS[motion], curves, columns=3, height=4.6),
    )


def _errors(plant: PlantRuns) -> Picture | None:
    """Figure 6.6."""
    panels = [panel for motion in MOTIONS for panel in thesis_axes.ERRORS[motion]]
    curves = [_law_curves(plant, motion, error) for motion in MOTIONS for error in (_position_error, _velocity_error)]
    if not any(curves):
        return None

    def mark_thesis(place: int, axes: "Axes") -> None:
        axes.plot([], [], "<", color=INK, markersize=8, label="the thesis' RMSE")
        for run in plant.of(MOTIONS[place // 2]):
            if run.experiment.published is not None:
                rmse, colour = run.experiment.published[place % 2], look_of(run.law, plant.laws)["color"]
                axes.plot(panels[place].samples, rmse, "<", color=colour, markersize=8, clip_on=False, in_layout=False)

    return Picture(
        "6.6",
        plant.plant,
        "Tracking errors of the end-effector",
        "Norm of desired less measured; triangles at the right: the thesis' RMSE of each law (Tables 6.1 and 6.2). "
        + _NOT_AS_NUMBERS,
        "Norm of the position error in mm and of the velocity error in m/s over the sample in both motions, a curve a"
        " law.",
        draw_panels(panels, curves, columns=2, height=7.8, decorate=mark_thesis),
    )


def _joint_errors(motion: int, plant: PlantRuns) -> Picture | None:
    """Figure 6.7 or 6.8."""
    curves = [_law_curves(plant, motion, partial(_joint_error, joint)) for joint in range(3)]
    if not any(curves):
        return None
    return Picture(
        f"6.{motion + 6}",
        plant.plant,
        f"Position errors of the actuated joints, motion {motion}",
        "Desired less measured, at the joint. " + _NOT_AS_NUMBERS,
        "Position errors of the three joints in degrees over the sample, a curve a law.",
        draw_panels(thesis_axes.JOINT_ERRORS[motion], curves, columns=3, height=4.6),
    )


def _torques(motion: int, plant: PlantRuns) -> Picture | None:
    """Figure 6.9 or 6.10."""
    runs = plant.of(motion)
    if not runs:
        return None
    desired = reference_components(plant.model, _log(runs[0])).total
    wide = {"color": DESIRED, "linewidth": 4.0}
    curves = [
        [Curve("desired", desired[:, motor], wide), *_law_curves(plant, motion, partial(_torque, motor))]
        for motor in range(3)
    ]
    return Picture(
        f"6.{motion + 8}",
        plant.plant,
        f"Torques of the motors, motion {motion}",
        "As the drives report them with the following sample; desired: what the reference takes, the total of"
        f" Figure 6.{motion + 3}. " + _NOT_AS_NUMBERS,
        "Torques of the three motors in N·m over the sample, a curve a law, over what the reference takes.",
        draw_panels(thesis_axes.TORQUES[motion], curves, columns=3, height=4.6),
    )


_OF_RUNS: Final[Mapping[str, Callable[[PlantRuns], Picture | None]]] = {
    "6.4": partial(_components, 1),
    "6.5": partial(_components, 2),
    "6.6": _errors,
    "6.7": partial(_joint_errors, 1),
    "6.8": partial(_joint_errors, 2),
    "6.9": partial(_torques, 1),
    "6.10": partial(_torques, 2),
}
"""Figures that show runs, and how each is drawn; None if the runs that it shows were stopped."""


def _law_curves(plant: PlantRuns, motion: int, values: Callable[[Run], Array]) -> list[Curve]:
    """A curve a law that ran to its end, in its look."""
    return [Curve(run.law, values(run), look_of(run.law, plant.laws)) for run in plant.of(motion)]


def _position_error(run: Run) -> Array:
    """Norm of the end-effector's position error [mm]."""
    log = _log(run)
    error: Array = 1e3 * np.linalg.norm((log.desired_position - log.position)[motion_part(log)], axis=1)
    return error


def _velocity_error(run: Run) -> Array:
    """Norm of the end-effector's velocity error [m/s]."""
    log = _log(run)
    error: Array = np.linalg.norm((log.desired_velocity - log.velocity)[motion_part(log)], axis=1)
    return error


def _joint_error(joint: int, run: Run) -> Array:
    """A joint's position error [deg]."""
    log = _log(run)
    error: Array = np.degrees((log.desired_q - log.q)[motion_part(log), joint])
    return error


def _torque(motor: int, run: Run) -> Array:
    """A motor's torque that the command of each row brought [N·m at the motor]: drives report it a sample later."""
    log = _log(run)
    part = motion_part(log)
    return log.tau_actual[part.start + 1 : part.stop + 1, motor]


def _log(run: Run) -> LoopLog:
    """The cycles of a run that came to its end."""
    assert run.outcome is not None  # noqa: S101  (only such runs are drawn)
    return run.outcome.log
