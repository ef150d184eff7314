"""What a configuration may say: one model a table, each key with its type and range.

The values themselves, their units and their sources stand in rig.toml, the shipped configuration. Every key is there,
so that no model has a default of its own.
"""

from typing import Annotated, Literal

from pydantic import Field

from torquerig.schema_machines import Bench, Drive, Latency, Model, Plant, Simulator
from torquerig.schema_values import (
    Branch,
    FifoPriority,
    Finite,
    Milliseconds,
    NodeId,
    NotNegative,
    Point,
    Positive,
    Table,
    TrajectoryName,
)


class Bus(Table):
    """Where the drives are."""

    url: Annotated[str, Field(min_length=1)]
    bitrate: Literal[10_000, 20_000, 50_000, 125_000, 250_000, 500_000, 800_000, 1_000_000]
    patience: Annotated[float, Field(ge=0, le=60)]


class Loop(Table):
    """What the control loop does, and when."""

    law: str
    motion: Literal[1, 2, "circle", "corner"] | TrajectoryName
    gains: Literal["auto", 1, 2]
    rate_hz: Annotated[float, Field(ge=1, le=4000)]
    command_after: Literal["auto", "computed"] | Annotated[float, Field(ge=0, le=1000)]
    rpdo_type: Literal[1, 255]
    group_rpdo: bool
    repeat: Annotated[int, Field(ge=1, le=1000)]
    estimator: str
    friction_feedforward: Literal["law"] | bool
    stiction_feedforward: Annotated[float, Field(ge=0, le=1.63)]
    coulomb_feedforward: bool
    delay_compensation: bool
    spin: Annotated[float, Field(ge=0, le=1e-3)]
    fifo_priority: FifoPriority


class Approach(Table):
    """What surrounds the motion."""

    speed: Annotated[float, Field(gt=0, le=2)]
    acceleration: Annotated[float, Field(gt=0, le=100)]
    hold_before: Annotated[float, Field(ge=0, le=60)]
    hold_after: Annotated[float, Field(ge=0, le=60)]


class Motion(Table):
    """A stroke along (1, 1), out and back."""

    speed: Annotated[float, Field(gt=0, le=2)]
    acceleration: Annotated[float, Field(gt=0, le=100)]
    stroke: Annotated[float, Field(gt=0, le=0.1)]
    tj: Annotated[float, Field(ge=0, le=1)]


class CircleMotion(Table):
    """Laps of a circle."""

    centre: Point
    radius: Annotated[float, Field(gt=0, le=0.1)]
    laps: Annotated[int, Field(ge=1, le=1000)]
    clockwise: bool
    speed: Annotated[float, Field(gt=0, le=2)]
    acceleration: Annotated[float, Field(gt=0, le=100)]
    tj: Annotated[float, Field(ge=0, le=1)]


class CornerMotion(Table):
    """Laps of a closed path of straight sides."""

    corners: Annotated[tuple[Point, ...], Field(min_length=2, max_length=100)]
    laps: Annotated[int, Field(ge=1, le=1000)]
    speed: Annotated[float, Field(gt=0, le=2)]
    acceleration: Annotated[float, Field(gt=0, le=100)]
    tj: Annotated[float, Field(ge=0, le=1)]


class Motions(Table):
    """The test motions and the built-in ones."""

    motion1: Motion = Field(alias="1")
    motion2: Motion = Field(alias="2")
    circle: CircleMotion
    corner: CornerMotion

    def of(self, number: int) -> Motion:
        """The test motion of this number, 1 or 2."""
        return {1: self.motion1, 2: self.motion2}[number]


class Gains(Table):
    """Gains of a law in one motion; one that is missing is the law's own."""

    kp: NotNegative | None = None
    kv: NotNegative | None = None


class Law(Table):
    """Changed gains of one law."""

    motion1: Gains = Gains()
    motion2: Gains = Gains()

    def of(self, number: int) -> Gains:
        """The gains in the motion of this number, 1 or 2."""
        return {1: self.motion1, 2: self.motion2}[number]


class Limits(Table):
    """Where a run stops."""

    workspace_x: Point
    workspace_y: Point
    conditioning: Annotated[float, Field(gt=0, lt=1)]
    singularity_distance: NotNegative
    joint_speed: Positive
    position_error: Positive
    torque: Annotated[float, Field(gt=0, le=1.63)]
    torque_stop: Positive


class Master(Table):
    """The driver as a node of the bus."""

    node_id: NodeId
    heartbeat: Milliseconds
    heartbeat_limit: Milliseconds
    watchdog_periods: Annotated[int, Field(ge=1, le=100)]
    listening: Milliseconds
    settling: Milliseconds


class Axis(Table):
    """One drive, as the driver sees it."""

    node_id: NodeId
    profile: Annotated[str, Field(min_length=1)]
    sign: Branch
    counts_per_nm_positive: Positive
    counts_per_nm_negative: Positive
    encoder_counts: Annotated[int, Field(ge=4)]
    encoder_zero: Annotated[float, Field(ge=-7, le=7)]
    gear: Positive
    bus: Annotated[str, Field(min_length=1)] | None = None
    eds: Annotated[str, Field(min_length=1)] | None = None
    torque_constant: Positive | None = None


class Axes(Table):
    """The drives of the three legs."""

    leg1: Axis = Field(alias="1")
    leg2: Axis = Field(alias="2")
    leg3: Axis = Field(alias="3")

    @property
    def legs(self) -> tuple[Axis, Axis, Axis]:
        """The drives in the order of the legs."""
        return self.leg1, self.leg2, self.leg3


class CalibrationFile(Table):
    """Where the values are that were calibrated."""

    file: str
    any_drives: bool


class Rig(Table):
    """The whole configuration."""

    bus: Bus
    loop: Loop
    approach: Approach
    motion: Motions
    laws: dict[str, Law] = Field(default_factory=dict)
    estimators: dict[str, dict[str, int | Finite]] = Field(default_factory=dict)
    limits: Limits
    master: Master
    axes: Axes
    model: Model
    latency: Latency
    calibration: CalibrationFile
    simulator: Simulator
    drive: Drive
    bench: Bench
    plant: dict[str, Plant]
