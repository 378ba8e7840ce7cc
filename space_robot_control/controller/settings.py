"""Parameters of controller_node."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field, field_validator

from space_robot_model.robot.find import robot_files
from space_robot_msgs_py import topics
from space_robot_msgs_py.config.files import named_layers
from space_robot_msgs_py.config.settings import NodeSettings, Texts
from space_robot_msgs_py.config.validation import read_yaml
from space_robot_msgs_py.config.yaml_text import is_folder

from ..allocation.settings import AllocationSettings
from ..navigation.settings import NavigationFilterSettings, NavigationMode, completed

OF_THE_SET = "controller.yaml"
"""A file of a gain set with the controller's parameters that belong to its gains; need not be."""
DEFAULT, DEFAULT_SETS, OTHERS = "default", "default_sets.yaml", "others"
"""The set that is flown unless another is named, and the file of a robot's gains that says for a
law, or for all others, which one that is; without such a file it is the folder of gains itself."""


def set_file(robot: str, gains: str) -> list[Path]:
    """Return the `OF_THE_SET` of a gain set (name, or path to a folder), if it has one.

    The default set has one if it is the same set for all laws.

    Raises:
        InputError: there is no such robot.
    """
    folder = Path(gains) if "/" in gains else robot_files(robot).gains
    if folder is None or gains.endswith((".yaml", ".yml")):
        return []
    if gains == DEFAULT:
        default = folder / DEFAULT_SETS
        chosen = set(read_yaml(default).values()) if default.is_file() else {"."}
        folder = folder / str(chosen.pop()) if len(chosen) == 1 else folder / DEFAULT
    elif "/" not in gains:
        folder = folder / gains
    file = folder / OF_THE_SET
    return [file] if is_folder(folder) and file.is_file() else []


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
    wait_for: Texts = Field(
        [""],
        description="subscribers to wait for before the first command: NODE:TOPIC, or NODE for "
        "all topics",
    )
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
        """The numbers of the navigation filter, complete; None: there is none.

        Raises:
            InputError: the sensors that it is for are not there, or their file is wrong.
        """
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
