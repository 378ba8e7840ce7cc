"""Flights and benches flown together: each has the bits that it has alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from matrix.scenarios import columns_of, difference

import space_robot as sr
from space_robot import Scenario
from space_robot.analysis.errors import controls_base
from space_robot.flight.batch import FlightBatch, batch_key, batch_obstacle, batches
from space_robot.flight.benches import Benches
from space_robot.flight.plan import Flight
from space_robot.flight.simulate import simulate
from space_robot_control.laws import laws
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.bag.flight_log import MEASURED_COLUMNS, FlightLog
from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.errors import FlightError, InputError

Flown = tuple[FlightLog, str]


def alone(flight: Flight) -> Flown:
    """Log of a flight flown by itself, and what ended it."""
    try:
        return simulate(flight), ""
    except FlightError as error:
        return cast(FlightLog, error.log), str(error)


def together(flights: Sequence[Flight]) -> list[Flown]:
    """The same of flights flown by groups, all of which have one block."""
    flown: dict[int, Flown] = {}
    for group in batches(enumerate(flights)):
        numbers = [number for number, _ in group]
        if len(group) == 1:
            flown[numbers[0]] = alone(group[0][1])
            continue
        for block in FlightBatch([flight for _, flight in group]).fly():
            assert numbers[block.flight] not in flown
            flown[numbers[block.flight]] = block.log, block.ending.reason
    return [flown[number] for number in range(len(flights))]


WILD = "torque_scale@0:all=0.2"
"""A flight with it diverges."""
FAULTS = (
    "torque_scale@0.02:all=5",
    "torque_scale@0.03-0.08:1=0.9",
    "tracker_blind@0.02-0.09",
    "gyro_bias@0.04:base_x=0.01",
    "encoder_stuck@0.05-0.1:2",
    "stuck_joint@0.03-0.06:3=5",
    "drive_bias@0.05:2=0.3",
)


WIND: dict[str, list[float]] = {"time": [0.01, 0.03], "joint1": [5.0, 5.0]}
SHARED = {
    "controller": sorted(laws()),
    "case": ["1", "2", "3"],
    "sensors": ["ideal", "fine", "coarse", "tactical"],
    "navigation": ["direct", "filtered"],
    "command_latency_ticks": [0, 0, 3],
    "substeps": [1, 1, 2],
    "duration": [0.05, 0.1],
    "swaps": [[], [], ["0.03:ctc"]],
}
"""Options that are those of most flights of a batch."""
HARDWARE = ["ideal", "none", "wheels", "thrusters", "wheels_and_thrusters"]
OF_ONE: dict[str, list[Any]] = {
    "faults": [[], [], *([fault] for fault in FAULTS), [*FAULTS[3:5]]],
    "case": ["1", "3"],
    "friction": [False],
    "disturbance": [WIND, {**WIND, "time": [0.0, 0.02]}],
    "events": [["capture@0.02:tumbling_satellite", "release@0.04:0.01"]],
}
"""Options that a flight may have for itself."""


@st.composite
def scenarios(draw: st.DrawFn) -> list[dict[str, Any]]:
    """Options of flights, most of which can share a batch."""
    robot = draw(st.sampled_from(["paper", "paper", "paper", "dual_arm", "flexible_panels"]))
    common = {name: draw(st.sampled_from(values)) for name, values in SHARED.items()}
    common |= {
        "robot": robot,
        "actuators": draw(st.sampled_from(HARDWARE if robot == "paper" else ["ideal"])),
    }
    flights = []
    for seed in range(draw(st.integers(2, WIDTH + 2))):
        names = draw(st.lists(st.sampled_from(sorted(OF_ONE)), max_size=2, unique=True))
        own = {name: draw(st.sampled_from(OF_ONE[name])) for name in names}
        if robot != "paper":
            own = {name: value for name, value in own.items() if name in ("case", "faults")}
        flights.append({**common, "seed": seed, **own})
    return flights


@settings(max_examples=10, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(scenarios())
@example([{"duration": 0.1, "faults": [WILD] if seed == 1 else []} for seed in range(4)])
def test_each_flight_of_any_batch_has_its_own_bits(options: list[dict[str, Any]]) -> None:
    """In any lane, whoever flies beside it, also to another end."""
    flights = [Scenario(**option).check() for option in options]
    for number, (log, end) in enumerate(together(flights)):
        flight, copy = flights[number], Scenario(**options[number]).check()
        expected, expected_end = alone(copy)
        assert (end, difference(log, expected)) == (expected_end, "")
        assert (log.laws, log.unanswered, log.flight) == (
            expected.laws,
            expected.unanswered,
            expected.flight,
        )
        assert flight.plant.tick == copy.plant.tick


def some(count: int, **options: Any) -> list[Flight]:
    return [Scenario(**{"seed": k, "duration": 0.1, **options}).check() for k in range(count)]


def test_flights_that_differ_in_what_lanes_share_fly_apart() -> None:
    """The code of constant and of nominal inertia is not the same."""
    nominal = {"gains": {"tde_stc": {"h_bar": "nominal"}}}
    differing: list[dict[str, Any]] = [
        {},
        nominal,
        {"robot": "dual_arm"},
        {"sensors": "fine"},
        {"controller": "ctc"},
        {"period": 0.001},
        {"duration": 0.2},
        {"actuators": "wheels"},
        {"navigation": "filtered"},
        {"swaps": ["0.05:ctc"]},
        {"controller": "ctc", "swaps": ["0.02:tde_stc"]},
        {"controller": "ctc", "swaps": ["0.02:tde_stc"], **nominal},
        {"command_latency_ticks": 2},
    ]
    flights = [flight for options in differing for flight in some(2, **options)]
    groups = [[number for number, _ in group] for group in batches(enumerate(flights))]
    assert sorted(groups) == [[k, k + 1] for k in range(0, len(flights), 2)]


def test_what_only_changes_numbers_flies_together_and_message_faults_alone() -> None:
    changes: list[dict[str, Any]] = [
        {},
        {"case": "3"},
        {"gains": {"k_1": 2.0}},
        {"seed": 5},
        {"faults": ["torque_scale@0.05:all=0.9"]},
        {"parameters": {"plant": {"friction.coulomb": 0.1}}},
    ]
    flights = [flight for change in changes for flight in some(1, sensors="fine", **change)]
    assert len({batch_key(flight) for flight in flights}) == 1
    assert {batch_obstacle(flight) for flight in flights} == {""}
    more = some(4, sensors="fine")
    assert [len(group) for group in batches(enumerate([*flights, *more]))] == [8, 2]
    (lossy,) = some(1, faults=["drop_state@0.01-0.02:0.5"])
    assert batch_obstacle(lossy) == "messages between plant and controller have faults"


@pytest.mark.parametrize(
    "options", [{"robot": "dual_arm"}, {"actuators": "wheels"}, {"actuators": "none"}]
)
def test_brief_logs_have_what_metrics_need(options: dict[str, Any]) -> None:
    """The true states; the kinds of joints, branches and hardware."""
    full, brief = (
        next(iter(FlightBatch(some(2, **options)).fly(is_brief=is_brief))).log
        for is_brief in (False, True)
    )
    columns = columns_of(brief)
    assert columns.keys() < columns_of(full).keys()
    assert all(np.array_equal(columns[name], columns_of(full)[name]) for name in columns)
    assert {*MEASURED_COLUMNS, "actuator_commands"} <= columns.keys()
    assert (full.prismatic, full.branches) == (brief.prismatic, brief.branches)
    assert controls_base(full) == controls_base(brief)


def test_logs_too_large_for_memory_lie_in_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("space_robot.flight.flown_log.MAPPED_FROM", 1000)
    for flown, flight in zip(
        FlightBatch(some(2, sensors="fine")).fly(), some(2, sensors="fine"), strict=True
    ):
        assert isinstance(flown.log.quaternion, np.memmap)
        assert difference(flown.log, simulate(flight)) == ""


# Benches

COMMON: dict[str, Any] = {"controller": None, "duration": 0.05}


def benched() -> list[Scenario]:
    """Two batches; faults that begin and end, another length, a divergence."""
    return [
        *(Scenario(**COMMON, sensors="fine", seed=seed) for seed in range(3)),
        Scenario(**COMMON, sensors="fine", case="3", faults=["encoder_stuck@0.01-0.02:2"]),
        Scenario(**COMMON, seed=4),
        Scenario(**{**COMMON, "duration": 0.03}, sensors="fine"),
        *(Scenario(**COMMON, sensors="fine", faults=["noise_gyro@0.02:0.1"]) for _ in range(8)),
    ]


def torques_of(states: Array, tick: int) -> Array:
    """Some torques, of which the first flight's make it diverge."""
    torques = np.sin(np.arange(states.shape[0] * 9).reshape(-1, 9) + tick)
    torques[0] *= 1e9 if tick > 20 else 1.0
    return torques - states["joint_velocities"].sum(axis=1)[:, np.newaxis]


def numbers(block: Any) -> list[bytes]:
    return [row.tobytes() for row in np.asarray(block)]


def test_each_bench_has_the_states_of_the_bench_alone() -> None:
    many, alone = sr.bench_many(benched()), [scenario.bench() for scenario in benched()]
    for seed in (None, 7):
        states = many.reset(seed)
        assert not many.ticks.any()
        for k, bench in enumerate(alone):
            bench.reset(None if seed is None else seed + k)
        tick = 0
        while not many.done.all():
            torques = torques_of(states, tick)
            states = many.step(torques)
            for k, bench in enumerate(alone):
                if not bench.done:
                    bench.step(torques[k])
            assert numbers(states) == [bench.state.block.tobytes() for bench in alone]
            assert numbers(many.truths) == [bench.truth.block.tobytes() for bench in alone]
            assert many.ticks.tolist() == [bench.tick for bench in alone]
            assert many.done.tolist() == [bench.done for bench in alone]
            tick += 1
        for ending, bench in zip(many.endings, alone, strict=True):
            assert ending is not None
            assert (ending.outcome, ending.reason) == (bench.outcome, bench.reason)
        assert many.endings[0].outcome == "diverged"  # type: ignore[union-attr]
    with pytest.raises(InputError, match="all flights are over"):
        many.step(torques)


def test_wheels_share_the_torque_out_or_take_their_own() -> None:
    options = {**COMMON, "actuators": "wheels", "duration": 0.005}
    many = sr.bench_many(Scenario(**options, seed=seed) for seed in range(2))
    one = Scenario(**options, seed=1).bench()
    for axes in (9, len(many.names.commanded)):
        many.reset()
        one.reset()
        for tick in range(10):
            torques = 0.1 * np.sin(np.arange(2 * axes).reshape(2, axes) + tick)
            many.step(torques)
            one.step(torques[1])
        assert numbers(many.states)[1] == one.state.block.tobytes()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ([], "at least one flight"),
        ([3], "scenario 0: a Scenario was expected, got 3"),
        (
            [Scenario(**COMMON), Scenario(**COMMON, robot="dual_arm")],
            "flight 1: 8 joints and actuators",
        ),
        ([Scenario(**COMMON, faults=["drop_state@0:0.5"])], "flight 0: on the bench are no"),
    ],
)
def test_what_cannot_be_benched_is_named(given: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        sr.bench_many(given)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda many: many.step(np.zeros(9)), r"shape \(2, 9\) was expected, got one of \(9,\)"),
        (lambda many: many.reset([3]), "seed: 2 numbers were expected, got 1"),
        (lambda many: many.reset([3, -1]), r"seed\[1\]"),
        (lambda many: many.reset(2**31 - 1), "seed"),
    ],
)
def test_wrong_numbers_are_errors(wrong: Callable[[Benches], Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        wrong(sr.bench_many([Scenario(**COMMON)] * 2))
