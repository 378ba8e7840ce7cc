"""What the flight software assumes of the base's actuators, and how it uses them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator
from typing_extensions import Self

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.hardware.sheets import read_sheet
from space_robot_model.robot import Robot
from space_robot_msgs_py.config.validation import StrictModel

WheelAllocation = Literal["pseudo_inverse", "least_largest"]
Modulation = Literal["pwm", "sigma_delta", "schmitt"]
Dump = Literal["all", "thrusters", "magnetic", "none"]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


def assumed_actuators(name: str, robot: Robot) -> BaseActuatorSettings:
    """Read the base's actuators of a file of config/actuators, or at a path.

    Parameters of the plant alone (a misaligned wheel, a weak thruster) are left out: the controller
    does not know them.
    """
    actuators = read_sheet(BaseActuatorSettings, "actuators", name)
    actuators.check(robot, name)
    return actuators


class AllocationSettings(StrictModel):
    """How a torque on the base is allocated to wheels, thrusters and magnetic torquers."""

    wheels: WheelAllocation = Field(
        "pseudo_inverse",
        description="allocation of a torque to the wheels: pseudo_inverse (least squares of their "
        "loads) or least_largest (smallest largest load)",
    )
    null_gain: Annotated[float, Field(ge=0.0, le=1e3)] = Field(
        1.0,
        description="rate at which the wheels' momentum in the null space is corrected, 1/s "
        "(0: never)",
    )
    null_share: Share = Field(
        0.2, description="largest share of a wheel's largest torque for this correction"
    )
    least_speed: Annotated[float, Field(ge=0.0, le=1e6)] = Field(
        0.0,
        description="speed above which the wheels are kept by momentum in the null space, rad/s "
        "(0: the wheels are only balanced)",
    )
    failure_ticks: Annotated[int, Field(ge=0, le=10**6)] = Field(
        100,
        description="successive ticks without the commanded torque after which a wheel counts as "
        "failed; must exceed the latency of commands (0: never)",
    )
    modulation: Modulation = Field(
        "schmitt", description="modulation of the thrusters: pwm, sigma_delta or schmitt"
    )
    modulation_period: Annotated[float, Field(ge=1e-6, le=100.0)] = Field(
        0.1, description="pwm: time from one pulse to the next, s"
    )
    schmitt_on: Annotated[float, Field(ge=1e-3, le=1e3)] = Field(
        1.0, description="schmitt: impulse error at which a thruster opens, in shortest pulses"
    )
    schmitt_off: Annotated[float, Field(ge=-1e3, le=1e3)] = Field(
        0.0, description="schmitt: impulse error at which it closes, in shortest pulses"
    )
    force_weight: Share = Field(
        0.03,
        description="weight of the thrusters' force times their mean lever arm, relative to their "
        "torque",
    )
    dump: Dump = Field(
        "all",
        description="what takes momentum from the wheels: thrusters, magnetic (torquers), all "
        "that there are, or none",
    )
    magnetic_gain: Annotated[float, Field(ge=0.0, le=10.0)] = Field(
        0.002,
        description="rate at which magnetic torquers take the momentum across the magnetic field "
        "from the wheels, 1/s",
    )
    unload_above: Share = Field(
        0.7,
        description="share of a wheel's largest momentum above which thrusters unload the wheels",
    )
    unload_to: Share = Field(
        0.3, description="share of the largest momentum below which unloading ends"
    )
    unload_time: Annotated[float, Field(ge=1e-3, le=1e6)] = Field(
        20.0, description="time constant of unloading, s"
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
