"""Resolution of the options of a flight to a checked scenario with every number."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from space_robot_control.allocation.settings import assumed_actuators
from space_robot_control.controller.gains import Laws
from space_robot_control.controller.law_choice import NoLaw, parse_swaps
from space_robot_control.controller.settings import SET_FILE
from space_robot_control.guidance.mission import Mission
from space_robot_control.laws import ControlLaw
from space_robot_control.laws import laws as known_laws
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.find import TRAJECTORIES, YAML, remake_advice, robot_files
from space_robot_model.robot.inertia import inertia_tensor
from space_robot_msgs_py.config.files import GIVEN, flatten, nest
from space_robot_msgs_py.config.validation import one_of, short, validate
from space_robot_msgs_py.errors import InputError, explained_by
from space_robot_sim.environment.disturbance_table import JSON, DisturbanceTable
from space_robot_sim.faults.grammar import Fault, parse_faults

from .faults import FAULTED_NODES, KINDS, PROCESS_KINDS
from .node_settings import FlightSettings, option_parameters
from .objects import resolve_law, sampled
from .options import OPTIONS
from .resolved import ResolvedScenario
from .scenario import Scenario


def resolve(scenario: Scenario) -> ResolvedScenario:
    """Read all files that the options name, and check that they fit together.

    Single parameters of nodes override the other options.
    """
    with explained_by("disturbances"):
        faults = parse_faults(scenario.fault_texts(PROCESS_KINDS), KINDS)
    _check_nodes(scenario, faults)
    if "controller" in scenario.without:
        scenario = scenario.model_copy(update={"controller": None})
    settings = FlightSettings.resolve(scenario)
    laws = flight_laws(scenario, settings)
    resolved = ResolvedScenario(
        **vars(settings),
        options=scenario,
        mission_name=settings.mission.mission or robot_files(settings.mission.robot).name,
        reference=_mission(settings, settings.robots.controller),
        laws=laws,
        swaps=[
            (tick, laws[one_of(name, laws, "controller", " of swaps")])
            for tick, name in parse_swaps(settings.controller.swaps, settings.plant.period)
        ],
        assumed_actuators=software_actuators(scenario, settings),
        process_faults=faults,
    )
    if resolved.plant.payload.mass:
        _check_payload(resolved)
    _check_disturbance(resolved)
    _check_actuators(resolved)
    return _with_sampled_disturbance(resolved) if callable(scenario.disturbance) else resolved


def _check_nodes(scenario: Scenario, faults: list[Fault]) -> None:
    for node in scenario.without:
        asked = [
            name
            for name, option in OPTIONS.items()
            if option.node == node and getattr(scenario, name) not in (option.default, None)
        ]
        asked += [f"{node}.{name}" for name in scenario.parameters.get(node, {})]
        asked += [f"fault {fault}" for fault in faults if FAULTED_NODES[fault.kind] == node]
        if asked:
            raise InputError(
                f"{', '.join(asked)}: that is for the project's {node}, which `without` leaves out"
            )
    asked = [f"fault {fault}" for fault in faults]
    asked += [name for name in ("restart_controller", "without") if getattr(scenario, name)]
    if scenario.composed and asked:
        raise InputError(
            f"{', '.join(asked)}: that needs a process for each node: fly without --composed"
        )


def _with_sampled_disturbance(scenario: ResolvedScenario) -> ResolvedScenario:
    """Return the scenario with numbers in place of a disturbance that is a function of time.

    A function could not go to another process, and nobody could repeat its flight.
    """
    columns = sampled(scenario.options.disturbance, scenario.ticks * scenario.plant.period)
    return replace(
        scenario,
        options=scenario.options.model_copy(update={"disturbance": columns}),
        plant=scenario.plant.with_table(DisturbanceTable(columns).text),
    )


def _mission(settings: FlightSettings, robot: Robot) -> Mission:
    with explained_by("own-trajectory"):
        try:
            return Mission(robot, settings.mission, settings.plant.period)
        except InputError as error:
            file, numbers = settings.mission.mission, settings.mission
            if not file and len(numbers.joints_deg) != robot.n:
                own = robot_files(settings.mission.robot).mission
                raise InputError(f"{own}: {error}{remake_advice(own) if own else ''}") from None
            if not file.endswith((*YAML, *TRAJECTORIES)):
                raise
            raise InputError(f"{file}: {error}") from None


def flight_laws(scenario: Scenario, settings: FlightSettings) -> Mapping[str, ControlLaw]:
    """Return all laws of a flight, by name: the one in force at the start comes first."""
    axes = settings.robots.plant.n + 3
    if scenario.controller is None:
        return {NoLaw.name: NoLaw({}, settings.plant.period, axes)}
    own = resolve_law(scenario.controller)
    with explained_by("gains"):
        if not scenario.has_chosen_law:  # a robot's folder runs no code by naming it
            one_of(settings.controller.controller, known_laws(), "controller", f" of {SET_FILE}")
        return Laws(settings.controller, axes, settings.gains, own or "")


def software_actuators(scenario: Scenario, settings: FlightSettings) -> BaseActuatorSettings:
    """Return the base's actuators as the flight software assumes them."""
    robot, name = settings.robots.controller, settings.controller.actuators
    if isinstance(scenario.assumed_actuators, str):
        try:
            return assumed_actuators(scenario.assumed_actuators, robot)
        except InputError as error:
            raise InputError(f"assumed_actuators: {error}") from None
    if scenario.assumed_actuators is not None:
        own, option = scenario.assumed_actuators, "assumed_actuators"
    elif name != GIVEN:
        return assumed_actuators(name, robot)
    else:
        numbers = scenario.actuators if isinstance(scenario.actuators, dict) else {}
        own = {key: numbers[key] for key in BaseActuatorSettings.model_fields if key in numbers}
        option = "actuators"
    assumed = validate(BaseActuatorSettings, own, option)
    assumed.check(robot, GIVEN if option == "actuators" else f"{GIVEN} as {option}")
    return assumed


@explained_by("disturbances")
def _check_payload(scenario: ResolvedScenario) -> None:
    payload, robot, case = scenario.plant.payload, scenario.robots.controller, scenario.options.case
    mass, inertia = robot.mass[robot.tool.body], robot.inertia[robot.tool.body]
    gained = np.linalg.eigvalsh(inertia_tensor(payload.inertia) - inertia)
    if payload.mass < mass or gained[0] < -1e-9:
        own = f"{mass:g} kg, {short(np.diag(inertia).tolist())} kg m2"
        raise InputError(
            f"case {case}: with its payload the last link has {payload.mass:g} kg and "
            f"{short(payload.inertia[:3])} kg m2, less than without it ({own}): write a case for "
            f"{robot.name}, or fly case 2"
        )


@explained_by("disturbances")
def _check_disturbance(scenario: ResolvedScenario) -> None:
    if not (text := scenario.plant.disturbance.table):
        return
    parameters = option_parameters(scenario.options)["plant"]
    file = dict(flatten(nest(parameters))).get("disturbance.table", "")
    if file and not file.startswith(JSON):
        joints = scenario.plant.robot_names(scenario.robots.plant).joints
        DisturbanceTable.parse(text).loads(joints, file)


@explained_by("sensors")
def _check_actuators(scenario: ResolvedScenario) -> None:
    both = [
        (s.base_actuation, s.wheel_count, s.thruster_count, s.torquer_count)
        for s in (scenario.plant, scenario.assumed_actuators)
    ]
    if both[0] != both[1]:
        kinds = "; ".join(
            f"{node} {actuation}, {wheels} wheels, {thrusters} thrusters"
            + (f", {torquers} magnetic torquers" if torquers else "")
            for node, (actuation, wheels, thrusters, torquers) in zip(
                ("plant", "controller"), both, strict=True
            )
        )
        raise InputError(f"plant and controller must have the same actuators, got {kinds}")
