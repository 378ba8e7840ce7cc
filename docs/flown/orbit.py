"""What is flown for docs/manual/orbit.md."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from flown_tables import Number, Options, Page, Table

from space_robot.analysis.described import plant_settings
from space_robot.api.flown_flight import FlownFlight

ORBIT_S = 5560.0
SOURCES = {
    "gravity_gradient": "gravity gradient",
    "drag": "drag",
    "sunlight": "sunlight",
    "sines": "sines of case 3",
}
AT_400_KM: Options = {
    "orbit": "iss",
    "case": "3",
    "period": 0.002,
    "duration": ORBIT_S,
    "parameters": {"plant": {"orbital_elements.height": 400e3}},
}
AT_700_KM: Options = {
    **AT_400_KM,
    "orbit": "sso_700",
    "parameters": {"plant": {"orbital_elements.height": 700e3}},
}
DUMPS = {"none": "nothing", "magnetic": "magnetic torquers"}


def _unloaded(dump: str) -> Options:
    return {
        "orbit": "iss",
        "actuators": "wheels_and_torquers",
        "period": 0.002,
        "duration": ORBIT_S,
        "parameters": {"controller": {"allocation.dump": dump}},
    }


def stored(share: float) -> Callable[[FlownFlight], float]:
    """Return the momentum that all wheels together hold at a share of the flight, N m s."""

    def momentum(flown: FlownFlight) -> float:
        row = round(share * (flown.log.ticks - 1))
        wheels = plant_settings(flown.log).wheels
        spin = wheels.spin_momenta(flown.log.wheel_velocities[row])
        return float(np.linalg.norm(spin @ wheels.unit_axes))

    momentum.__name__ = f"stored_at_{share:g}"
    return momentum


def _source(key: str, label: str) -> list[str | Number]:
    quantities = [f"disturbance_{key}.rms", f"impulse_{key}.max"]
    return [label, *(Number(o, q, ".2g") for o in (AT_400_KM, AT_700_KM) for q in quantities)]


PAGE = Page(
    "orbit",
    "manual/orbit.md",
    (
        Table(
            "sources",
            ("", "400 km: RMS, N m", "impulse, N m s", "700 km: RMS, N m", "impulse, N m s"),
            [_source(key, label) for key, label in SOURCES.items()],
        ),
        Table(
            "unloading",
            ("unloaded by", "at the start, N m s", "1/2", "at the end"),
            [
                [
                    label,
                    *(Number(_unloaded(dump), stored(share), ".2f") for share in (0.0, 0.5, 1.0)),
                ]
                for dump, label in DUMPS.items()
            ],
        ),
    ),
)
