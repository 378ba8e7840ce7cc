"""Parameters of mission_node."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from space_robot_model.robot.find import mission_layers
from space_robot_model.robot.mission_document import mission_layer
from space_robot_msgs_py.config.files import Tree
from space_robot_msgs_py.config.settings import NodeSettings

from .mission import MissionSettings
from .trajectory_file import with_columns


class MissionNodeSettings(MissionSettings, NodeSettings):
    """Parameters of mission_node."""

    node: ClassVar[str] = "mission"
    selectors: ClassVar[tuple[str, ...]] = ("robot", "mission")

    mission: str = Field(
        "",
        description="a mission of config/missions, or a path to its YAML or to a trajectory in "
        "CSV or Parquet (empty: the robot's)",
    )
    goto: str = Field(
        "",
        description="a segment to fly from now on in place of the mission, as YAML text, set in "
        "flight; the same text again is ignored",
    )
    chunk_ticks: Annotated[int, Field(ge=1, le=10_000)] = Field(
        100, description="ticks per message of the reference"
    )
    lead_ticks: Annotated[int, Field(ge=1, le=10_000)] = Field(
        1000, description="lead of the reference ahead of the plant, ticks"
    )

    @classmethod
    def layers(cls, selected: Mapping[str, str]) -> list[Path]:
        """The mission's own file over the graph's."""
        return [*super().layers(selected), *mission_layers(selected["robot"], selected["mission"])]

    @classmethod
    def read_layer(cls, path: Path, selected: Mapping[str, str]) -> Tree:
        """Read a parameter file, a mission's document, or a trajectory.

        Raises:
            InputError: the file cannot be read, or a key in it is wrong.
        """
        layer = mission_layer(path, cls.node, selected["robot"])
        if texts := layer.get("segments"):
            layer["segments"] = [with_columns(text, path.parent) for text in texts]
        return layer
