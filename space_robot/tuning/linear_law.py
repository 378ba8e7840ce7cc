"""The linear part of a control law near rest, from the law's own code.

Without its switching terms (`law_trial.SWITCHING`) a law is linear in its signals and its memory,
inside a boundary layer as well. It is differentiated by running it: one tick at rest, so that
observers have begun, then two ticks for each signal and each number of its memory, moved by
`law_trial.STEP` and by twice as much, of which the difference counts: a jump at rest, as of a sign
function, is not in it. With inputs y, x the part of the memory that has influence, and F_S the
force,

    x_k+1 = A x_k + B y_k,    F_k = C x_k + D y_k,    y = [e, edot, rho, rhodot, F_applied, N_hat].

With the gain ``h_bar: nominal`` the force has the ``H_S u`` that the controller adds. States that a
law in Python keeps outside of its memory count as constant.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_control.laws import CompiledLaw, ControlLaw, Signals
from space_robot_control.laws.base import CONSTANT_INERTIA, NOMINAL_INERTIA, LawError, force_of
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.compiled.records import Block, assign
from space_robot_msgs_py.config.text import one_line_of

from .inertia import J0, Posture


class LinearLaw(NamedTuple):
    """A law near rest in a posture, on its last m axes; see the module."""

    period: float
    estimate: Array | None
    """(m, m) inertia of the law's time-delay estimate; None: it has none."""
    step: Array
    """A, (S, S)."""
    state_by: Mapping[str, Array]
    """B, (S, m) by each of `law_trial.INPUTS`."""
    force_by_state: Array
    """C, (m, S)."""
    force_by: Mapping[str, Array]
    """D, (m, m) by each of `law_trial.INPUTS`."""

    def uses(self, name: str) -> bool:
        """Return True if the force depends on one of `law_trial.INPUTS`, at once or later."""
        return bool(self.force_by[name].any() or self.state_by[name].any())

    def force_by_rate(self, weight: float = 1.0) -> Array:
        """Return the force (m, m) of a tick by noise on the rates measured in the same tick, N m s.

        The noise is in edot, rhodot and N_hat: in this as ``-w H^ / period`` with the estimate's
        inertia H^ and the ``weight`` w of the low-pass of its pair (1: none).
        """
        force = self.force_by["rho_rate"] - self.force_by["error_rate"]
        if self.estimate is not None:
            force = force - weight / self.period * self.force_by["n_hat"] @ self.estimate
        return force


def linear_law(law: ControlLaw, posture: Posture, inertia_scale: float = 1.0) -> LinearLaw:
    """Return the linear part of a law in a posture.

    Args:
        law: with its gains and period; it is not changed.
        posture: of the nominal robot.
        inertia_scale: factor on the inertia that a law without ``uses_model`` assumes of the robot:
            on `INERTIA_GAINS`, or on H_S of its estimate.
    """
    trial = LawTrial(law, posture, inertia_scale)
    axes = posture.axes
    columns = {name: trial.input_columns(name, axes) for name in INPUTS}
    by_state = trial.memory_columns()
    step, force_by_state = by_state[axes:], by_state[:axes]
    by_input = np.hstack([column[axes:] for column in columns.values()])
    kept = _influential(step, by_input, force_by_state)
    return LinearLaw(
        law.period,
        assumed_inertia(law, posture, inertia_scale),
        step[np.ix_(kept, kept)],
        {name: column[axes:][kept] for name, column in columns.items()},
        force_by_state[:, kept],
        {name: column[:axes] for name, column in columns.items()},
    )


def assumed_inertia(law: ControlLaw, posture: Posture, scale: float = 1.0) -> Array | None:
    """Return the inertia (m, m) of the law's time-delay estimate times ``scale``, if it has one."""
    if law.estimate == CONSTANT_INERTIA:
        return scale * np.diag(law.h_bar[-posture.axes :])
    return scale * posture.inertia if law.estimate == NOMINAL_INERTIA else None


def linear_laws(
    law: ControlLaw, postures: Sequence[Posture], inertia_scale: float = 1.0
) -> list[LinearLaw]:
    """Return the `linear_law` in each posture.

    One without nominal inertia is computed in the first and the last; if equal, it is in all.
    """
    outer = postures[:: max(1, len(postures) - 1)]
    first, *last = (linear_law(law, posture, inertia_scale) for posture in outer)
    pairs = [(first.force_by[name], own.force_by[name]) for own in last for name in INPUTS]
    if not law.needs_model and all(np.allclose(*pair, rtol=1e-5) for pair in pairs):
        return [first] * len(postures)
    inner = [linear_law(law, posture, inertia_scale) for posture in postures[1:-1]]
    return [first, *inner, *last]


def _influential(step: Array, by_input: Array, force_by_state: Array) -> Sequence[int]:
    """Return the states that an input reaches and the force depends on, at once or later."""
    by_inputs, to_force = (by_input != 0.0).any(axis=1), (force_by_state != 0.0).any(axis=0)
    return np.flatnonzero(_spread(by_inputs, step) & _spread(to_force, step.T)).tolist()


def _spread(reached: NDArray[np.bool_], step: Array) -> NDArray[np.bool_]:
    """Return the states that are reached, from those that are, through any number of ticks."""
    while True:
        more: NDArray[np.bool_] = np.logical_or(reached, (step[:, reached] != 0.0).any(axis=1))
        if np.array_equal(more, reached):
            return more
        reached = more


INPUTS = ("error", "error_rate", "rho", "rho_rate", "applied_force", "n_hat")
"""The signals that a law is differentiated by."""
SWITCHING = ("k_1", "k_2", "gamma")
"""Gains of terms that are not linear; so is ``g`` without a boundary layer ``delta``."""
INERTIA_GAINS = ("h_bar", "inertia")
"""Gains that are the inertia which a law assumes of each axis."""
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
STEP = 2.0**-33
"""By which inputs are moved: inside any boundary layer, and a power of two, so that columns of a
law at rest are exact."""


class LawTrial:
    """A copy of a law that runs single ticks from the same memory."""

    def __init__(self, law: ControlLaw, posture: Posture, inertia_scale: float = 1.0) -> None:
        """Run the law for one tick at rest."""
        self._law, self._posture = _copied_law(law), posture
        gains = self._law.gain_values
        switching = SWITCHING if "delta" in gains else (*SWITCHING, "g")
        for name, values in gains.items():
            if name in switching:
                values[:] = 0.0
            elif name in INERTIA_GAINS:
                values *= inertia_scale
        self._block = self._at_rest(1.0 if law.uses_model else inertia_scale)
        self._bytes = self._block.view(np.uint8)
        self._rest_bytes = self._bytes.copy()
        self._signals = Signals.view(self._block)
        self._signals.robot = posture.robot
        self._inputs = {name: getattr(self._signals, name)[-posture.axes :] for name in INPUTS}
        self._law.reset()
        self._tick()
        self._saved = self._law.save()
        self._numbers: Array = self._law.memory_block.view(np.float64).reshape(-1)
        self._rest_numbers = self._numbers.copy()
        self._rest = self._after_tick()

    def _at_rest(self, inertia_scale: float) -> Block:
        """Return signals of a robot at rest in the posture."""
        posture = self._posture
        block: Block = Signals.block(posture.robot.n)
        signals: Signals = block[0]
        inertia = np.eye(posture.robot.n + 3)
        inertia[-posture.axes :, -posture.axes :] = inertia_scale * posture.inertia
        place = {"quaternion": UPRIGHT, "joint_positions": posture.joints}
        assign(signals, model=posture.robot.model, attitude_error=UPRIGHT, **place)
        assign(signals.reference, **place)
        assign(signals.nominal, inertia=inertia)
        assign(signals, base_is_free=posture.axes == posture.robot.n)
        return block

    def input_columns(self, name: str, axes: int) -> Array:
        """Return changes of force and memory by a signal, one column for each axis."""
        columns = []
        for unit in np.eye(axes):
            ticks = []
            for step in (STEP, 2.0 * STEP):
                self._restore()
                self._bytes[:] = self._rest_bytes
                self._inputs[name][:] = step * unit
                if name in ("rho", "rho_rate"):
                    self._move_state()
                ticks.append(self._after_tick())
            columns.append(_slope(*ticks))
        return np.stack(columns, axis=1)

    def memory_columns(self) -> Array:
        """Return changes of force and memory by each number of the memory.

        Those of fields through which no force changes are zero.
        """
        size = len(self._numbers)
        columns = np.zeros((self._posture.axes + size, size))
        self._bytes[:] = self._rest_bytes
        for index in np.flatnonzero(self._may_matter()):
            ticks = []
            for step in (STEP, 2.0 * STEP):
                self._restore()
                self._numbers[index] += step
                ticks.append(self._after_tick())
            columns[:, index] = _slope(*ticks)
        return columns

    def _may_matter(self) -> NDArray[np.bool_]:
        """Return for each number of the memory whether its field may change the force.

        Whole fields are moved, so that scratch, of which there may be a lot, costs one tick each.
        """
        axes, types = self._posture.axes, self._law.memory_block.dtype
        assert types.names
        assert types.fields
        self._bytes[:] = self._rest_bytes
        size, changes = types.itemsize // 8, {}
        ranges = {
            name: slice(types.fields[name][1] // 8, types.fields[name][1] // 8 + own.itemsize // 8)
            for name, own in ((name, types[name]) for name in types.names)
        }
        for name, own in ranges.items():
            self._restore()
            self._numbers[own] += STEP * np.arange(1.0, 1.0 + own.stop - own.start)
            after = self._after_tick()
            changes[name] = (after != self._rest) & ~np.isnan(after)
        matters = np.zeros(axes + size, dtype=np.bool_)
        matters[:axes] = True
        for _ in ranges:
            for name, own in ranges.items():
                if np.any(changes[name] & matters):
                    matters[axes + own.start : axes + own.stop] = True
        return matters[axes:]

    def _restore(self) -> None:
        """Restore the law after its tick at rest; a compiled one has nothing but its memory."""
        if isinstance(self._law, CompiledLaw):
            self._numbers[:] = self._rest_numbers
        else:
            self._law.restore(self._saved)

    def _after_tick(self) -> Array:
        return np.concatenate([self._tick(), self._numbers])

    def _tick(self) -> Array:
        force = force_of(self._law, self._signals, 0)
        last: Array = force[-self._posture.axes :].copy()
        return last

    def _move_state(self) -> None:
        """Let attitude and joints move with rho, the displacement from the posture."""
        signals = self._signals
        signals.joint_positions[:] += signals.rho[3:]
        signals.joint_velocities[:] = signals.rho_rate[3:]
        if self._posture.axes > self._posture.robot.n:
            signals.quaternion[1:] = signals.attitude_error[1:] = signals.rho[:3]
            signals.omega_base[:] = signals.rho_rate[:3] / J0


def _copied_law(law: ControlLaw) -> ControlLaw:
    """Return a copy of a law.

    Raises:
        LawError: it is a user's that cannot be copied.
    """
    try:
        return copy.deepcopy(law)
    except Exception as error:
        raise LawError(f"controller {law.name} cannot be copied ({one_line_of(error)})") from error


def _slope(once: Array, twice: Array) -> Array:
    """Return changes by a unit of what was moved by `STEP` and by twice as much; none for NaN."""
    slope: Array = (twice - once) / STEP
    slope[np.isnan(slope)] = 0.0
    return slope
