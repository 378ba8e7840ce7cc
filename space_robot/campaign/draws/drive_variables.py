"""Variables of the plant's gears, and of its plates for drag and sunlight."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from typing import Any

from space_robot_model.robot import Robot
from space_robot_model.robot.gears import geared_joints
from space_robot_model.robot.shapes import plates_of
from space_robot_msgs_py.errors import InputError

from .changes import Changes
from .distributions import Distribution, Value
from .names import ALL, chosen
from .robot_numbers import OfRobot, read_not_negative, read_positive
from .variable import Variable

DRIVE = "drive."
OF_DRIVES = {
    f"{DRIVE}rotor_inertia": "rotor_inertia",
    f"{DRIVE}gear_ratio": "ratio",
    f"{DRIVE}stiffness": "stiffness",
    f"{DRIVE}damping": "damping",
}
"""Fields of a `Gear` by their names in variables."""
OF_PLATES = ("area", "drag_coefficient", "specular", "diffuse")


@dataclass(frozen=True)
class OfDrive(OfRobot):
    """A number of a joint's gear, see `OF_DRIVES`."""

    field: str

    @property
    def place(self) -> Hashable:
        """Return the key of the changed quantity."""
        return "joint", self.body, self.field

    @property
    def is_of_plant_robot(self) -> bool:
        """Return False: the plant cannot fly with every drive, so that the ends are checked."""
        return False

    def apply(self, value: Value, changes: Changes) -> None:
        """Apply a value of the variable to a flight."""
        gears, joint, field = changes.robot.gears, self.body - 1, OF_DRIVES[self.field]
        gear = gears[joint]
        assert gear
        gears[joint] = gear._replace(**{field: self.distribution.on(getattr(gear, field), value)})


@dataclass(frozen=True)
class OfPlates(Variable):
    """A number of one plate, or of all of them."""

    field: str
    plate: int | None
    """Counted from 0; None: all."""

    @property
    def place(self) -> Hashable:
        """Return the key of the changed quantity."""
        return "plates", self.field, self.plate

    def apply(self, value: Value, changes: Changes) -> None:
        """Apply a value of the variable to a flight."""
        plates = changes.robot.plates
        for number in range(len(plates)) if self.plate is None else (self.plate,):
            old = plates[number]
            new: dict[str, Any] = {
                self.field: float(self.distribution.on(getattr(old, self.field), value))
            }
            plates[number] = replace(old, **new)


def drive_variables(
    key: str, what: str, element: str, value: Any, where: str, robot: Robot
) -> list[OfDrive]:
    """Return the variables of ``robot.joints[element].drive.*``; ``*`` is all joints with gears.

    Raises:
        InputError: the joint has no gear, or the number cannot have such values.
    """
    geared, names = geared_joints(robot), robot.all_joint_names
    joints = geared if element == ALL else [j for j, _ in chosen(element, names, "joint")]
    for joint in joints:
        if joint not in geared:
            own = ", ".join(robot.geared_names) or "none"
            raise InputError(f"joint {names[joint]} has no gear; joints with gears: {own}")
    if not joints:
        raise InputError(f"no joint of robot {robot.name!r} has a gear")
    variables = []
    for joint in joints:
        nominal = getattr(robot.gears[joint], OF_DRIVES[what])
        read = read_not_negative if what == f"{DRIVE}damping" else read_positive
        distribution = read(value, where, nominal)
        name = f"robot.joints[{names[joint]}].{what}"
        variables.append(OfDrive(name, key, distribution, joint + 1, what))
    return variables


def plate_variables(
    key: str, what: str, element: str, value: Any, where: str, robot: Robot
) -> list[OfPlates]:
    """Return the variables of ``robot.plates.*``: one for all plates, or one for each.

    Raises:
        InputError: there is no such plate, or the number cannot have such values.
    """
    plates = plates_of(robot)

    def distribution(least: float) -> Distribution:
        read = read_positive if what == "area" else read_not_negative
        return read(value, where, least)

    if not element:
        least = min(getattr(plate, what) for plate in plates)
        return [OfPlates(f"robot.plates.{what}", key, distribution(least), what, None)]
    numbers = [str(number + 1) for number in range(len(plates))]
    return [
        OfPlates(
            f"robot.plates[{name}].{what}",
            key,
            distribution(getattr(plates[number], what)),
            what,
            number,
        )
        for number, name in chosen(element, numbers, "plate")
    ]
