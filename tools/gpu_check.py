"""What a GPU does with flights: their bits, throughput, memory, learning; one table.

python tools/gpu_check.py            # five minutes on a device
python tools/gpu_check.py bits       # one part: bits, throughput, campaign, reach
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "tests"))
from matrix.scenarios import PLANS, difference, in_root

import space_robot as sr
from space_robot.console.tables import Column, Group, Table, as_markdown
from space_robot.flight.batch import fly_in_lanes
from space_robot.gpu.batch import DeviceBatch
from space_robot.gpu.device import Device
from space_robot.gpu.fly import device_named, fly_on_device

Rows = list[list[str]]
COUNT = 256
"""Flights of each scenario whose bits are compared."""
FLOWN = {
    "tde_stc, case 3, ideal sensors": {"controller": "tde_stc", "case": "3"},
    "with fine sensors and filter": {
        "controller": "tde_stc",
        "case": "3",
        "sensors": "fine",
        "navigation": "filtered",
    },
    "ETS-VII in orbit on wheels, fine, filtered": {
        "robot": "ets_vii",
        "orbit": "ets_vii",
        "actuators": "wheels",
        "sensors": "fine",
        "navigation": "filtered",
    },
}
DIFFERENT, TOGETHER, TICKS = 256, 33_792, 400
"""Different flights, repeated to as many as fly together, for so many ticks."""


def bits(device: Device) -> Rows:
    """Fly the matrix of scenarios, each beside 255 others, and compare every column."""
    rows: Rows = []
    for plan in PLANS.values():
        if not plan.has("lanes"):
            continue
        with in_root():
            law = plan.scenario.check().law
            gains = {} if "gains" in plan.options else {law.name: law.gain_values}
            others = [
                plan.scenario.replace(**{**plan.neighbour(k % 7, gains), "seed": k})
                for k in range(COUNT)
            ]
            flown = fly_on_device([each.check() for each in others], device)
            here = fly_in_lanes([each.check() for each in others])
        equal = sum(
            not difference(one.log, other.log) and one.ending.reason == other.ending.reason
            for one, other in zip(flown, here, strict=True)
        )
        rows.append([f"bits: {plan.name}", f"{equal} of {COUNT} flights equal"])
    return rows


def throughput(device: Device) -> Rows:
    """Fly many flights without a log, and count ticks a second of the program alone."""
    rows: Rows = []
    for name, options in FLOWN.items():
        scenario = sr.Scenario(**options, duration=TICKS * 5e-4)
        before = device.free_bytes
        for number, count in enumerate((DIFFERENT, DIFFERENT, 8192, TOGETHER)):
            different = [
                scenario.replace(seed=k, case="123"[k % 3]).check() for k in range(DIFFERENT)
            ]
            batch = DeviceBatch((different * -(-count // DIFFERENT))[:count], device, False, False)
            batch.fly()
            rate = count * TICKS / batch.seconds / 1e6
            used = (before - device.free_bytes) / 1e9
            del batch
            if number == 0:  # the program is loaded with its first run
                continue
            rows.append([f"{name}: {count} flights", f"{rate:.1f} million ticks/s, {used:.1f} GB"])
    return rows


def campaign(device: Device) -> Rows:
    """Fly 10,000 flights of 5 s into a table with metrics."""
    content = {
        "laws": ["tde_stc"],
        "scenario": {"duration": 5.0, "case": "3"},
        "vary": {"robot.links[*].mass": {"uniform": [0.8, 1.2], "relative": True}},
        "require": {"joints_1_3.rms": {"below": 1.0}},
    }
    rows = []
    for runs, place in ((200, "cpu"), (200, "gpu"), (10_000, "gpu")):
        begun = time.monotonic()
        table = sr.Campaign.of(content).run(runs=runs, device=place).table
        seconds = time.monotonic() - begun
        rows.append([f"campaign of {runs} flights, {place}", f"{seconds:.1f} s"])
        if place == "cpu":
            expected = table
        else:
            same = table.iloc[:200].equals(expected)
            rows.append(["    its first 200 rows are the CPU's", "yes" if same else "NO"])
    return rows


def reach(device: Device) -> Rows:
    """Step many environments of the task reach."""
    rows: Rows = []
    for count in (8192, 65_536):
        envs: Any = sr.make_vec("reach", num_envs=count, device="gpu")
        envs.reset(seed=1)
        actions = device.store(np.random.default_rng(1).uniform(-1.0, 1.0, (count, 9)))
        steps, begun = 200, time.monotonic()
        for _ in range(steps):
            envs.step(actions)
        rate = count * steps / (time.monotonic() - begun) / 1e6
        rows.append([f"reach: {count} environments", f"{rate:.1f} million steps/s"])
    return rows


PARTS: dict[str, Callable[[Device], Rows]] = {
    "bits": bits,
    "throughput": throughput,
    "campaign": campaign,
    "reach": reach,
}


def main() -> None:
    """Run the parts and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}")
    asked = parser.parse_args().parts or list(PARTS)
    device = device_named("gpu")
    assert device is not None
    rows: Rows = []
    for name in asked:
        begun = time.monotonic()
        rows += PARTS[name](device)
        print(f"{name}: {time.monotonic() - begun:.0f} s", file=sys.stderr, flush=True)
    columns = [Column("what", is_label=True), Column("measured", is_label=True)]
    print(as_markdown(device.name, [Table("", columns, [Group(rows)])]))


if __name__ == "__main__":
    main()
