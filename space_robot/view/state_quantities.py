"""Plotted quantities of the state: rates, joints, momentum, errors of what was measured."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from ..analysis.momentum import momentum_of
from .plotted_quantity import AXES, PlottedQuantity

Array = NDArray[np.float64]


def by_unit(
    kind: str,
    title: str,
    names: Sequence[str],
    slides: Sequence[bool],
    values: Array,
    per: str = "",
    is_shown: bool = True,
) -> Iterator[PlottedQuantity]:
    """Yield values of joints, those of revolute ones apart from those of prismatic ones.

    Args:
        kind: of the quantities.
        title: of the same.
        names: of the joints.
        slides: whether each is prismatic.
        values: (N, len(names)).
        per: behind their units, such as ``/s``.
        is_shown: as in `PlottedQuantity`.
    """
    is_prismatic = np.array(slides, dtype=bool)
    for chosen, unit in ((~is_prismatic, "rad"), (is_prismatic, "m")):
        if chosen.any():
            labels = np.array(names)[chosen].tolist()
            yield PlottedQuantity(
                kind, title, f"{unit}{per}", labels, values[:, chosen], is_shown=is_shown
            )


def motion(log: FlightLog) -> Iterator[PlottedQuantity]:
    """Yield angular velocity of the base, and positions and velocities of the joints."""
    yield PlottedQuantity("rates", "base rate", "rad/s", AXES, log.omega_base, is_shown=False)
    slides = log.prismatic[: len(log.joint_names)]
    for kind, values, per in (
        ("positions", log.joint_positions, ""),
        ("velocities", log.joint_velocities, "/s"),
    ):
        yield from by_unit(kind, f"joint {kind}", log.joint_names, slides, values, per, False)


def momentum(log: FlightLog) -> Iterator[PlottedQuantity]:
    """Yield the angular momentum about the common centre of mass, inertial axes."""
    with suppress(InputError):  # the bag does not describe what it depends on
        total = momentum_of(log).total
        yield PlottedQuantity("momentum", "angular momentum", "N m s", AXES, total, is_shown=False)


def estimates(log: FlightLog) -> Iterator[PlottedQuantity]:
    """Yield the measured state less the true one, where both were recorded."""
    measured = log.measured
    if measured is None:
        return
    title = "measured less true"
    turned = np.full((log.ticks, 3), np.nan)
    known = np.isfinite(measured.quaternion).all(axis=1) & np.isfinite(log.quaternion).all(axis=1)
    if known.any():
        sensed, true = (
            Rotation.from_quat(q[known], scalar_first=True)
            for q in (measured.quaternion, log.quaternion)
        )
        turned[known] = np.degrees((true.inv() * sensed).as_rotvec())
    rate = measured.omega_base - log.omega_base
    for part, unit, values in (("attitude", "deg", turned), ("rate", "rad/s", rate)):
        yield PlottedQuantity("estimates", f"{title} {part}", unit, AXES, values, is_shown=False)
    slides = log.prismatic[: len(log.joint_names)]
    away = measured.joint_positions - log.joint_positions
    names = log.joint_names
    yield from by_unit("estimates", f"{title} joints", names, slides, away, is_shown=False)
