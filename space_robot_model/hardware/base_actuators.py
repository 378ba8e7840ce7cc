"""Actuators of the base: ideal torque, hardware (wheels, thrusters, torquers), or none."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, Field

from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import MOST_THRUSTERS, MOST_TORQUERS, MOST_WHEELS, RobotNames

from ..elementary.matrices import Array
from ..robot import Robot
from .sheets import (
    FEWEST,
    NO_VECTORS,
    MountedSheet,
    Positive,
    Sizes,
    Vectors,
    check_directions,
    check_vectors,
    directions,
    vectors,
)

BaseActuation = Literal["ideal", "hardware", "none"]
LEAST_SHARE = 1e-6
"""Tolerance of a unit torque in the check of the actuators."""
STANDARD_GRAVITY = 9.80665
"""m/s2."""
PER_THRUSTER = "one value for all thrusters, or one per thruster"
Positions = Annotated[Vectors, AfterValidator(partial(check_vectors, most=MOST_THRUSTERS))]
Directions = Annotated[Vectors, AfterValidator(partial(check_directions, most=MOST_THRUSTERS))]
Times = Annotated[list[Annotated[float, Field(ge=0.0, le=1.0)]], FEWEST]
PER_WHEEL = "one value for all wheels, or one per wheel"


class WheelSettings(MountedSheet):
    """Balanced reaction wheels on the base; by default none.

    The base's inertia in the robot's file includes the locked rotors of the wheels.
    """

    section: ClassVar[str] = "wheels"

    axes: Annotated[Vectors, AfterValidator(partial(check_directions, most=MOST_WHEELS))] = Field(
        NO_VECTORS,
        description="spin axes in the base frame: x, y, z of each wheel, one after the other "
        "([0.0]: no wheels)",
    )
    rotor_inertia: Positive = Field(
        [0.01], description=f"inertia of the rotor about its axis, kg m2; {PER_WHEEL}"
    )
    max_torque: Sizes = Field(
        [0.0], description=f"largest torque of the motor, N m (0: no limit); {PER_WHEEL}"
    )
    max_momentum: Sizes = Field(
        [0.0],
        description="momentum (rotor_inertia times speed) up to which the motor accelerates the "
        f"wheel, N m s (0: no limit); {PER_WHEEL}",
    )
    coulomb: Sizes = Field([0.0], description=f"Coulomb friction, N m; {PER_WHEEL}")
    viscous: Sizes = Field([0.0], description=f"viscous friction, N m s/rad; {PER_WHEEL}")
    initial_speed: Vectors = Field(
        [0.0], description=f"speed relative to the base at tick 0, rad/s; {PER_WHEEL}"
    )

    @property
    def unit_axes(self) -> Array:
        """(W, 3) spin axes as unit vectors in the base frame."""
        return directions(self.axes)

    def spin_momenta(self, speeds: Array) -> Array:
        """Return ``J Omega`` (..., W), N m s, for speeds relative to the base (..., W), rad/s."""
        return speeds * self.values("rotor_inertia")

    def check(self, base_inertia: Array) -> None:
        """Check that the settings are consistent with one another and with a base.

        Args:
            base_inertia: (3, 3) of the base with locked wheels about its CoM, kg m2.
        """
        if not self.count:
            return
        values = {name: self.values(name) for name in type(self).model_fields if name != "axes"}
        inertia, axes = values["rotor_inertia"], self.unit_axes
        stored, limits = inertia * np.abs(values["initial_speed"]), values["max_momentum"]
        for i in np.flatnonzero((limits > 0.0) & (stored > limits)):
            raise InputError(
                f"wheels.initial_speed stores {stored[i]:g} N m s in wheel_{i + 1}, "
                f"max_momentum is {limits[i]:g}"
            )
        # the base without its rotors, whose inertia is part of the file's
        moments = np.linalg.eigvalsh(base_inertia - (axes.T * inertia) @ axes)
        if not moments[0] > 0.0:
            raise InputError(
                "wheels.rotor_inertia: the base's inertia must be larger than its rotors', without "
                f"them its smallest principal moment is {moments[0]:g} kg m2"
            )


class ThrusterSettings(MountedSheet):
    """Thrusters on the base, fed from one tank; by default none."""

    section: ClassVar[str] = "thrusters"

    positions: Positions = Field(
        NO_VECTORS,
        description="positions from the base's CoM, in the base frame, m: x, y, z of each "
        "thruster, one behind the other ([0.0]: no thrusters)",
    )
    directions: Directions = Field(
        NO_VECTORS,
        description="directions of the force on the base, in the base frame: x, y, z of each "
        "thruster, one behind the other",
    )
    force: Positive = Field([1.0], description=f"force of an open thruster, N; {PER_THRUSTER}")
    shortest_pulse: Times = Field(
        [0.0],
        description="shortest time for which a valve is open, s, rounded to a whole number of "
        f"ticks; {PER_THRUSTER}",
    )
    delay: Times = Field(
        [0.0],
        description="delay from the command to the valve, s, rounded to a whole number of ticks; "
        f"{PER_THRUSTER}",
    )
    specific_impulse: Positive = Field([220.0], description=f"specific impulse, s; {PER_THRUSTER}")
    propellant: Annotated[float, Field(ge=0.0, le=1e9)] = Field(
        0.0, description="propellant in the tank at tick 0, kg (0: unlimited)"
    )

    @property
    def places(self) -> Array:
        """(T, 3) positions relative to the base's CoM, m, base frame."""
        return vectors(self.positions)

    @property
    def unit_directions(self) -> Array:
        """(T, 3) unit vectors of the forces on the base, base frame."""
        return directions(self.directions)

    @property
    def torques(self) -> Array:
        """(T, 3) torque of each open thruster about the base's CoM, N m, in the base frame."""
        forces = self.unit_directions * self.values("force")[:, None]
        return np.asarray(np.cross(self.places, forces), dtype=np.float64)

    @property
    def mass_flow(self) -> Array:
        """(T,) mass flow of each open thruster, ``F / (I_sp g_0)``, kg/s."""
        impulse = self.values("specific_impulse") * STANDARD_GRAVITY
        flow: Array = self.values("force") / impulse
        return flow

    def ticks(self, name: str, period: float) -> Array:
        """Return the times of the setting ``name`` in whole ticks of ``period``, s, (T,)."""
        return np.round(self.values(name) / period)

    def check(self) -> None:
        """Check that the settings are consistent."""
        pointed = len(vectors(self.directions))
        if pointed != self.count:
            raise InputError(
                f"thrusters.directions are for {pointed} thrusters, thrusters.positions for "
                f"{self.count}"
            )
        for name in ("force", "shortest_pulse", "delay", "specific_impulse"):
            if self.count:
                self.values(name)


class MagneticTorquerSettings(MountedSheet):
    """Magnetic torquers on the base, which unload its wheels; by default none.

    A dipole m in the magnetic field B turns the base with ``m x B``, never about the field.
    """

    section: ClassVar[str] = "magnetic_torquers"

    axes: Annotated[Vectors, AfterValidator(partial(check_directions, most=MOST_TORQUERS))] = Field(
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
    # wheels push either way, thrusters one way: only sums with factors above 0 are allowed
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
