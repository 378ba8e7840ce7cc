"""Tuning of a gain set for a robot and a mission, from options to files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from space_robot_msgs_py.config.validation import validate
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.environment import with_payload

from ..console.files import atomic_file, make_folder
from ..flight.plan import Scenario
from ..scenario.node_settings import FlightSettings
from ..tuning.flexible import fast_inertia
from ..tuning.gain_file import gain_files
from ..tuning.inertia import SAMPLING, inertia_along, postures_along, sampled_reference
from ..tuning.method import Tuned, tune
from ..tuning.task import TuningOptions, force_demand, listen


def tuned_set(
    options: Mapping[str, Any],
    cases: Sequence[str],
    targets: TuningOptions,
    step: Callable[[str], None],
) -> Tuned:
    """Tune a gain set.

    Args:
        options: of a `Scenario`: robot (the nominal one), mission, sensors, navigation.
        cases: names or paths of the environments.
        targets: of the user.
        step: called with a description of each step.
    """
    plans = [validate(Scenario, {**options, "case": case}, "options") for case in cases]
    settings = [FlightSettings.resolve(plan) for plan in plans]
    nominal, reference = settings[0].robots.plant, settings[0].mission
    motion = sampled_reference(nominal, reference)
    if not (motion.joints[:, 1].any() or motion.base[:, 4:].any()):
        raise InputError("the mission moves neither joints nor base: tuning needs a motion")
    inertias = []
    for case, own in zip(cases, settings, strict=True):
        step(f"inertia, case {case}")
        loaded = with_payload(nominal, own.plant.payload)
        inertias.append(inertia_along(loaded, reference))
        if any(loaded.gears):
            places = motion.joints[:, 0]
            inertias.append(fast_inertia(loaded, places))
    step("forces along the mission")
    demand = force_demand(nominal, reference, [own.plant for own in settings])
    plant, navigation, noise = settings[0].plant, settings[0].controller.filter_settings, None
    if plant.sensors != "ideal" or navigation:
        step("noise of the sensors")
        noise = listen(nominal, plant, navigation, reference, plant.period)
    postures = postures_along(nominal, reference, SAMPLING)
    step("gains")
    has_gears = any(nominal.gears)
    return tune(np.concatenate(inertias), postures, demand, targets, plant.period, noise, has_gears)


def write_set(tuned: Tuned, command: str, folder: Path) -> list[Path]:
    """Write the files of a set."""
    make_folder(folder)
    paths = []
    for name, text in gain_files(tuned, command).items():
        with atomic_file(folder / name, replace=True) as file:
            file.write(text.encode())
        paths.append(folder / name)
    return paths
