"""Single ticks of a control law near rest, from which its linear part is made.

A copy of the law runs one tick at rest, so that observers have begun, then two ticks from there for
each change of its signals or its memory, by `STEP` and by twice as much.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from space_robot_control.laws import CompiledLaw, ControlLaw, Signals
from space_robot_control.laws.base import LawError, force_of
from space_robot_msgs_py.compiled.records import Block, assign
from space_robot_msgs_py.config.text import one_line_of

from .inertia import J0
from .postures import Posture

Array = NDArray[np.float64]

INPUTS = ("error", "error_rate", "rho", "rho_rate", "applied_force", "n_hat")
"""The signals that a law is differentiated by."""
SWITCHING = ("k_1", "k_2", "gamma")
"""Gains of terms that are not linear; so is ``g`` without a boundary layer ``delta``."""
OF_INERTIA = ("h_bar", "inertia")
"""Gains that are the inertia which a law assumes of each axis."""
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
STEP = 2.0**-33
"""By which inputs are moved: inside any boundary layer, and a power of two, so that columns of a
law at rest are exact."""


class LawTrial:
    """A copy of a law that runs single ticks from the same memory."""

    def __init__(self, law: ControlLaw, posture: Posture, inertia_scale: float = 1.0) -> None:
        """Run the law for one tick at rest.

        Raises:
            LawError: its code failed.
        """
        self._law, self._posture = _copy_of(law), posture
        gains = self._law.gain_values
        switching = SWITCHING if "delta" in gains else (*SWITCHING, "g")
        for name, values in gains.items():
            if name in switching:
                values[:] = 0.0
            elif name in OF_INERTIA:
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

    def run(self, moved: Mapping[str, Array]) -> Array:
        """Return changes of force and memory in a tick, by signals (m,) that are not zero.

        Raises:
            LawError: the law's code failed.
        """
        ticks = []
        for step in (STEP, 2.0 * STEP):
            self._restore()
            self._bytes[:] = self._rest_bytes
            for name, values in moved.items():
                self._inputs[name][:] = step * values
            if "rho" in moved or "rho_rate" in moved:
                self._move_state()
            ticks.append(self._after_tick())
        return _slope(*ticks)

    def columns_of(self, name: str, axes: int) -> Array:
        """Return changes of force and memory by a signal, one column for each axis."""
        return np.stack([self.run({name: unit}) for unit in np.eye(axes)], axis=1)

    def columns_of_memory(self) -> Array:
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


def _copy_of(law: ControlLaw) -> ControlLaw:
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
