"""Actuators of the base: ideal torque, hardware (wheels, thrusters, torquers), or none."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import MOST_TORQUERS, RobotNames

from ..robot import Robot
from .sheets import NO_VECTORS, MountedSheet, Positive, Vectors, are_directions, directions
from .thrusters import ThrusterSettings
from .wheels import WheelSettings

Array = NDArray[np.float64]

BaseActuation = Literal["ideal", "hardware", "none"]
LEAST_SHARE = 1e-6
"""Tolerance of a unit torque in the check of the actuators."""


class MagneticTorquerSettings(MountedSheet):
    """Magnetic torquers on the base, which unload its wheels; by default none.

    A dipole m in the magnetic field B turns the base with ``m x B``, never about the field.
    """

    section: ClassVar[str] = "magnetic_torquers"

    axes: Annotated[Vectors, AfterValidator(partial(are_directions, most=MOST_TORQUERS))] = Field(
        NO_VECTORS,
        description="directions of the dipoles in the base frame: x, y, z of each torquer, one "
        "after the other ([0.0]: no torquers)",
    )
    max_dipole: Positive = Field(
        [100.0],
        description="largest dipole either way, A m2; one value for all torquers, or one per "
        "torquer",
    )

    @property
    def unit_axes(self) -> Array:
        """(M, 3) directions of the dipoles as unit vectors in the base frame."""
        return directions(self.axes)


class BaseActuatorSettings(StrictModel):
    """Settings of the base's actuators, as in a file of config/actuators."""

    base_actuation: BaseActuation = Field(
        "ideal",
        description="torque on the base: ideal (the commanded torque), hardware (wheels, "
        "thrusters), none (the base floats freely)",
    )
    wheels: WheelSettings = WheelSettings()
    thrusters: ThrusterSettings = ThrusterSettings()
    magnetic_torquers: MagneticTorquerSettings = MagneticTorquerSettings()

    @property
    def controls_base(self) -> bool:
        """True if the base has actuators; else it floats freely."""
        return self.base_actuation != "none"

    @property
    def wheel_count(self) -> int:
        """Number of wheels, W."""
        return self.wheels.count

    @property
    def thruster_count(self) -> int:
        """Number of thrusters, T."""
        return self.thrusters.count

    @property
    def torquer_count(self) -> int:
        """Number of magnetic torquers, M."""
        return self.magnetic_torquers.count

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the individually commanded actuators: wheels, thrusters, magnetic torquers."""
        counts = (self.wheel_count, self.thruster_count, self.torquer_count)
        kinds = zip(("wheel", "thruster", "torquer"), counts, strict=True)
        return tuple(f"{kind}_{i + 1}" for kind, count in kinds for i in range(count))

    def robot_names(self, robot: Robot) -> RobotNames:
        """Return the names of all measured and commanded quantities of ``robot``."""
        names, wheels = self.names, self.wheel_count
        thrusters = wheels + self.thruster_count
        return RobotNames(
            robot.joint_names,
            names[:wheels],
            names[wheels:thrusters],
            robot.passive_names,
            robot.geared_names,
            torquers=names[thrusters:],
        )

    def check(self, robot: Robot, file: str) -> None:
        """Check that the settings are consistent and fit a robot.

        Args:
            robot: with the base that carries them.
            file: of the settings: a name in config/actuators, or a path.

        Raises:
            InputError: they are inconsistent; names file and key.
        """
        try:
            self._check(robot)
        except InputError as error:
            raise InputError(f"actuators {file}: {error}") from None

    def _check(self, robot: Robot) -> None:
        sheets = (self.wheels, self.thrusters, self.magnetic_torquers)
        parts = [sheet.section for sheet in sheets if sheet.count]
        if self.base_actuation != "hardware":
            if parts:
                raise InputError(
                    f"{parts[0]} are for base_actuation hardware, got {self.base_actuation!r}"
                )
            return
        if self.torquer_count and not self.wheel_count:
            raise InputError("magnetic_torquers unload wheels: there are no wheels.axes")
        if not parts:
            raise InputError("base_actuation is hardware: no wheels.axes or thrusters.positions")
        self.wheels.check(robot.inertia[0])
        self.thrusters.check()
        self.magnetic_torquers.values("max_dipole")  # one value, or one per torquer
        _check_torques(self)


def _check_torques(settings: BaseActuatorSettings) -> None:
    axes, torques = settings.wheels.unit_axes, settings.thrusters.torques
    if not len(torques):
        if np.linalg.matrix_rank(axes, tol=LEAST_SHARE) < 3:
            raise InputError(
                "wheels.axes must span all directions: the wheels cannot produce all torques"
            )
        return
    sizes = np.linalg.norm(torques, axis=1)
    turning = torques[sizes > LEAST_SHARE * sizes.max()] if sizes.max() > 0.0 else torques[:0]
    columns = np.vstack([axes, -axes, turning / np.linalg.norm(turning, axis=1)[:, None]]).T
    for i, name in enumerate("xyz"):
        for sign in (1.0, -1.0):
            wanted = sign * np.eye(3)[i]
            if not _can_push(columns, wanted):
                side = "positive" if sign > 0.0 else "negative"
                raise InputError(
                    f"thrusters.directions: no {side} torque about {name} is possible with the "
                    "thrusters" + (" and wheels" if len(axes) else "")
                )


def _can_push(columns: Array, wanted: Array) -> bool:
    # a linear program, because SciPy 1.15 returns a wrong residual of nnls
    from scipy.optimize import linprog  # slow to import

    if not columns.size:
        return False
    solved: Any = linprog(np.zeros(columns.shape[1]), A_eq=columns, b_eq=wanted)
    return bool(solved.status == 0)
