"""What a configuration may say of machines: the one that the controller believes in, and the simulated ones."""

from typing import Annotated, Literal

from pydantic import Field

from torquerig.schema_values import (
    Branch,
    Delay,
    EachLeg,
    EachNotNegative,
    EachPositive,
    FifoPriority,
    Finite,
    NodeId,
    NotNegative,
    Point,
    Positive,
    PulseCount,
    Signs,
    Table,
)


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
    active_coulomb: NotNegative


class Latency(Table):
    """What the controller believes of the drives' time."""

    sample: Delay
    reaction: Delay
    current_lag: Delay


class Plant(Links):
    """A true machine for the simulator, in the model's geometry."""

    coulomb: EachNotNegative
    breakaway: EachNotNegative
    torque_limit: Annotated[float, Field(gt=0, le=1.63)]
    current_lag: Annotated[float, Field(ge=0, le=0.1)]
    gear_compliance: Annotated[float, Field(ge=0, le=0.01)] = 0.0


class Installation(Table):
    """How the simulated machine is wired and coupled in truth, axis by axis."""

    motors: EachLeg
    encoders: EachLeg
    torque_sign: Signs
    encoder_sign: Signs
    encoder_counts: tuple[PulseCount, PulseCount, PulseCount]
    gear_factor: EachPositive
    coupling: EachPositive


class Simulator(Table):
    """Which machine is simulated, and how finely."""

    plant: str
    step: Annotated[float, Field(gt=0, le=1e-4)]
    record_period: Annotated[float, Field(ge=1e-4, le=1)]
    fifo_priority: FifoPriority
    stands_at: Point | None = None
    installation: Installation


class Drive(Table):
    """The truth about the simulated drives."""

    gain_positive: Positive
    gain_negative: Positive
    rated_torque: Annotated[float, Field(gt=0, le=1.63)]
    boot: Annotated[float, Field(ge=0, le=10)]
    answer: Delay
    sample: Delay
    reaction: Delay


class Bench(Table):
    """The torque calibration bench: a locked rotor against a torque transducer."""

    node_id: NodeId
    sign: Branch
    stale: Annotated[float, Field(ge=1e-3, le=10)]
    eds: Annotated[str, Field(min_length=1)] | None = None
    friction: NotNegative
    range: Positive
    noise: NotNegative
    offset: Finite
    rate_hz: Annotated[float, Field(ge=1, le=10_000)]
    fault: Literal["none", "dead", "saturated", "disconnected", "reversed"]
    seed: Annotated[int, Field(ge=0)]
