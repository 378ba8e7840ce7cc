"""Nominal flight of a law, and the changes of a run."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Self

from space_robot_model.elementary.linear_algebra import principal_axes
from space_robot_model.elementary.matrices import product, rotate_tensor
from space_robot_model.robot import Robot
from space_robot_model.robot.parts import Plate
from space_robot_model.robot.shapes import plates_of
from space_robot_msgs_py.config.files import flatten
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotNames

from ...api import Scenario
from ...flight.plan import Flight
from ...scenario.node_settings import NODES
from ...scenario.resolved import ResolvedScenario
from ...scenario.varied import Variation, varied

Array = NDArray[np.float64]


def rotation(turn: ArrayLike) -> Array:
    """Return the rotation matrix (3, 3) of a Cayley vector: angle ``2 atan(|turn| / 2)``, rad."""
    x, y, z = 0.5 * np.asarray(turn, dtype=np.float64)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    scale = 2.0 / (1.0 + (x * x + y * y + z * z))
    result: Array = np.eye(3) + scale * (cross + product(cross, cross))
    return result


def spread(inertia: Array, factors: ArrayLike, turn: ArrayLike) -> Array:
    """Scale the principal second moments of mass of an inertia, and rotate it.

    The second moments ``tr(I)/2 E - I`` of a body are positive semidefinite. Positive factors along
    their principal axes keep them so, hence the result is physically consistent for all factors.

    Args:
        inertia: (3, 3) kg m2, about the centre of mass.
        factors: (3,) above 0, of the second moments in ascending order.
        turn: (3,) rad, see `rotation`.

    Returns:
        (3, 3) kg m2.
    """
    moments, axes = principal_axes(0.5 * _trace(inertia) * np.eye(3) - inertia)
    # some are 0 for a plate or a rod, and may be negative by rounding
    scaled = np.maximum(moments, 0.0) * np.asarray(factors, dtype=np.float64)
    second = rotate_tensor(product(rotation(turn), axes), np.diag(scaled))
    return _trace(second) * np.eye(3) - 0.5 * (second + second.T)


def _trace(matrix: Array) -> float:
    return float(matrix[0, 0] + matrix[1, 1] + matrix[2, 2])


@dataclass
class Spread:
    """Arguments of `spread` for one body."""

    factors: list[float] = field(default_factory=lambda: [1.0, 1.0, 1.0])
    turn: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])


class RobotArrays:
    """Copies of a robot's arrays; body 0 is the base, body j + 1 is moved by joint j."""

    def __init__(self, robot: Robot, has_surfaces: bool) -> None:
        """Copy the arrays; with the plates of its shapes if drag or sunlight act on them.

        So these keep their place, whatever becomes of masses and inertias.
        """
        self.nominal, self._has_surfaces = robot, has_surfaces
        self.mass = robot.mass.copy()
        self.inertia = robot.inertia.copy()
        self.com = robot.com.copy()
        self.friction = list(robot.friction)
        self.springs = list(robot.springs)
        self.gears = list(robot.gears)
        self.spreads: defaultdict[int, Spread] = defaultdict(Spread)
        """By index of the body."""

    @cached_property
    def plates(self) -> list[Plate]:
        """The plates for drag and sunlight; callers may change them."""
        return list(plates_of(self.nominal))

    def robot(self) -> Robot:
        """Build the robot.

        Raises:
            InputError: its plates reflect more light than falls on them.
        """
        plates = self.plates if self._has_surfaces or "plates" in vars(self) else ()
        _check_shares(plates)
        inertia, shift = self.inertia.copy(), -self.com[0]
        for body, own in self.spreads.items():
            inertia[body] = spread(inertia[body], own.factors, own.turn)
        changed = replace(
            self.nominal,
            mass=self.mass,
            inertia=inertia,
            com=self.com,
            friction=tuple(self.friction),
            springs=tuple(self.springs),
            gears=tuple(self.gears),
            plates=tuple(plates) or self.nominal.plates,
        )
        return _with_base_moved(changed, shift) if shift.any() else changed


def _check_shares(plates: Sequence[Plate]) -> None:
    for number, plate in enumerate(plates, 1):
        if plate.specular + plate.diffuse > 1.0 + 1e-12:
            raise InputError(
                f"plate {number}: specular {plate.specular:g} and diffuse {plate.diffuse:g} are "
                "shares of the same light: their sum must be at most 1"
            )


def _with_base_moved(robot: Robot, shift: Array) -> Robot:
    """Shift everything on the base by ``shift``: the base's frame stays at its CoM."""
    offset, com = robot.offset.copy(), robot.com.copy()
    com[0] = 0.0
    for joint in np.flatnonzero(robot.parent == 0):
        # no BLAS, whose last digits depend on the processor
        offset[joint] += np.sum(robot.rotation[joint].T * shift, axis=1)
    tools = tuple(t if t.body else replace(t, position=t.position + shift) for t in robot.tools)
    visuals = tuple(v if v.body else replace(v, position=v.position + shift) for v in robot.visuals)
    plates = tuple(p if p.body else replace(p, centre=p.centre + shift) for p in robot.plates)
    return replace(robot, com=com, offset=offset, tools=tools, visuals=visuals, plates=plates)


class Nominal(NamedTuple):
    """Nominal flight of a law, without variations."""

    scenario: Scenario
    robot: Robot
    names: RobotNames
    """Names of axes, wheels and thrusters."""
    parameters: dict[str, dict[str, Any]]
    """All parameters by node and dotted name."""
    law: str
    gains: dict[str, list[float]]
    """Gains of the law that is active at the start."""
    resolved: ResolvedScenario

    @classmethod
    def of(cls, scenario: Scenario) -> Self:
        """Resolve robot, parameters and gains of a scenario.

        Raises:
            InputError: it cannot be flown.
        """
        flight = scenario.check()
        settings = {node: getattr(flight.scenario, node) for node in NODES}
        return cls(
            scenario,
            flight.robot,
            flight.plant.names,
            {node: dict(flatten(own.model_dump())) for node, own in settings.items()},
            flight.law.name,
            flight.scenario.gains_used,
            flight.scenario,
        )


class Changes:
    """Changes of one run, accumulated over the variables."""

    def __init__(self, nominal: Nominal) -> None:
        self.nominal = nominal
        self.options: dict[str, Any] = {}
        self.faults: list[str] = []
        self._parameters: dict[str, dict[str, Any]] = {}
        self._robot: RobotArrays | None = None

    def on(self, nominal: Nominal) -> Changes:
        """Return changes of the same options for another nominal flight."""
        changes = Changes(nominal)
        changes.options = self.options
        return changes

    @property
    def robot(self) -> RobotArrays:
        """The plant's robot; callers may change it."""
        if self._robot is None:
            nominal = self.nominal
            self._robot = RobotArrays(nominal.robot, nominal.resolved.plant.has_surfaces)
        return self._robot

    def parameter(self, node: str, name: str) -> Any:
        """Return the present value of a node's parameter; callers may change a list."""
        changed = self._parameters.setdefault(node, {})
        if name not in changed:
            value = self.nominal.parameters[node][name]
            changed[name] = list(value) if isinstance(value, list) else value
        return changed[name]

    def set_parameter(self, node: str, name: str, value: Any) -> None:
        """Change a node's parameter."""
        self._parameters.setdefault(node, {})[name] = value

    def gain(self, name: str) -> list[float]:
        """Return a gain of the law, one number per axis; callers may change it."""
        key = f"{self.nominal.law}.{name}"
        own = self._parameters.setdefault("controller", {})
        if key not in own:
            own[key] = list(self.nominal.gains[name])
        gain: list[float] = own[key]
        return gain

    def flight(self, seed: int) -> Flight:
        """Return the flight with these changes, see `Scenario.check`.

        Raises:
            InputError: it cannot be flown.
        """
        resolved = None if self.options else varied(self.nominal.resolved, self._variation(seed))
        if resolved is None:
            return self.scenario(seed=seed).check()
        flight = Flight(resolved)
        flight.check_in_process()
        return flight

    def _variation(self, seed: int) -> Variation:
        return Variation(
            seed,
            None if self._robot is None else self._robot.robot(),
            [*self.nominal.scenario.faults, *self.faults],
            self._parameters,
        )

    def scenario(self, **options: Any) -> Scenario:
        """Return the flight with these changes and further options."""
        options_written = self.nominal.scenario.given
        merged = {**options_written, **self.options, **options}
        if self._robot is not None:
            merged["plant_robot"] = self._robot.robot()
        if self.faults:
            merged["faults"] = [*options_written.get("faults", ()), *self.faults]
        if self._parameters:
            own = options_written.get("parameters", {})
            merged["parameters"] = {
                node: {**own.get(node, {}), **self._parameters.get(node, {})}
                for node in {**own, **self._parameters}
            }
        return Scenario(**merged)
