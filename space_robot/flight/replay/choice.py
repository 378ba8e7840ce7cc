"""The controller that answers the replay: the one that flew, or another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import yaml

from space_robot_control.allocation.settings import assumed_actuators
from space_robot_control.controller.controller import Controller
from space_robot_control.controller.gains import Laws, build_law, check_gains, split_gains
from space_robot_control.controller.law_choice import LawChoice, NoLaw, parse_swaps
from space_robot_control.controller.settings import (
    DEFAULT,
    ControllerNodeSettings,
    gain_files,
    gains_as_path,
)
from space_robot_control.controller.supervisor import Supervisor
from space_robot_control.flight_code.supervisors import supervisor_of
from space_robot_control.laws import ControlLaw, find_law, laws
from space_robot_control.laws.names import is_plain, require_shipped_file, require_shipped_law
from space_robot_model.robot.find import ROBOT_STEM, find_robot
from space_robot_msgs_py.config.files import Tree, flatten
from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import LawInForce

NODE = ControllerNodeSettings.node


class ControllerChoice:
    """The controller that answers a replay: the recorded one, with what the user changes of it.

    Robot and gains are the recorded numbers, whatever the files of this installation say today.
    """

    def __init__(
        self,
        flight: Mapping[str, Any],
        folder: Path,
        controller: str = "",
        gains: str = "",
        chosen: Mapping[str, Any] | None = None,
        trust: bool = False,
        laws: Sequence[LawInForce] = (),
    ) -> None:
        """Resolve the parameters; for ``controller`` to ``trust`` see `ReplayOptions`.

        Args:
            flight: the description in the bag; empty for a bag of another recorder.
            folder: for the recorded robot and actuators, as files that parameters name.
            controller: law to fly.
            gains: gain set to fly.
            chosen: further parameters of the controller, over the recorded ones.
            trust: whether modules and files that the description names may be opened.
            laws: in force in flight; the first one flew if the description does not say.
        """
        if laws and "controller" not in flight:
            gains_used = {name: list(values) for name, values in laws[0].gains.items()}
            flight = {**flight, "controller": laws[0].name, "gains_used": gains_used}
        chosen = chosen or {}
        controller = str(chosen.get("controller", controller))
        gains = str(chosen.get("gains", gains))
        flown = flight.get("parameters", {}).get(NODE, {})
        named = controller or flown.get("controller") or flight.get("controller")
        if named == NoLaw.name:
            raise InputError(
                "no law flew: the torques of this flight came from outside, on a bench or from a "
                "controller of your own: name the law that shall answer with --controller"
            )
        if not named:
            raise InputError(
                "the bag does not say which law was flown: name it with --controller, and its "
                "gains with --gains"
            )
        gains = gains_as_path(gains, str(flown.get("robot", "paper")))
        self._flight, self._folder, self._trust = flight, folder, trust
        self._flown = flown
        self._flown_swaps = [text for text in flown.get("swaps", ()) if text.strip()]
        self._overrides = {
            **({"controller": controller} if controller else {}),
            **({"gains": gains} if gains else {}),
            **chosen,
        }
        """By the user; all else is the bag's word."""
        if not trust:
            self._check_laws(str(named), flown)
        self.gains_name = gains or str(flown.get("gains", "default"))
        law = find_law(str(named))
        self.law_name = law.name
        is_same_law = law.name == flight.get("controller", law.name)
        recorded_gains = flight.get("gains_used", {})
        own, law_gains = split_gains(flown)
        self.parameters: dict[str, Any] = {**dict(flatten(own)), **self._robot(flown)}
        """By dotted name, gains included."""
        if not gains:
            if recorded_gains and is_same_law:
                law_gains = {law.name: dict(recorded_gains), **law_gains}
            self.parameters |= self._recorded_gains(law_gains)
        if "actuators" not in self._overrides:
            self.parameters |= self._actuators(flown)
        if "navigation_sensors" not in self._overrides:
            self.parameters |= _recorded_navigation(flight)
        self.parameters |= self._overrides
        if not trust:
            self._check_files(flown)
        self.swaps = [text for text in self.parameters.get("swaps", []) if text.strip()]
        """Laws swapped to in flight."""
        now = self._resolve()
        self.is_as_flown = is_same_law and (
            not gains or gains == flown.get("gains") or _same(now.given_gains, recorded_gains)
        )
        """True if law and gains are those that flew; what was ``chosen`` is not looked at."""
        self.follows_flight = is_same_law and "swaps" not in chosen
        """True if laws and gains change as they did in flight."""

    def build_supervisor(self) -> tuple[Supervisor, LawChoice, Mapping[str, ControlLaw]]:
        """Build a supervisor without memory, the choice of its laws, and these by name."""
        settings = self.settings
        laws = Laws(settings, self._axes, self._gains)
        swaps = parse_swaps(settings.swaps, settings.period)
        first = next(iter(laws.values()))
        controller = Controller.from_settings(self.robot, first, settings, self._hardware)
        choice = LawChoice(first, [(tick, laws[name]) for tick, name in swaps])
        return supervisor_of(controller, laws.values(), settings), choice, laws

    def set_gains(self, law: ControlLaw, flown: LawInForce) -> None:
        """Give a law the gains of the flight; those that the user gave stay."""
        if self.is_as_flown:
            kept = {
                gain: list(values)
                for gain, values in flown.gains.items()
                if f"{law.name}.{gain}" not in self._overrides
            }
            law.gain_values = check_gains(
                {**law.gain_values, **kept}, type(law), self._axes, "the bag"
            )

    def _check_laws(self, named: str, flown: Mapping[str, Any]) -> None:
        if "controller" not in self._overrides:
            require_shipped_law(named)
        if "swaps" not in self._overrides:
            for swap in self._flown_swaps:
                require_shipped_law(_swap_law(swap))

    def _check_files(self, flown: Mapping[str, Any]) -> None:
        for what in ("robot", "gains", "navigation_sensors", "actuators"):
            if what not in self._overrides and self.parameters.get(what) == flown.get(what, ""):
                require_shipped_file(what, str(flown[what]))

    def _robot(self, flown: Mapping[str, Any]) -> dict[str, str]:
        content = self._flight.get("controller_robot_file", self._flight.get("robot_file"))
        if content is None:
            return {}
        name = Path(str(flown.get("robot", "paper"))).stem
        path = (
            self._folder / f"{name if is_plain(name) and name != ROBOT_STEM else 'recorded'}.yaml"
        )
        _write(path, content)
        return {"robot": str(path)}

    def _actuators(self, flown: Mapping[str, Any]) -> dict[str, str]:
        flight = self._flight
        content = flight.get("controller_base_actuators", flight.get("base_actuators"))
        if not content:
            return {}
        name = Path(str(flown.get("actuators", ""))).stem
        path = self._folder / f"actuators_{name if is_plain(name) else 'recorded'}.yaml"
        _write(path, {"plant_node": {"ros__parameters": content}})
        return {"actuators": str(path)}

    def _recorded_gains(self, law_gains: Mapping[str, Tree]) -> dict[str, Any]:
        parameters = dict(flatten(law_gains))
        for name in law_gains.keys() & laws():  # a set of today may have gains that none had
            for gain in laws()[name].optional_gains():
                parameters.setdefault(f"{name}.{gain}", [0.0])
        if law_gains and set(map(_swap_law, self._flown_swaps)) <= set(law_gains):
            parameters["gains"] = self.gains_name if self._has_gain_set() else DEFAULT
        return parameters

    def _has_gain_set(self) -> bool:
        with suppress(InputError):
            if self._trust or is_plain(self.gains_name):
                robot = (self._flown if self._trust else self.parameters).get("robot", "paper")
                return bool(gain_files(str(robot), self.gains_name))
        return False

    def _resolve(self) -> ControlLaw:
        own, self._gains = split_gains(self.parameters)
        self.settings = settings = ControllerNodeSettings.resolve(own)
        self.robot = find_robot(settings.robot)
        self._axes = axes = self.robot.n + 3
        flown_axes = {len(values) for values in self._flight.get("gains_used", {}).values()}
        if "robot" not in self.parameters and flown_axes - {1, axes}:
            raise InputError(
                f"the bag does not say which robot was flown, with {max(flown_axes) - 3} joints: "
                "name it with --set controller.robot=NAME"
            )
        laws = Laws(settings, axes, self._gains)
        for swap in parse_swaps(settings.swaps, settings.period):
            one_of(swap.name, laws, "controller", " of swaps")
        self._hardware = assumed_actuators(settings.actuators, self.robot)
        self.names = self._hardware.robot_names(self.robot)
        if "gains" in self._overrides:
            return build_law(settings.controller, settings, axes)
        return next(iter(laws.values()))


def _recorded_navigation(flight: Mapping[str, Any]) -> dict[str, Any]:
    recorded = flight.get("navigation_filter", {})
    numbers = {f"navigation_filter.{name}": value for name, value in recorded.items()}
    return {"navigation_sensors": "fine", **numbers} if numbers else {}


def _swap_law(text: str) -> str:
    return text.partition(":")[2].strip()


def _same(now: Mapping[str, Any], recorded: Mapping[str, Any]) -> bool:
    return {name: list(value) for name, value in now.items()} == {
        name: list(value) for name, value in recorded.items()
    }


def _write(path: Path, content: Mapping[str, Any]) -> None:
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
