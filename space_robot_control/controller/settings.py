"""Parameters of controller_node, and the files of its gain sets."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field, field_validator

from space_robot_model.robot.find import YAML, new_command, robot_files
from space_robot_msgs_py import topics
from space_robot_msgs_py.config.files import GIVEN, named_layers
from space_robot_msgs_py.config.settings import NodeSettings, Texts, WaitFor
from space_robot_msgs_py.config.validation import one_of, read_yaml, short
from space_robot_msgs_py.config.yaml_text import check_readable, is_folder
from space_robot_msgs_py.errors import InputError

from ..allocation.settings import AllocationSettings
from ..navigation.settings import NavigationFilterSettings, NavigationMode, completed

SET_FILE = "controller.yaml"
"""A file of a gain set with the controller's parameters that belong to its gains; need not be."""
DEFAULT, DEFAULT_SETS, OTHERS = "default", "default_sets.yaml", "others"
"""The set that is flown unless another is named, and the file of a robot's gains that says for a
law, or for all others, which one that is; without such a file it is the folder of gains itself."""


def gain_files(robot: str, gain_set: str) -> dict[str, Path]:
    """Return the gain file of each law, by name, for a robot (name or path) and a set.

    ``gain_set`` is ``default``, a folder's name among the robot's gains (``config/gains/<robot>``,
    or ``gains`` in its own folder), or a path to a folder of ``<law>.yaml`` or to one such file.
    """
    path = Path(gain_set)
    if gain_set.endswith(YAML):
        check_readable(path)
        return {path.stem: path}
    if "/" in gain_set:
        return _files(path)
    files = robot_files(robot)
    if robot == GIVEN:
        raise InputError("a robot that no file tells has no gains of its own: give some")
    if (folder := files.gains) is None:
        raise InputError(
            f"robot {short(robot)} has no gains of its own: `{new_command(robot)}` makes "
            "gains and a mission for it; or name a folder of <law>.yaml files as gains"
        )
    if gain_set == DEFAULT:
        if not (chosen := _default_sets(folder)):
            return _files(folder)
        others = _files(folder / chosen.pop(OTHERS)) if OTHERS in chosen else {}
        return others | {law: folder / name / f"{law}.yaml" for law, name in chosen.items()}
    one_of(gain_set, [DEFAULT, *_sets(folder)], "gain set", f" of robot {short(files.name)}")
    return _files(folder / gain_set)


def set_file(robot: str, gain_set: str) -> list[Path]:
    """Return the `SET_FILE` of a gain set as `gain_files` takes it, if it has one.

    The default set has one if it is the same set for all laws.
    """
    folder = Path(gain_set) if "/" in gain_set else robot_files(robot).gains
    if folder is None or gain_set.endswith(YAML):
        return []
    if gain_set == DEFAULT:
        names = set(_default_sets(folder).values()) or {"."}
        if len(names) > 1:
            return []
        folder = folder / names.pop()
    elif "/" not in gain_set:
        folder = folder / gain_set
    file = folder / SET_FILE
    return [file] if is_folder(folder) and file.is_file() else []


def gains_as_path(gain_set: str, robot: str) -> str:
    """Resolve a user's gain set: ``g`` is the folder ``g/`` if no set has that name.

    Not for names out of bags: these open no folder of the user's.
    """
    if "/" in gain_set or gain_set == DEFAULT:
        return gain_set
    with suppress(InputError):  # of a bag: a robot that is not here
        if (own := robot_files(robot).gains) and gain_set in _sets(own):
            return gain_set
    return f"{gain_set}/" if gain_set and is_folder(Path(gain_set)) else gain_set


def _default_sets(folder: Path) -> dict[str, str]:
    file = folder / DEFAULT_SETS
    return {law: str(name) for law, name in read_yaml(file).items()} if file.is_file() else {}


def _sets(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir() if entry.is_dir())


def _files(folder: Path) -> dict[str, Path]:
    files = sorted(folder.glob("*.yaml")) if is_folder(folder) else []
    gains = {file.stem: file for file in files if file.name != SET_FILE}
    if not gains:
        raise InputError(f"{short(str(folder))}: no folder with gain files (<law>.yaml)")
    return gains


class ControllerNodeSettings(NodeSettings):
    """Parameters of controller_node; the gains stand beside them as ``<law>.<gain>``."""

    node: ClassVar[str] = "controller"
    selectors: ClassVar[tuple[str, ...]] = ("robot", "actuators", "gains")
    sends: ClassVar[tuple[topics.Topic, ...]] = (
        topics.COMMAND,
        topics.TELEMETRY,
        topics.SIGNALS,
        topics.LAW,
    )

    controller: str = Field(
        "tde_stc", description="control law: a name, or file.py:Class or module:Class of your own"
    )
    gains: str = Field(
        "default", description="gain set of config/gains/<robot>, or a path to a file or folder"
    )
    actuators: str = Field(
        "ideal",
        description="the base's actuators that the controller assumes: a name of config/actuators, "
        "or a path to a YAML file",
    )
    controller_code: str = Field(
        "python",
        description="what answers: the kernels compiled here (python), the same as C (c), or the "
        "flight computer at udp:HOST:PORT",
    )
    shadow: Literal["none", "c"] = Field(
        "none",
        description="what answers beside it, to be compared bit by bit; a difference ends the "
        "flight",
    )
    telemetry_decimation: Annotated[int, Field(ge=1, le=10**6)] = Field(
        20,
        description="ticks between two messages on /controller/telemetry and /controller/signals",
    )
    telemetry: str = Field(
        "", description="where telemetry packets go: udp:HOST:PORT or a file (empty: nowhere)"
    )
    telemetry_packets: str = Field(
        "housekeeping",
        description="what they have: a name of config/telemetry, or a path to a YAML file",
    )
    swaps: Texts = Field(
        [""], description="changes of the law in flight, each as T:LAW with T in simulated seconds"
    )
    acceleration_filter_hz: Annotated[float, Field(ge=0.0, le=1e5)] = Field(
        0.0,
        description="corner frequency of the low-pass filter of the time-delay estimate, Hz "
        "(0: none)",
    )
    navigation: NavigationMode = Field(
        "direct", description="input of the laws: direct (measurements) or filtered (estimates)"
    )
    navigation_sensors: str = Field(
        "fine",
        description="sensors that the filter assumes: a name of config/sensors, or a path to a "
        "YAML file",
    )
    navigation_filter: NavigationFilterSettings = NavigationFilterSettings()
    allocation: AllocationSettings = AllocationSettings()
    hold_ticks: Annotated[int, Field(ge=0, le=10**6)] = Field(
        200, description="invalid states for which the last torque is held; then the torque is zero"
    )
    longest_jump: Annotated[int, Field(ge=1, le=10**9)] = Field(
        2000, description="largest accepted number of ticks from one state to the next"
    )
    reference_timeout: Annotated[float, Field(ge=0.0, le=1e6)] = Field(
        2.0,
        description="time to wait for a reference, s of the wall clock; then its last point is "
        "held",
    )
    join_timeout: Annotated[float, Field(ge=0.0, le=1e6)] = Field(
        0.0,
        description="longest wait for a mission's first reference, s of the wall clock "
        "(0: no limit)",
    )
    state_timeout: Annotated[float, Field(ge=0.001, le=1e6)] = Field(
        2.0, description="time without a state after which this is reported, s of the wall clock"
    )
    wait_for: WaitFor = Field([""])
    listener_timeout: Annotated[float, Field(ge=0.0, le=1e6)] = Field(
        0.0, description="longest time to wait for wait_for, s of the wall clock (0: no limit)"
    )

    @property
    def answers_in_python(self) -> bool:
        """True if nothing but the kernels compiled here answers."""
        return self.controller_code == "python" and self.shadow == "none"

    @field_validator("controller_code")
    @classmethod
    def _is_code(cls, code: str) -> str:
        if not re.fullmatch(r"python|c|udp:[^:]+:[0-9]{1,5}", code):
            raise ValueError("python, c or udp:HOST:PORT was expected")
        return code

    @property
    def filter_settings(self) -> NavigationFilterSettings | None:
        """The numbers of the navigation filter, complete; None: there is none."""
        if self.navigation == "direct":
            return None
        return completed(self.navigation_filter, self.navigation_sensors, self.period)

    @classmethod
    def layers(cls, selected: Mapping[str, str]) -> list[Path]:
        """Add what the files of the actuators and of the gain set say to the controller itself."""
        return [
            *super().layers(selected),
            *named_layers("actuators", selected["actuators"]),
            *set_file(selected["robot"], selected["gains"]),
        ]
