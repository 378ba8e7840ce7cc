"""The scenarios of the matrix, their flights in this process, and digests of their logs."""

from __future__ import annotations

import hashlib
import os
import warnings
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from space_robot import FlownFlight, Scenario
from space_robot_msgs_py.bag.flight_log import FlightLog

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
DIGESTS = HERE / "digests.yaml"
CELLS = ("printed", "graph", "lanes", "bench", "messages", "c", "bag")
"""Beside the flight in this process, which all scenarios have."""
OF_A_FEW = ("processes", "replay")
"""Cells of those scenarios that ask for them."""
OWN_KEYS = ("why", "besides", "also", "lacking")
ADVICE = "If new bits are wanted: python tests/matrix --write, and say so in the commit"
BLOCKS = 10
"""Parts of a flight that have digests of their own."""
OF_THE_CLOCK = {"latency_s"}
"""Columns that are no flight's own."""
OF_THE_PROCESS = {"telemetry"}
"""Columns that no bag has at every tick."""
GROUPS = {
    "base": ("base_position", "quaternion", "base_velocity", "omega_base"),
    "joints": ("joint_positions", "joint_velocities"),
    "passive": ("passive_positions", "passive_velocities"),
    "motors": ("motor_positions", "motor_velocities"),
    "torque": ("applied_torque", "commanded_torque"),
    "actuators": ("wheel_velocities", "wheel_torques", "thrusts", "actuator_commands"),
    "orbit": ("orbit_position", "orbit_velocity", "magnetic_field", "external_torques"),
    "reference": ("reference_joints", "reference_base"),
    "law": ("telemetry", "assumed_error"),
}
"""Signals by what they tell of; measured ones are the group ``measured``, others ``further``."""


@dataclass
class Planned:
    """A scenario of the matrix; its keys are told in the file."""

    name: str
    why: str
    options: dict[str, Any]
    besides: dict[str, Any] = field(default_factory=dict)
    also: list[str] = field(default_factory=list)
    lacking: dict[str, str] = field(default_factory=dict)

    @property
    def scenario(self) -> Scenario:
        """The scenario as a new object."""
        return Scenario(**self.options)

    def neighbour(self, lane: int, gains: Mapping[str, Any]) -> dict[str, Any]:
        """Return the options of a flight beside it in a batch that differ from its own.

        Its gains are a little larger than ``gains``, by law.
        """
        cases = "122" if "robot" in self.options else "123"  # 3: the payload of the paper's robot
        options: dict[str, Any] = {"seed": 100 + lane, "case": cases[lane % 3]}
        if gains:
            larger = {
                n: {g: v * (1.01 + 0.01 * lane) for g, v in own.items()} for n, own in gains.items()
            }
            options["gains"] = larger
        if self.options.keys() & {"sensors", "faults"}:  # its measured states are not the true ones
            fault = f"torque_scale@0.002:all={1 + 1e-6 * lane}"
            options |= {"faults": [*self.options.get("faults", []), fault]}
        return {**options, **self.besides}

    def __str__(self) -> str:
        return self.name

    def has(self, cell: str) -> bool:
        """Return whether it has a cell."""
        return cell in self.also if cell in OF_A_FEW else cell not in self.lacking


def read_scenarios() -> dict[str, Planned]:
    """Return the scenarios of the file by name."""
    content = yaml.safe_load((HERE / "scenarios.yaml").read_text("utf-8"))
    plans = {}
    for name, options in content.items():
        own = {key: options.pop(key) for key in OWN_KEYS if key in options}
        plans[name] = Planned(name, options=options, **own)
    return plans


PLANS = read_scenarios()


def columns_of(log: FlightLog) -> dict[str, NDArray[np.float64]]:
    """Return all columns of a log by name, in alphabetical order, without those of the wall clock.

    What the sensors tell is ``measured.NAME``.
    """
    columns = dict(log.columns)
    if log.measured is not None:
        columns |= {f"measured.{name}": column for name, column in log.measured.columns.items()}
    return {name: columns[name] for name in sorted(columns.keys() - OF_THE_CLOCK)}


def fly(plan: Planned, bag: Path) -> FlownFlight:
    """Fly in this process into a log and a bag."""
    with in_root(), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of starts that are meant to be far away
        return plan.scenario.fly(bag)


@contextmanager
def in_root() -> Iterator[None]:
    """Let relative paths of scenarios begin in the root of the repository."""
    before = Path.cwd()
    os.chdir(ROOT)
    try:
        yield
    finally:
        os.chdir(before)


def numbers(column: NDArray[np.float64]) -> bytes:
    """Return the bits of a column, all NaN alike: their signs are the processor's."""
    return np.where(np.isnan(column), np.nan, column).tobytes()


def short(*parts: bytes) -> str:
    """Return eight characters of a digest."""
    return hashlib.sha256(b"".join(parts)).hexdigest()[:8]


def digests(flown: FlownFlight) -> dict[str, Any]:
    """Return the digest of a flight, and those of its groups of signals and of its parts."""
    log, end = flown.log, flown.reason
    columns = columns_of(log)
    named = {name: f"{name} {c.shape}".encode() + numbers(c) for name, c in columns.items()}
    laws = [(law.tick, law.name, law.is_first) for law in log.laws]
    about = repr(
        (end, log.ticks, log.first_tick, log.joint_names, laws, log.unanswered, log.filled)
    )
    groups: dict[str, list[bytes]] = {}
    for name, content in named.items():
        groups.setdefault(metric_group(name), []).append(content)
    edges = np.linspace(0, log.ticks, BLOCKS + 1).astype(int)
    parts = [short(*(numbers(c[a:b]) for c in columns.values()))[:4] for a, b in pairwise(edges)]
    whole = hashlib.sha256(b"".join([about.encode(), *named.values()])).hexdigest()
    return {
        "flight": whole,
        "end": end,
        "ticks": log.ticks,
        "groups": {name: short(*content) for name, content in groups.items()},
        "parts": " ".join(parts),
    }


def metric_group(name: str) -> str:
    """Return the group of a signal."""
    if name.startswith("measured."):
        return "measured"
    return next((group for group, names in GROUPS.items() if name in names), "further")


def what_changed(now: Mapping[str, Any], stored: Mapping[str, Any]) -> str:
    """Say how a flight differs from that of the stored digests."""
    lines = [
        f"{key}: {now[key]!r}, was {stored[key]!r}"
        for key in ("end", "ticks")
        if now[key] != stored[key]
    ]
    here, there = now["groups"], stored["groups"]
    names = [n for n in {**there, **here} if here.get(n) != there.get(n)]
    lines.append(f"signals that differ: {', '.join(names) or 'none (laws, or counts of answers)'}")
    pairs = zip(now["parts"].split(), stored["parts"].split(), strict=True)
    if now["ticks"] == stored["ticks"]:
        first = next((k for k, (a, b) in enumerate(pairs) if a != b), None)
        if first is not None:
            start, stop = (int(now["ticks"] * k / BLOCKS) for k in (first, first + 1))
            lines.append(f"from a tick of {start} to {stop - 1} on")
    return "\n".join(lines)


def difference(log: FlightLog, expected: FlightLog, ignored: Collection[str] = ()) -> str:
    """Name the signals in which a log differs, each with its first tick; empty: in none."""
    here, there = (
        {n: c for n, c in columns_of(one).items() if n not in ignored} for one in (log, expected)
    )
    lines = [f"{name}: in one log only" for name in here.keys() ^ there.keys()]
    for name in here.keys() & there.keys():
        one, other = here[name], there[name]
        if one.shape != other.shape:
            lines.append(f"{name}: shape {one.shape} instead of {other.shape}")
        elif numbers(one) != numbers(other):
            rows = [numbers(a) != numbers(b) for a, b in zip(one, other, strict=True)]
            tick = rows.index(True)
            lines.append(f"{name}: from tick {tick} on: {one[tick]} instead of {other[tick]}")
    return "\n".join(sorted(lines))


@cache
def stored_digests() -> dict[str, Any]:
    """Return the content of the file of digests."""
    content: dict[str, Any] = yaml.safe_load(DIGESTS.read_text("utf-8")) if DIGESTS.exists() else {}
    return content
