"""Schema of a robot's YAML file, with checks of physical consistency."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from space_robot_msgs_py.config.text import choices
from space_robot_msgs_py.config.validation import StrictModel, short

from ..elementary.matrices import product
from .inertia import Inertia, Mass, inertia_tensor
from .link_file import BASE, FrameFile, LinkFile, body_of
from .plate_file import Plates
from .tree import Body, Tool, first_repeated, other_meaning
from .visual_file import VisualFile

Array = NDArray[np.float64]


MOST_LINKS = 4000
"""Maximum number of links in a robot's file, including fixed ones."""


class BaseFile(StrictModel):
    """``robot.base``: mass in kg, inertia about the CoM in kg m2."""

    mass: Mass
    inertia: Inertia


class ToolFile(FrameFile):
    """``robot.tool``, or one entry of ``robot.tools``: an end effector's frame on a link."""

    name: Annotated[str, Field(min_length=1)] = "tool"
    link: str = ""
    """Name of the link; the last one in the file if empty."""


def _distinct_names(links: list[LinkFile]) -> list[LinkFile]:
    names = [link.name for link in links]
    if (repeated := first_repeated(names)) is not None:
        raise ValueError(f"joint names must differ, {short(repeated)} occurs twice")
    moving = [link.name for link in links if link.joint != "fixed"]
    for name in names:
        meaning = other_meaning(name, moving) if name in moving else ""
        if name == BASE:
            meaning = "the name of the base"
        if meaning:
            raise ValueError(f"joint {short(name)} needs another name: it is {meaning}")
    return links


def _check_links(what: str, on: list[str], info: ValidationInfo) -> None:
    if (links := info.data.get("links")) is None:  # they are wrong themselves
        return
    names = [BASE, *(link.name for link in links)]
    for number, name in enumerate(on):
        if name not in names:
            raise ValueError(
                f"unknown link {short(name)} of {what} {number}: {choices(name, names)}"
            )


class RobotFile(StrictModel):
    """Key ``robot`` of a robot's YAML."""

    name: Annotated[str, Field(min_length=1)]
    base: BaseFile
    links: Annotated[
        list[LinkFile], Field(min_length=1, max_length=MOST_LINKS), AfterValidator(_distinct_names)
    ]
    tool: ToolFile | None = None
    tools: list[ToolFile] = Field([])
    plates: Plates = Field([])
    visuals: list[VisualFile] = Field([])

    @field_validator("tool", mode="after")
    @classmethod
    def _tool_is_on_a_link(cls, tool: ToolFile | None, info: ValidationInfo) -> ToolFile | None:
        if tool and tool.link:
            _check_links("tool", [tool.link], info)
        return tool

    @field_validator("tools", mode="after")
    @classmethod
    def _tools_differ(cls, tools: list[ToolFile], info: ValidationInfo) -> list[ToolFile]:
        if tools and info.data.get("tool"):
            raise ValueError("a robot has either tool or tools: list all of them in tools")
        if (repeated := first_repeated(tool.name for tool in tools)) is not None:
            raise ValueError(f"tool names must differ, {short(repeated)} occurs twice")
        _check_links("tool", [tool.link or BASE for tool in tools], info)
        return tools

    @field_validator("plates", "visuals", mode="after")
    @classmethod
    def _are_on_links(cls, entries: list[Any], info: ValidationInfo) -> list[Any]:
        what = str(info.field_name).removesuffix("s")
        _check_links(what, [entry.link for entry in entries], info)
        return entries

    def bodies(self) -> list[Body]:
        """Return the bodies of the tree defined by the file."""
        tools = [*([self.tool] if self.tool else []), *self.tools] or [ToolFile()]
        last = self.links[-1].name
        base = Body(BASE, self.base.mass, inertia_tensor(self.base.inertia), np.zeros(3))
        bodies = [replace(base, tools=_tools_of(BASE, tools, last), **self._surfaces(BASE))]
        for above, link in itertools.pairwise((None, *self.links)):
            assert link
            above_name = above.name if above else BASE
            body = body_of(link, link.parent or above_name)
            on_link = _tools_of(link.name, tools, last)
            bodies.append(replace(body, tools=on_link, **self._surfaces(link.name)))
        return bodies

    def _surfaces(self, link: str) -> dict[str, Any]:
        """Return plates and visuals of a link as fields of its `Body`."""
        return {
            "plates": tuple(plate.plate for plate in self.plates if plate.link == link),
            "visuals": tuple(shape.visual for shape in self.visuals if shape.link == link),
        }


def _tools_of(body: str, tools: list[ToolFile], last: str) -> tuple[Tool, ...]:
    return tuple(
        Tool(tool.name, tool.rotation, product(tool.rotation, tool.offset), rank=rank)
        for rank, tool in enumerate(tools)
        if (tool.link or last) == body
    )


class _RobotDocument(StrictModel):
    robot: RobotFile
