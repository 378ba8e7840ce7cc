"""The time-delay estimate of a flight's laws, from its description."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.gains import build_law, split_gains
from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.laws.names import require_shipped_law
from space_robot_control.navigation.rate_filters import low_pass_weight
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.law_history import laws_of
from space_robot_msgs_py.errors import InputError

from .described import DIRECT, NotDescribedError, check_files, navigation_of, parameters_of
from .estimate_error import HBar

Array = NDArray[np.float64]


def estimator(log: FlightLog) -> tuple[HBar, float]:
    """Find h_bar of the laws' time-delay estimate, and the weight of its low-pass (0: none).

    Raises:
        InputError: the law is not recorded, and has no estimate or is not described; or its
            estimate is not of the states measured.
    """
    if navigation_of(log) != DIRECT:
        raise InputError("the filtered states that N_hat is formed of are not recorded")
    if log.laws:
        h_bar = recorded_h_bar
    else:
        described = _described_h_bar(log)

        def h_bar(log: FlightLog) -> Array:
            return described

    parameters, key = parameters_of(log, ControllerNodeSettings.node), "acceleration_filter_hz"
    settings = ControllerNodeSettings.resolve({key: parameters[key]} if key in parameters else {})
    return h_bar, low_pass_weight(settings.acceleration_filter_hz, log.timebase.period)


def recorded_h_bar(log: FlightLog) -> Array:
    """Return h_bar of the laws in force in the rows of ``log``, see `HBar`."""
    laws, none = laws_of(log), np.full(log.axes, np.nan)
    rows: list[Array] = [none]
    for law in laws:
        values = law.gains.get("h_bar", ())
        fits = len(values) in (1, log.axes) and any(values)  # zeros: the nominal inertia
        rows.append(np.broadcast_to(values, log.axes) if fits else none)
    if len(laws) == 1 and laws[0].tick <= log.first_tick:
        return np.asarray(rows[1])
    ticks = np.arange(log.first_tick, log.first_tick + log.ticks)
    which = np.searchsorted([law.tick for law in laws], ticks, side="right")
    return np.array(rows)[which]


def _described_h_bar(log: FlightLog) -> Array:
    """Return h_bar of a bag without the laws in force, at its description's word."""
    flight = log.flight
    if flight.get("swaps"):
        raise NotDescribedError("laws were swapped in flight, so no one h_bar holds")
    if not (name := flight.get("controller")):
        raise NotDescribedError("the bag does not say which law was flown")
    if isinstance(gains := flight.get("gains_used"), dict):
        h_bar = np.array(gains.get("h_bar", ()), dtype=np.float64)
    else:
        chosen: dict[str, Any] = {key: flight[key] for key in ("robot", "gains") if key in flight}
        recorded, _ = split_gains(parameters_of(log, ControllerNodeSettings.node))
        chosen |= {**recorded, "controller": name}
        check_files(log, chosen)
        if not log.trusted:
            require_shipped_law(str(name))
        h_bar = build_law(str(name), ControllerNodeSettings.resolve(chosen), log.axes).h_bar
    if not h_bar.any():
        raise NotDescribedError(f"{name} has no time-delay estimate with a constant h_bar")
    if h_bar.shape not in ((log.axes,), (1,)):
        raise NotDescribedError(f"gains_used of the bag: h_bar: {log.axes} values were expected")
    return np.broadcast_to(h_bar, log.axes)
