"""Base classes of control laws: signals, gains, memory, one equation, and the call of it."""

from __future__ import annotations

import copy
import signal
import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.model import Model
from space_robot_model.dynamics.rho_space import RhoSpaceModel
from space_robot_model.dynamics.tool_kinematics import ToolKinematics
from space_robot_model.robot import Robot
from space_robot_model.robot.kinematics import tool_state
from space_robot_msgs_py.compiled.kernels import RecordFunction, keep_types
from space_robot_msgs_py.compiled.records import (
    Block,
    Field,
    Record,
    RecordOwner,
    RecordView,
    nested,
    prefix,
    shaped,
)
from space_robot_msgs_py.config.text import one_line_of
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import SpaceRobotError
from space_robot_msgs_py.samples import LawInForce, Reference

from .gains import AxisField, GainRange, LawGains, per_axis

Array = NDArray[np.float64]

NO_ESTIMATE, CONSTANT_INERTIA, NOMINAL_INERTIA = range(3)
"""Inertia of a law's time-delay estimate, see `ControlLaw.estimate`."""
_BLOCKS = ("gains_block", "memory_block")
"""Attributes of a law that hold its memory."""


class SignalsView(RecordView):
    """Signals for laws in Python: the fields, and what is computed on demand."""

    robot: Robot
    """The robot as the controller knows it, without payload."""

    def tool_state(self, tool: str | None = None) -> ToolKinematics:
        """Return pose and Jacobians of a tool of the nominal robot; see `Signals.tool_state`."""
        signals: Any = self
        return tool_state(self.robot, signals.quaternion, signals.joint_positions, tool)


class Signals(Record):
    """Inputs of a law at a tick, in the coordinates ``rho = [eps_e, theta]``, m = n+3 axes.

    eps_e is the vector part of ``attitude_error``; it is desired to be zero.
    The state is the one that flight software knows: measured, or estimated by navigation. For a
    base without attitude actuators all signals of m axes are zero on the base's.
    """

    view_type = SignalsView

    error: Array = per_axis("e = rho_d - rho")
    error_rate: Array = per_axis("edot")
    acceleration_desired: Array = per_axis("rhodd_d")
    n_hat: Array = per_axis("time-delay estimate N_hat of (35), (36)", "N m")
    """Zero for laws without time-delay estimate."""
    tick: float = shaped(lambda n: (), "number of the tick")
    time: float = shaped(lambda n: (), "simulated time, s")
    quaternion: Array = shaped(lambda n: (4,), "base attitude [w, x, y, z], base to inertial frame")
    """As measured or estimated, of either sign."""
    attitude_error: Array = shaped(
        lambda n: (4,), "q_e = q_d* q [w, x, y, z], base to desired frame; free base: to inertial"
    )
    """The sign is the one for which rho is continuous."""
    omega_base: Array = shaped(lambda n: (3,), "angular velocity in the base frame, rad/s")
    joint_positions: Array = shaped(lambda n: (n,), "rad, or m for prismatic joints")
    joint_velocities: Array = shaped(lambda n: (n,), "rad/s, or m/s")
    rho: Array = per_axis("rho = [eps_e, theta]")
    rho_rate: Array = per_axis("rhodot")
    rho_step: Array = per_axis("step of rho since the last tick by one of the reference")
    """Zero while the base's reference moves continuously; no torque causes it."""
    rate_step: Array = per_axis("step of rhodot by the same")
    applied_force: Array = per_axis("F_S applied over the last interval", "N m")
    paired_force: Array = per_axis("the same through the low-pass of the time-delay pair", "N m")
    paired_acceleration: Array = per_axis("mean rhodd of that interval, through the same low-pass")
    base_is_free: float = shaped(lambda n: (), "1 if nothing turns the base, else 0", uniform=True)
    reference: Reference = nested(Reference)
    """Desired motion of base and joints."""
    nominal: RhoSpaceModel = nested(RhoSpaceModel)
    """``inertia`` (m, m) H_S and ``bias`` (m,) c_S; filled only for laws with ``uses_model``, and
    for a time-delay estimate with the nominal inertia.

    For a base without attitude actuators they are those of
    `space_robot_model.dynamics.rho_space`.
    """
    model: Model = nested(Model)
    """Numbers of the nominal robot for the algorithms of `space_robot_model.dynamics`."""
    robot: Robot
    """The same robot; for laws in Python only."""

    def tool_state(self, tool: str | None = None) -> ToolKinematics:
        """Return pose and Jacobians of a tool of the nominal robot; for laws in Python only.

        Args:
            tool: its name; None: the robot's first.

        Raises:
            InputError: the robot has no such tool.
        """
        raise NotImplementedError("signals in kernels have no robot")


class LawMemory(Record):
    """Last outputs of a law; base class of its internal states."""

    s: Array = per_axis("sliding surface", "1/s")
    """Zero for a law without sliding surface."""
    u: Array = per_axis("pseudo-acceleration", "rad/s2 (eps: 1/s2)")
    force: Array = per_axis("generalised force F_S", "N m")


class ControlLaw(RecordOwner, ABC):
    """Base class of a control law on m = n+3 axes with a fixed period.

    A new law is a subclass with a ``name``, its gains, and `force` (or, as `CompiledLaw`, a
    kernel). A law with a gain ``h_bar`` receives the time-delay estimate; one with ``uses_model``
    the nominal model (never the payload, friction or disturbance).

    The inertia of the estimate is constant, ``h_bar``, or with the gain ``h_bar: nominal`` the
    inertia H_S of the nominal model: then ``h_bar`` is zero in the law's equation, and the
    controller adds ``H_S u`` to the force in place of ``h_bar u``.
    """

    name: ClassVar[str]
    gains_type: ClassVar[type[LawGains]]
    memory_type: ClassVar[type[LawMemory]] = LawMemory
    uses_model: ClassVar[bool] = False
    estimates_with_model: ClassVar[bool] = False
    """True for a law without ``h_bar`` whose N_hat is always that of the nominal inertia."""
    _views = ("gains", "memory", "h_bar")

    def __init__(self, gains: Mapping[str, Array], period: float, axes: int | None = None) -> None:
        """Set the gains; the memory is zero.

        Args:
            gains: an (m,) array for each of ``gains_type``, but optional ones.
            period: of the controller, s.
            axes: m; needed only for a law without gains.
        """
        n = (axes or len(next(iter(gains.values())))) - 3
        self.period = period
        self.gains_block = self.gains_type.block(n)
        self.memory_block = self.memory_type.block(n)
        self._bind_views()
        self._given = self.optional_gains() & gains.keys()
        self.gain_values = gains
        self.reset()

    def _bind_views(self) -> None:
        self.gains: Any = self.gains_type.view(self.gains_block)
        """The gains as attributes."""
        self.memory: Any = self.memory_type.view(self.memory_block)
        """s and u of the last tick, and the law's internal states, as attributes."""
        self.h_bar: Array = getattr(self.gains, "h_bar", np.zeros(0))
        """(m,) h_bar of the time-delay estimate, kg m2; zero for the nominal inertia, empty without
        an estimate."""

    def save(self) -> dict[str, Any]:
        """Copy gains, memory and all other attributes, for `restore`."""
        return copy.deepcopy(self.__getstate__())

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Restore a saved state."""
        for name, value in copy.deepcopy(dict(saved)).items():
            if name in _BLOCKS:
                getattr(self, name)[:] = value
            else:
                setattr(self, name, value)

    @classmethod
    def gain_descriptions(cls) -> dict[str, str]:
        """Return meaning and unit of each gain by its name for the user."""
        fields = cls.gains_type.fields().items()
        return {name.rstrip("_"): f.description for name, f in fields if isinstance(f, Field)}

    @classmethod
    def gain_ranges(cls) -> dict[str, GainRange]:
        """Return where to search for each gain, by its name for the user, as far as declared."""
        fields = cls.gains_type.fields().items()
        return {n.rstrip("_"): f.range for n, f in fields if isinstance(f, AxisField) and f.range}

    @classmethod
    def optional_gains(cls) -> set[str]:
        """Return the names of the gains that are zero unless they are given."""
        fields = cls.gains_type.fields().items()
        return {n.rstrip("_") for n, f in fields if isinstance(f, AxisField) and f.is_optional}

    @classmethod
    def required_gains(cls) -> set[str]:
        """Return the names of the gains that a gain set must have."""
        return cls.gain_descriptions().keys() - cls.optional_gains()

    @property
    def gain_values(self) -> dict[str, Array]:
        """(m,) array of each gain by its name for the user."""
        return {name.rstrip("_"): self.gains_block[name][0] for name in self.gains_type.fields()}

    @gain_values.setter
    def gain_values(self, values: Mapping[str, Array]) -> None:
        optional = self.optional_gains()
        for name, gain in self.gain_values.items():
            gain[:] = values.get(name, 0.0) if name in optional else values[name]
        self._given |= {name for name in optional - self._given if self.gain_values[name].any()}

    @property
    def given_gains(self) -> dict[str, Array]:
        """The `gain_values` as they are printed and recorded.

        Without optional gains that were never given, nor other than zero.
        """
        left_out = self.optional_gains() - self._given
        return {name: gain for name, gain in self.gain_values.items() if name not in left_out}

    def in_force(self, tick: int, is_first: bool = False) -> LawInForce:
        """Return the law with its present gains as recorded: in force from ``tick`` on."""
        gains = {name: tuple(values.tolist()) for name, values in self.given_gains.items()}
        return LawInForce(tick, self.name, gains, is_first)

    @property
    def estimate(self) -> int:
        """Inertia of the time-delay estimate.

        `NO_ESTIMATE`, `CONSTANT_INERTIA` (``h_bar``) or `NOMINAL_INERTIA` (H_S).
        """
        if self.h_bar.size:
            return CONSTANT_INERTIA if self.h_bar.any() else NOMINAL_INERTIA
        return NOMINAL_INERTIA if self.estimates_with_model else NO_ESTIMATE

    @property
    def needs_model(self) -> bool:
        """True if the law, or its time-delay estimate, uses the nominal model."""
        return self.uses_model or self.estimate == NOMINAL_INERTIA

    @property
    def needs(self) -> tuple[Array, int, bool]:
        """``h_bar``, `estimate` and `needs_model`: what the signals have to hold."""
        estimate = self.estimate  # once: it takes a microsecond
        return self.h_bar, estimate, self.uses_model or estimate == NOMINAL_INERTIA

    @property
    def adds_inertia(self) -> bool:
        """True if ``H_S u`` is added to the law's force, see `force_of`."""
        return self.estimate == NOMINAL_INERTIA and self.h_bar.size > 0

    def reset(self) -> None:
        """Clear the memory (integrals, last errors); called when the law is activated."""
        self.memory_block[:] = np.zeros_like(self.memory_block)

    @abstractmethod
    def force(self, signals: Signals) -> Array:
        """Return the generalised force F_S (m,), N m; valid until the next call."""


class SomeGains(Record):
    """Common beginning of the gains of all laws, as which compiled loops see them."""

    first: Array = per_axis("first gain")


class LawCode(NamedTuple):
    """A law for compiled loops; the type is the same for every law."""

    run: Any
    """The kernel as a function of `Signals`, `SomeGains`, `LawMemory` and the period."""
    gains: Block
    """A block of `SomeGains`."""
    memory: Block
    """A block of `LawMemory`."""
    h_bar: Array
    """(m,) h_bar of the time-delay estimate, kg m2; empty if the law has none."""
    estimate: int
    """See `ControlLaw.estimate`."""
    uses_model: bool
    """See `ControlLaw.needs_model`."""
    adds_inertia: bool
    """See `ControlLaw.adds_inertia`."""


keep_types(LawCode, lambda code: code.run)


class CompiledLaw(ControlLaw):
    """A law with a ``kernel`` (and a ``memory_type``, if it has internal states)."""

    @staticmethod
    @abstractmethod
    def kernel(signals: Signals, gains: Any, memory: Any, period: float) -> None:
        """Compute ``memory.s``, ``memory.u`` and ``memory.force`` of a tick; a `kernel`.

        Args:
            signals: of this tick; read only.
            gains: a record of ``gains_type``.
            memory: a record of ``memory_type``.
            period: of the controller, s.
        """

    @classmethod
    def function(cls, width: int = 1) -> RecordFunction:
        """Return the kernel, compiled for this law's records of numbers of a width."""
        own: list[Any] = [cls.gains_type, cls.memory_type]  # classes are hashable
        return _compiled(cls.kernel, *own, width)

    @property
    def code(self) -> LawCode:
        """The law for compiled loops; gains and memory are shared, not copied."""
        n = len(self.memory.s) - 3
        gains = prefix(self.gains_block, SomeGains.dtype(n))
        memory = prefix(self.memory_block, LawMemory.dtype(n))
        return LawCode(self.function(), gains, memory, *self.needs, self.adds_inertia)

    def force(self, signals: Signals) -> Array:
        """Run the kernel; ``signals`` is a `Signals.view`."""
        n = len(self.memory.s) - 3
        self.function().call(
            signals.address, n, self.gains.address, n, self.memory.address, n, self.period
        )
        force: Array = self.memory.force
        return force


@cache
def _compiled(kernel: Callable[..., None], gains: Any, memory: Any, width: int) -> RecordFunction:
    own, seen = (Signals, gains, memory), (Signals, SomeGains, LawMemory)
    return RecordFunction(kernel, own, seen, width)


class LawError(SpaceRobotError):
    """The code of a law raised an error, called ``sys.exit``, or returned an invalid force."""


def force_of(law: ControlLaw, signals: Signals, tick: int) -> Array:
    """Return the generalised force F_S (m,) of a law, with H_S u if ``h_bar`` is nominal.

    Args:
        law: the active law.
        signals: of the tick.
        tick: number of the tick, for error messages.

    Raises:
        LawError: its code failed, or did not return an array with one number per axis.
    """
    try:
        force = law.force(signals)
    except SpaceRobotError:
        raise
    except BaseException as error:  # a law may be the user's own, and call `sys.exit`
        if _is_of_user(error):
            raise
        place = traceback.extract_tb(error.__traceback__)[-1]
        raise LawError(
            f"controller {law.name} failed at tick {tick}: {one_line_of(error)} "
            f"({Path(place.filename).name}, line {place.lineno})"
        ) from error
    wanted = law.memory.force
    if type(force) is not np.ndarray or (force.shape, force.dtype) != (wanted.shape, wanted.dtype):
        got = f"shape {force.shape}, {force.dtype}" if type(force) is np.ndarray else short(force)
        raise LawError(
            f"controller {law.name} failed at tick {tick}: force() must return {wanted.size} "
            f"numbers, an array of {wanted.dtype}, got {got}"
        )
    if law.adds_inertia:
        for column, u in zip(signals.nominal.inertia.T, law.memory.u, strict=True):
            force = force + column * u  # in the order of the compiled loop, so the bits are its
    return force


def _is_of_user(error: BaseException) -> bool:
    # Ctrl-C: a subclass of KeyboardInterrupt, or the one of Python's own handler
    by_python = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    return isinstance(error, KeyboardInterrupt) and (
        type(error) is not KeyboardInterrupt or by_python
    )
