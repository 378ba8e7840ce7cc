"""Settings of the allocation: how the flight software uses wheels and thrusters."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator
from typing_extensions import Self

from space_robot_msgs_py.config.validation import StrictModel

WheelAllocation = Literal["pseudo_inverse", "least_largest"]
Modulation = Literal["pwm", "sigma_delta", "schmitt"]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class AllocationSettings(StrictModel):
    """How a torque on the base is shared out among wheels and thrusters."""

    wheels: WheelAllocation = Field(
        "pseudo_inverse",
        description="how wheels share a torque: pseudo_inverse (least squares of their loads) or "
        "least_largest (least largest load)",
    )
    null_gain: Annotated[float, Field(ge=0.0, le=1e3)] = Field(
        1.0,
        description="rate at which momentum that wheels hold against one another is corrected, "
        "1/s (0: never)",
    )
    null_share: Share = Field(
        0.2, description="share of a wheel's largest torque that this may take"
    )
    least_speed: Annotated[float, Field(ge=0.0, le=1e6)] = Field(
        0.0,
        description="speed above which wheels are kept by momentum against one another, rad/s "
        "(0: they are balanced alone)",
    )
    failure_ticks: Annotated[int, Field(ge=0, le=10**6)] = Field(
        100,
        description="ticks in a row without the torque asked for until a wheel counts as failed; "
        "more than commands are late (0: never)",
    )
    modulation: Modulation = Field(
        "schmitt", description="how thrusters make a mean torque: pwm, sigma_delta or schmitt"
    )
    modulation_period: Annotated[float, Field(ge=1e-6, le=100.0)] = Field(
        0.1, description="of pwm: time from one pulse to the next, s"
    )
    schmitt_on: Annotated[float, Field(ge=1e-3, le=1e3)] = Field(
        1.0, description="of schmitt: a thruster opens when it owes so many shortest pulses"
    )
    schmitt_off: Annotated[float, Field(ge=-1e3, le=1e3)] = Field(
        0.0, description="of schmitt: it closes when it owes no more than so many"
    )
    force_weight: Share = Field(
        0.03,
        description="weight of the thrusters' force on the base against their torque, over their "
        "mean lever arm",
    )
    unload_above: Share = Field(
        0.7, description="share of its largest momentum from which on thrusters unload a wheel"
    )
    unload_to: Share = Field(0.3, description="share at which they have unloaded all wheels")
    unload_time: Annotated[float, Field(ge=1e-3, le=1e6)] = Field(
        20.0, description="time constant with which the wheels' momentum is unloaded, s"
    )

    @model_validator(mode="after")
    def _thresholds_are_apart(self) -> Self:
        for lower, upper in (("unload_to", "unload_above"), ("schmitt_off", "schmitt_on")):
            if not getattr(self, lower) < getattr(self, upper):
                raise ValueError(
                    f"{lower} must be below {upper}, got {getattr(self, lower):g} and "
                    f"{getattr(self, upper):g}"
                )
        return self
