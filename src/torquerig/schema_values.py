"""The kinds of values that a configuration's keys may have."""

from typing import Annotated, Final, Literal

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
CIRCLE: Final = "circle"
CORNER: Final = "corner"
TrajectoryName = Annotated[
    str, Field(pattern=r"(?i)\.csv$", description="the name of a trajectory file, which ends in .csv")
]
Signs = tuple[Branch, Branch, Branch]
Leg = Literal[1, 2, 3]
PulseCount = Annotated[int, Field(ge=4)]
EachLeg = tuple[Leg, Leg, Leg]


class Table(BaseModel):
    """A table of the configuration: read only, without unknown keys, and with no conversion between types."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
