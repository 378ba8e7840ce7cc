"""Any number: of joints, for which nothing is compiled; in an option, a flight or one line."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from flights import planned
from numba.core import event
from pydantic import BaseModel

from space_robot.cli.numbers import FiniteRange
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.scenario.faults import KINDS
from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.controller.swaps import parse_swaps
from space_robot_control.guidance.settings import MissionNodeSettings
from space_robot_control.laws import laws
from space_robot_msgs_py.config.settings import leaves
from space_robot_msgs_py.config.validation import validate
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Reference, RobotState
from space_robot_msgs_py.simulated_time import tick_from
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec
from space_robot_sim.environment.events import parse_events
from space_robot_sim.faults.grammar import parse_faults
from space_robot_sim.faults.schedule import Schedule
from space_robot_sim.plant.settings import PlantNodeSettings

SWAPS = [f"{0.001 * k:g}:{law}" for k, law in enumerate(laws(), 1)]


class Compiled(event.Listener):  # type: ignore[misc]
    """Collects the names of functions that are compiled, not those loaded from disk."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def on_start(self, event: Any) -> None:
        self.names.append(event.data["dispatcher"].py_func.__qualname__)

    def on_end(self, event: Any) -> None:
        pass


def fly(robot: str, **options: Any) -> None:
    """Fly a few ticks in one loop, and one step by step as the nodes do."""
    flight = planned(robot=robot, mission=robot, **options)
    simulate(flight)
    names, n = flight.controller.names, flight.robot.n
    states = StateCodec(names, flight.timebase)
    commands = CommandCodec(names.commanded, flight.timebase)
    state = RobotState.allocate(n)
    for topic, data in zip(states.topics, states.encode(state), strict=True):
        states.decode(topic, data, state)
    command = flight.build_controller(flight.law).update(state, Reference.at_rest(n))
    commands.decode(commands.encode(command), command)
    Flight(resolve(flight.scenario.options)).plant.step(command)


@pytest.mark.parametrize(
    "options",
    [
        {"swaps": SWAPS, "duration": 0.001 * (len(SWAPS) + 1)},
        {"sensors": "fine", "navigation": "filtered", "duration": 0.002},
        {"actuators": "none", "duration": 0.002},
    ],
    ids=["laws", "filter", "free_base"],
)
def test_another_number_of_joints_compiles_nothing(options: dict[str, Any]) -> None:
    fly("paper", **options)
    listener = Compiled()
    with event.install_listener("numba:compile", listener):
        fly("seven_joint", **options)
    assert not listener.names


def is_refused(options: dict[str, Any]) -> bool:
    """Tell if a flight of these options is refused, in one line; any other error is one here."""
    try:
        flight = Flight(resolve(validate(FlightPlan, options, "options")))
    except InputError as error:
        assert len(str(error).splitlines()) == 1  # noqa: PT017
        return True
    assert 0 < flight.ticks < 2**63
    return False


def numbers_of(schema: type[BaseModel]) -> Iterator[tuple[str, bool]]:
    """Yield the name of each field that holds numbers, and whether it is a list of them."""
    for name, field in leaves(schema):
        text = str(field.annotation)
        if "float" in text or "int" in text:
            yield name, "list" in text


def test_any_parameter_and_option() -> None:
    for node in (PlantNodeSettings, ControllerNodeSettings, MissionNodeSettings):
        for name, is_list in numbers_of(node):
            for value in (1e308, 5e-324):
                is_refused({"parameters": {node.node: {name: [value] if is_list else value}}})
    for name, _ in numbers_of(FlightPlan):
        for value in (1e308, 5e-324, float("nan"), float("inf"), -1):
            is_refused({name: value})
    for name in ("case", "sensors", "actuators", "robot", "mission", "gains"):  # as a name
        assert is_refused({name: 10**400})


@pytest.mark.parametrize("period", [1e-5, 0.1])
@pytest.mark.parametrize(
    "time", ["1e308", "1e9", "1000000001", "1e400", "5e-324", "inf", "nan", "-1", "9" * 400, ""]
)
def test_any_time_is_a_tick_of_64_bits_or_refused(time: str, period: float) -> None:
    texts = [f"{kind}@{time}" for kind in KINDS]
    texts += [f"{kind}@1-{time}" for kind in KINDS]
    texts += [f"{name}:{a}" for name in texts for a in ("1", "1e308", "base=1", "5e-324")]
    for text in texts:
        try:
            faults = parse_faults([text], KINDS)
        except InputError:
            continue
        for fault in faults:
            assert 0 <= tick_from(fault.start_s, period) < 2**63
            assert fault.stop_s == float("inf") or tick_from(fault.stop_s, period) < 2**63
            if not (fault.kind.argument and fault.kind.argument.about):
                Schedule([fault], 0, period)
    for text in (f"capture@{time}:small_satellite", f"release@{time}:0.1"):
        try:
            events = parse_events(["capture@0:small_satellite", text][-1 - text.count("rel") :])
        except InputError:
            continue
        assert all(tick_from(event.time_s, period) < 2**63 for event in events)
    try:
        swaps = parse_swaps([f"{time}:ctc"], period)
    except InputError:
        return
    assert 0 <= swaps[0].tick < 2**63


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("events", "capture@{}:small_satellite"),
        ("faults", "drop_state@{}:0.1"),
        ("faults", "drop_state@0-{}"),
        ("swaps", "{}:ctc"),
    ],
)
def test_the_latest_time_is_a_flight_and_a_later_one_is_refused(key: str, text: str) -> None:
    assert is_refused({key: [text.format("1.1e9")]})
    assert is_refused({key: [text.format("1e308")]})
    assert key == "events" or not is_refused({key: [text.format("1e9")]})


@pytest.mark.parametrize("given", ["nan", "inf", "-inf", "1e400"])
def test_no_option_takes_a_number_that_is_not_finite(given: str) -> None:
    with pytest.raises(Exception, match=r"not a finite number|is not in the range"):
        FiniteRange(0.0).convert(given, None, None)
