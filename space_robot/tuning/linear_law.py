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

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_control.laws import ControlLaw
from space_robot_control.laws.base import CONSTANT_INERTIA, NOMINAL_INERTIA

from .law_trial import INPUTS, LawTrial
from .postures import Posture

Array = NDArray[np.float64]


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


def linear_law(law: ControlLaw, posture: Posture, inertia_scale: float = 1.0) -> LinearLaw:
    """Return the linear part of a law in a posture.

    Args:
        law: with its gains and period; it is not changed.
        posture: of the nominal robot.
        inertia_scale: factor on the inertia that a law without ``uses_model`` assumes of the robot:
            on `law_trial.OF_INERTIA`, or on H_S of its estimate.

    Raises:
        LawError: the law's code failed.
    """
    trial = LawTrial(law, posture, inertia_scale)
    axes = posture.axes
    columns = {name: trial.columns_of(name, axes) for name in INPUTS}
    by_state = trial.columns_of_memory()
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


def force_by_rate(law: ControlLaw, posture: Posture, weight: float = 1.0) -> Array:
    """Return the force (m, m) of a tick by noise on the rates measured in the same tick, N m s.

    The noise is in edot, rhodot and N_hat: in this as ``-w H^ / period`` with the estimate's
    inertia H^ and the weight w of the low-pass of its pair.

    Args:
        law: with its gains and period; it is not changed.
        posture: of the nominal robot.
        weight: w; 1: no low-pass.

    Raises:
        LawError: the law's code failed.
    """
    trial = LawTrial(law, posture)
    axes, inertia = posture.axes, assumed_inertia(law, posture)
    signals = {"error_rate": -np.eye(axes), "rho_rate": np.eye(axes)}
    if inertia is not None:
        signals["n_hat"] = -weight / law.period * inertia
    columns = [
        trial.run({name: values[:, axis] for name, values in signals.items()})[:axes]
        for axis in range(axes)
    ]
    return np.stack(columns, axis=1)


def assumed_inertia(law: ControlLaw, posture: Posture, scale: float = 1.0) -> Array | None:
    """Return the inertia (m, m) of the law's time-delay estimate times ``scale``, if it has one."""
    if law.estimate == CONSTANT_INERTIA:
        return scale * np.diag(law.h_bar[-posture.axes :])
    return scale * posture.inertia if law.estimate == NOMINAL_INERTIA else None


def linear_laws(
    law: ControlLaw, postures: Sequence[Posture], inertia_scale: float = 1.0
) -> list[LinearLaw]:
    """Return the `linear_law` in each posture."""
    if depends_on_posture(law, postures):
        return [linear_law(law, posture, inertia_scale) for posture in postures]
    return [linear_law(law, postures[0], inertia_scale)] * len(postures)


def depends_on_posture(law: ControlLaw, postures: Sequence[Posture]) -> bool:
    """Return True if a law may be another one in each posture.

    One that needs no nominal inertia is, if it differs in the first and the last posture.
    """
    if law.needs_model:
        return True
    first, last = (linear_law(law, postures[index]).force_by for index in (0, -1))
    return not all(np.allclose(first[name], last[name], rtol=1e-5) for name in INPUTS)


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
