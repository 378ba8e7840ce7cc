"""Settings of the faults caused by the plant, and the catalogue of their kinds.

Those of sensors, actuators and environment the plant has itself; those of messages act on the way
between plant and controller.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from space_robot_msgs_py.config.settings import Texts
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.samples import RobotNames

from ..actuators.actuators import Actuators
from ..component import kinds_of
from ..environment.environment import Environment
from ..faults.grammar import Fault, by_name, parse_faults
from ..faults.messages import MESSAGE_KINDS
from ..faults.schedule import Schedule
from ..sensors.sensors import Sensors

PLANT_KINDS = by_name(
    *MESSAGE_KINDS.values(),
    *(kind for record in (Sensors, Actuators, Environment) for kind in kinds_of(record)),
)
"""All kinds of faults caused by the plant."""


def _readable(texts: list[str]) -> list[str]:
    parse_faults(texts, PLANT_KINDS)
    return texts


class FaultSettings(StrictModel):
    """Settings of the faults of the plant."""

    faults: Annotated[Texts, AfterValidator(_readable)] = Field(
        [""], description="faults of the flight, each `KIND@T[-END][:ARGUMENT]`, see docs/manual"
    )
    fault_seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = Field(
        0, description="seed of the random numbers of faults and sensors"
    )

    @property
    def parsed_faults(self) -> list[Fault]:
        """The faults, without the empty texts."""
        return parse_faults(self.faults, PLANT_KINDS)

    @property
    def has_message_faults(self) -> bool:
        """True if messages between plant and controller have faults."""
        return any(fault.kind.name in MESSAGE_KINDS for fault in self.parsed_faults)

    def schedule(self, names: RobotNames, period: float) -> Schedule:
        """Place the faults in a flight of a robot with these names in ticks of ``period`` seconds.

        Raises:
            InputError: a fault names what is not there, or its time holds no tick.
        """
        return Schedule(self.parsed_faults, self.fault_seed, period, names)
