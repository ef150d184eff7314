"""What a configuration may say: one model a table, each key with its type and range.

The values themselves, their units and their sources stand in rig.toml, the shipped configuration. Every key is there,
so that no model has a default of its own.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
NodeId = Annotated[int, Field(ge=1, le=127)]
Milliseconds = Annotated[float, Field(ge=1e-3, le=60)]
FifoPriority = Annotated[int, Field(ge=0, le=99)]
Delay = Annotated[float, Field(ge=0, le=1e-2)]
Point = tuple[Finite, Finite]
EachPositive = tuple[Positive, Positive, Positive]
EachNotNegative = tuple[NotNegative, NotNegative, NotNegative]
Branch = Literal[-1, 1]


class Table(BaseModel):
    """A table of the configuration: read only, without unknown keys, and with no conversion between types."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Bus(Table):
    """Where the drives are."""

    url: Annotated[str, Field(min_length=1)]
    bitrate: Literal[10_000, 20_000, 50_000, 125_000, 250_000, 500_000, 800_000, 1_000_000]


class Loop(Table):
    """What the control loop does, and when."""

    law: str
    motion: Literal[1, 2]
    rate_hz: Annotated[float, Field(ge=1, le=4000)]
    command_after: Literal["auto", "computed"] | Annotated[float, Field(ge=0, le=1000)]
    rpdo_type: Literal[1, 255]
    group_rpdo: bool
    repeat: Annotated[int, Field(ge=1, le=1000)]
    estimator: Literal["backward-difference", "moving-window"]
    window: Annotated[int, Field(ge=1, le=1000)]
    friction_feedforward: Literal["law"] | bool
    stiction_feedforward: Annotated[float, Field(ge=0, le=1.63)]
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


class Motions(Table):
    """The test motions."""

    motion1: Motion = Field(alias="1")
    motion2: Motion = Field(alias="2")

    def of(self, number: int) -> Motion:
        """The motion of this number, 1 or 2."""
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
    gear: Positive
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


class Links(Table):
    """Masses of the six links, motor inertia and viscous friction."""

    actuator_inertia: NotNegative
    active_viscous: NotNegative
    passive_viscous: NotNegative
    proximal_mass: EachPositive
    proximal_centre: EachPositive
    proximal_inertia: EachPositive
    distal_mass: EachPositive
    distal_centre: EachPositive
    distal_inertia: EachPositive


class Model(Links):
    """What the controller believes of the machine."""

    link_length: Positive
    bases: tuple[Point, Point, Point]
    home: Point
    branches: tuple[Branch, Branch, Branch]
    gear_ratio: Positive


class Plant(Links):
    """A true machine for the simulator, in the model's geometry."""

    coulomb: EachNotNegative
    breakaway: EachNotNegative
    torque_limit: Annotated[float, Field(gt=0, le=1.63)]
    current_lag: Annotated[float, Field(ge=0, le=0.1)]


class Simulator(Table):
    """Which machine is simulated, and how finely."""

    plant: str
    step: Annotated[float, Field(gt=0, le=1e-4)]
    record_period: Annotated[float, Field(ge=1e-4, le=1)]
    fifo_priority: FifoPriority


class Drive(Table):
    """The truth about the simulated drives."""

    gain_positive: Positive
    gain_negative: Positive
    rated_torque: Annotated[float, Field(gt=0, le=1.63)]
    boot: Annotated[float, Field(ge=0, le=10)]
    answer: Delay
    sample: Delay
    reaction: Delay


class Rig(Table):
    """The whole configuration."""

    bus: Bus
    loop: Loop
    approach: Approach
    motion: Motions
    laws: dict[str, Law] = {}
    limits: Limits
    master: Master
    axes: Axes
    model: Model
    simulator: Simulator
    drive: Drive
    plant: dict[str, Plant]
