"""The controller that answers the replay: the one that flew, or another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from space_robot_control.controller.controller import Controller
from space_robot_control.controller.gains import check_gains
from space_robot_control.controller.law_choice import LawChoice, NoLaw, parse_swaps
from space_robot_control.controller.settings import DEFAULT, ControllerNodeSettings, gains_as_path
from space_robot_control.controller.supervisor import Supervisor
from space_robot_control.flight_code.supervisors import make_supervisor
from space_robot_control.laws import ControlLaw, find_law, laws
from space_robot_control.laws.names import require_shipped_law
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.config.files import Tree
from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import LawInForce

from ...scenario.node_settings import FlightSettings
from ...scenario.objects import robot_setting
from ...scenario.options import OPTIONS
from ...scenario.recorded import recorded_options, recorded_scenario
from ...scenario.resolve import flight_laws, software_actuators

REPLAYED = (
    *("robot", "period", "sensors", "actuators", "assumed_actuators", "navigation"),
    *("controller_code", "shadow", "gains", "swaps", "parameters"),
)
"""Options of the flight that its controller sees, beside its law."""


class ControllerChoice:
    """The controller that answers a replay: the recorded one, with what the user changes of it.

    Robot and gains are the recorded numbers, whatever the files of this installation say today.
    """

    def __init__(
        self,
        flight: Mapping[str, Any],
        controller: str = "",
        gains: str = "",
        chosen: Mapping[str, Any] | None = None,
        trust: bool = False,
        laws: Sequence[LawInForce] = (),
    ) -> None:
        """Resolve the scenario of the bag; for ``controller`` to ``trust`` see `ReplayOptions`.

        Args:
            flight: the description in the bag; empty for a bag of another recorder.
            controller: law to fly.
            gains: gain set to fly.
            chosen: further parameters of the controller, over the recorded ones.
            trust: whether modules and files that the description names may be opened.
            laws: in force in flight; the first one flew if the description does not say.
        """
        chosen, recorded = dict(chosen or {}), recorded_options(flight)
        controller = str(chosen.pop("controller", controller))
        gains = str(chosen.pop("gains", gains))
        options = {name: recorded[name] for name in REPLAYED if name in recorded}
        scenario = recorded_scenario({**options, "mission": {}}, trust)
        flown_name, flown_gains = str(flight.get("controller", "")), scenario.gains
        if laws and not flown_name:
            flown_name = laws[0].name
            flown_gains = {flown_name: {gain: list(own) for gain, own in laws[0].gains.items()}}
        named = controller or str(recorded.get("controller") or flown_name)
        _check_law(named)
        if not trust:
            swaps = () if "swaps" in chosen else scenario.swaps
            swapped = (text.partition(":")[2].strip() for text in swaps)
            for name in (*swapped, *(() if controller else (named,))):
                require_shipped_law(name)
        law = find_law(named)
        is_same_law = law.name == (flown_name or law.name)
        replaced: Tree = {
            name: chosen.pop(name) for name in ("robot", "actuators") if name in chosen
        }
        if replaced:
            replaced["assumed_actuators"] = None
        elif "robot" not in recorded:
            _check_axes(laws)
        replaced["gains"] = _known(flown_gains, law)
        if gains:  # a set of the robot of that name
            robot = replaced.get("robot", scenario.robot)
            replaced["robot"] = Robot.from_dict(robot) if isinstance(robot, dict) else robot
            replaced["gains"] = gains_as_path(gains, robot_setting(replaced["robot"]))
        own = _parameters(scenario.parameters.get(ControllerNodeSettings.node, {}), chosen)
        replaced["parameters"] = {ControllerNodeSettings.node: own}
        scenario = scenario.replace(controller=named, **replaced)
        self._scenario, self._nodes = scenario, (nodes := FlightSettings.resolve(scenario))
        self.settings, self.robot = nodes.controller, nodes.robots.controller
        known, self._chosen = flight_laws(scenario, nodes), chosen
        self._swaps = parse_swaps(self.settings.swaps, self.settings.period)
        for swap in self._swaps:
            one_of(swap.name, known, "controller", " of swaps")
        self._hardware = software_actuators(scenario, nodes)
        self.names = self._hardware.robot_names(self.robot)
        self.law_name, self.gains_name = law.name, gains or str(flight.get("gains", "default"))
        self.swaps = [text for text in self.settings.swaps if text.strip()]
        """Laws swapped to in flight."""
        now = {gain: own.tolist() for gain, own in known[law.name].given_gains.items()}
        is_same_set = gains in ("", flight.get("gains"))
        is_same_set |= isinstance(flown_gains, dict) and now == flown_gains.get(law.name)
        self.is_as_flown = is_same_law and is_same_set
        """True if law and gains are those that flew; what was ``chosen`` is not looked at."""
        self.follows_flight = is_same_law and "swaps" not in chosen
        """True if laws and gains change as they did in flight."""

    def build_supervisor(self) -> tuple[Supervisor, LawChoice, Mapping[str, ControlLaw]]:
        """Build a supervisor without memory, the choice of its laws, and these by name."""
        laws = flight_laws(self._scenario, self._nodes)
        first = next(iter(laws.values()))
        controller = Controller.from_settings(self.robot, first, self.settings, self._hardware)
        choice = LawChoice(first, [(tick, laws[name]) for tick, name in self._swaps])
        return make_supervisor(controller, laws.values(), self.settings), choice, laws

    def set_gains(self, law: ControlLaw, flown: LawInForce) -> None:
        """Give a law the gains of the flight; those that the user gave stay."""
        if self.is_as_flown:
            kept = {
                gain: list(values)
                for gain, values in flown.gains.items()
                if f"{law.name}.{gain}" not in self._chosen
            }
            axes = self.robot.n + 3
            law.gain_values = check_gains({**law.gain_values, **kept}, type(law), axes, "the bag")


def _check_law(named: str) -> None:
    if named == NoLaw.name:
        raise InputError(
            "no law flew: the torques of this flight came from outside, on a bench or from a "
            "controller of your own: name the law that shall answer with --controller"
        )
    if not named:
        raise InputError(
            "the bag does not say which law was flown: name it with --controller, and its gains "
            "with --gains"
        )


def _check_axes(laws: Sequence[LawInForce]) -> None:
    axes = max((len(values) for law in laws for values in law.gains.values()), default=1)
    if axes not in (1, find_robot("paper").n + 3):
        raise InputError(
            f"the bag does not say which robot was flown, with {axes - 3} joints: name it with "
            "--set controller.robot=NAME"
        )


def _known(gains: Tree | str, law: type[ControlLaw]) -> Tree | str:
    # no other law is imported for its gains
    if isinstance(gains, str):
        return gains
    return {name: own for name, own in gains.items() if name in {law.name, *laws()}} or DEFAULT


def _parameters(recorded: Tree, chosen: Tree) -> Tree:
    options = {*OPTIONS, "navigation_sensors"}
    if "navigation_sensors" in chosen:
        options.add("navigation_filter")
    kept = ControllerNodeSettings.model_fields.keys() - options
    return {k: v for k, v in recorded.items() if k.partition(".")[0] in kept} | chosen
