"""The flight software of a scenario, and the recorded flights that accept it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import yaml
from numpy.typing import NDArray

from space_robot.flight.flight_messages import MessageLoop
from space_robot_control.controller.law_choice import LawChoice
from space_robot_control.controller.tick import NEW
from space_robot_control.flight_code.acceptance import (
    REFERENCE_SHARE,
    SHARE,
    RecordingSupervisor,
    corrupt_state,
    corrupted_reference,
    disturb_state,
    hostile_ticks,
)
from space_robot_control.flight_code.folder import Exported
from space_robot_control.flight_code.software import FlightSoftware
from space_robot_control.laws import ControlLaw
from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.samples import RobotState

from ..flight.plan import Flight, Scenario, resolve


def exported_laws(flight: Flight, further: Sequence[str] = ()) -> list[ControlLaw]:
    """Return the laws of a flight: in force at the start, swapped to, and ``further`` ones.

    Raises:
        InputError: a further law is not in the gain set.
    """
    names = [one_of(name, flight.laws, "controller", " of --law") for name in further]
    laws = [flight.law, *(law for _, law in flight.swaps), *(flight.laws[n] for n in names)]
    return list({law.name: law for law in laws}.values())


def export(
    flight: Flight, further: Sequence[str] = (), requirements: Sequence[str] = ()
) -> Exported:
    """Translate the flight software of a flight that has not begun.

    Raises:
        InputError: a law or kernel has no translation to C.
    """
    settings, scenario = flight.controller_settings, flight.scenario
    laws = exported_laws(flight, further)
    robot = f"the robot {scenario.robots.controller.name!r}, as the controller knows it"
    sources = {law.name: f"gain set {settings.gains!r}, law {law.name}" for law in laws}
    limits = settings.hold_ticks, settings.longest_jump
    software = FlightSoftware(
        flight.controller,
        laws,
        flight.swaps,
        limits,
        {"robot": robot, "controller": "parameters of controller_node", **sources},
    )
    text = yaml.safe_dump(scenario.tree)
    return Exported(software, scenario.robots.controller.name, text, requirements)


FAULTS = (
    "drop_state@0.1-0.2:0.3",
    "jitter_state@0.2-0.3:4",
    "repeat_state@0.3-0.35:0.3",
    "nan_state@0.35-0.4:0.2",
    "inf_state@0.4-0.45:0.2",
    "scaled_quaternion@0.45-0.5:0.2",
    "stamp_back@0.5-0.55:0.2",
    "stamp_jump@0.55-0.6:0.2",
    "nan_state@0.65-0.78:1",
    "drop_state@0.82-0.84:1",
)
"""Of messages: states are lost, late, twice, wrong; the last but one outlasts the holding."""
FAULTY_S, HOSTILE_TICKS = 1.0, 6000
REPEATED = 0.03
"""Share of states without noise, and of those that are judged twice."""
PHASE, QUIET_TICKS, FIRST_FAILURE = 400, 150, 8
"""Of the hostile flight: ticks of a phase, those at its beginning without hostile states, and the
phase after which wheels fail, one after the other."""


class RecordedFlight(NamedTuple):
    """A recorded flight."""

    name: str
    about: str
    """What it is, in a line."""
    recording: RecordingSupervisor


def recorded_flights(
    plan: Scenario, exported: Exported, further: Sequence[str], seconds: float | None = None
) -> Iterator[RecordedFlight]:
    """Fly and record what exported flight software has to answer.

    The scenario as it is; its first second under each law in case 3 with faults of messages and
    hardware; and hostile states and references.

    Args:
        plan: of the scenario.
        exported: made from it.
        further: laws beside those of the scenario.
        seconds: of the scenario to fly (None: all of it).
    """
    shorter = plan if seconds is None else plan.model_copy(update={"duration": seconds})
    flight = Flight(resolve(shorter))
    yield RecordedFlight("mission", "the scenario", _flown(flight, exported))
    laws = [law.name for law in exported_laws(flight, further)]
    for place, law in enumerate(laws):
        faults = [*FAULTS, *_hardware_faults(flight)]
        update = {"faults": faults, "case": "3", "duration": FAULTY_S}
        faulty = Flight(resolve(plan.model_copy(update=update)))
        about = f"{law}, case 3, lost, late and wrong states, safe mode"
        yield RecordedFlight(f"faults_{law}", about, _flown(faulty, exported, place, law))
    yield RecordedFlight(
        "hostile", "hostile states, references and stamps", _hostile(plan, exported, laws)
    )


def _hardware_faults(flight: Flight) -> list[str]:
    names = flight.plant.names
    faults = [f"wheel_fail@0.2:{name}" for name in names.wheels[:1]]
    return [*faults, *(f"thruster_stuck_off@0.2:{name}" for name in names.thrusters[:1])]


def _supervisor(flight: Flight, exported: Exported) -> RecordingSupervisor:
    settings = flight.controller_settings
    return RecordingSupervisor(
        flight.controller, exported, settings.hold_ticks, settings.longest_jump
    )


def _flown(
    flight: Flight, exported: Exported, place: int = 0, law: str = ""
) -> RecordingSupervisor:
    supervisor = _supervisor(flight, exported)
    if place:
        supervisor.choose(place)
        flight.law = flight.controller.law = flight.laws[law]
    nothing: Callable[..., None] = lambda *_: None  # noqa: E731
    loop = MessageLoop(flight, nothing, nothing, supervisor)
    try:
        for _ in range(flight.ticks):
            loop.fly_tick()
    except FlightError:  # whatever was flown up to here counts
        pass
    supervisor.finish()
    return supervisor


def _hostile(plan: Scenario, exported: Exported, laws: Sequence[str]) -> RecordingSupervisor:
    """Record the answers to hostile states and references, between noisy ones of a still base.

    The first reference is none, so that there is nothing to hold.
    """
    flight = Flight(resolve(plan))
    random = np.random.default_rng(20)
    supervisor, wheels = _supervisor(flight, exported), _Wheels(flight)
    choice = LawChoice(flight.law, flight.swaps)
    references = flight.mission.chunk(0, HOSTILE_TICKS).references()
    commanded = np.zeros(len(flight.plant.names.commanded))
    for k, tick in enumerate(hostile_ticks(HOSTILE_TICKS, random)):
        if random.random() < 0.005 and len(laws) > 1:
            place = int(random.integers(len(laws)))
            choice.choose(flight.laws[laws[place]])
            supervisor.use(choice.chosen)
            supervisor.choose(place)
        if random.random() < REPEATED:  # one that is not answered at once
            supervisor.judge_stamp(tick)
        if supervisor.judge_stamp(tick) != NEW:
            continue
        if choice.change_at(tick):
            supervisor.use(choice.chosen)
        state = flight.plant.state.copy()
        state.tick = tick
        noise = 0.0 if random.random() < REPEATED else 10.0 ** random.uniform(-6, -1)
        disturb_state(state, noise, random)
        wheels.measure(state, commanded, k)
        is_hostile = random.random() < SHARE and k % PHASE > QUIET_TICKS
        reference = references[k : k + 1]
        corrupt_state(state, wheels.count, random, reference["quaternion"][0], is_hostile)
        if supervisor.answered < 0:
            reference = np.full_like(reference.view(np.float64), np.nan).view(reference.dtype)
        elif random.random() < REFERENCE_SHARE:
            reference = corrupted_reference(reference, random)
        commanded = supervisor.answer(state, reference).torque
    supervisor.finish()
    return supervisor


class _Wheels:
    """Wheels of a base in the hostile flight: in phases empty, full, and without an answer."""

    def __init__(self, flight: Flight) -> None:
        names, memory = flight.plant.names, flight.controller.block[0].allocation.wheels
        self.count, self._first = len(names.wheels), len(names.axes)
        most = memory.max_momentum[: self.count] / memory.inertia[: self.count]
        self._fastest = np.where(np.isfinite(most), most, 100.0)

    def measure(self, state: RobotState, commanded: NDArray[np.float64], k: int) -> None:
        """Write the wheels' speeds and torques at the k-th tick."""
        phase, count = k // PHASE, self.count
        share = (0.0, 0.3, 0.9, 1.0)[phase % 4]
        signs = np.where(np.arange(count) + phase // 4 & 1, -1.0, 1.0)
        state.wheel_velocities[:count] = share * signs * self._fastest
        torques = commanded[self._first : self._first + count]
        is_silent = np.arange(count) < phase - FIRST_FAILURE
        state.wheel_torques[:count] = np.where(is_silent, 0.0, torques)
