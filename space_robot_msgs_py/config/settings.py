"""Settings of the nodes: from files in ``config/``, selected by name, and overrides.

``config/`` contains ROS parameter files and robots. The settings of a node are the defaults of its
schema, overridden by the files of its selectors (robot, case, ...), then by the user's values.
Nodes and in-process flights use this module, so both have the same settings.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from inspect import isclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, get_origin

from pydantic import AfterValidator, BaseModel, Field, field_validator
from typing_extensions import Self

from ..samples import Timebase
from ..topics import Topic
from .files import Tree, merge, nest, node_parameters
from .installation import GRAPH_FILE, config_directory
from .validation import StrictModel, short, validate

SHORTEST_PERIOD = 1e-5
"""Shortest tick, s."""
Texts = Annotated[list[str], AfterValidator(lambda texts: texts or [""])]
"""List of texts; empty texts are ignored, because ROS has no empty list of strings."""
WaitFor = Annotated[
    Texts, Field(description="subscribers to wait for before sending: NODE, or NODE:TOPIC")
]


class NodeSettings(StrictModel):
    """Settings common to all nodes of the graph; base class of each node's schema."""

    node: ClassVar[str]
    """Name of the node: plant, controller, mission, recorder."""
    selectors: ClassVar[tuple[str, ...]] = ("robot",)
    """Fields that select configuration files."""
    sends: ClassVar[tuple[Topic, ...]] = ()
    """Topics for whose subscribers the node can wait (parameter ``wait_for``)."""

    robot: str = Field(
        "paper", description="a robot of config/robots, or a path to its YAML, URDF or folder"
    )
    period: Annotated[float, Field(ge=SHORTEST_PERIOD, le=0.1)] = Field(
        0.0005, description="length of a tick, s; the same for all nodes"
    )
    fifo_priority: Annotated[int, Field(ge=0, le=98)] = Field(
        0, description="SCHED_FIFO priority to request (0: default scheduling)"
    )

    @field_validator("wait_for", check_fields=False)
    @classmethod
    def _can_be_waited_for(cls, entries: list[str]) -> list[str]:
        names = [topic.name for topic in cls.sends]
        for entry in entries:
            _, colon, topic = entry.partition(":")
            if colon and topic.strip("/") not in names:
                raise ValueError(f"{short(entry)}: choose a topic it sends, {', '.join(names)}")
        return entries

    @classmethod
    def ros_name(cls) -> str:
        """Return the name of the ROS node, of its executable and of its section in files."""
        return f"{cls.node}_node"

    @property
    def timebase(self) -> Timebase:
        """Conversion of ticks and stamps at this period."""
        return Timebase(round(self.period * 1e9))

    @classmethod
    def layers(cls, selected: Mapping[str, str]) -> list[Path]:
        """Return the parameter files for the selectors' values."""
        return [config_directory() / GRAPH_FILE]

    @classmethod
    def read_layer(cls, path: Path, selected: Mapping[str, str]) -> Tree:
        """Read what a file of `layers` says to the node, for the selectors' values."""
        return node_parameters(path, cls.node)

    @classmethod
    def resolve(cls, overrides: Mapping[str, Any]) -> Self:
        """Read the settings from the files and the user's (dotted or nested) overrides."""
        where = f"{cls.node} parameters"
        own, tree = nest(overrides), Tree()
        base = node_parameters(config_directory() / GRAPH_FILE, cls.node)
        chosen = validate(cls, merge(base, own), where)
        selected = {name: str(getattr(chosen, name)) for name in cls.selectors}
        for path in cls.layers(selected):
            layer = cls.read_layer(path, selected)
            validate(cls, merge(tree, layer), str(path))
            tree = merge(tree, layer)
        return validate(cls, merge(tree, own), where)


def leaves(schema: type[BaseModel], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted name and pydantic field of every setting of a schema."""
    for name, field in schema.model_fields.items():
        inner = field.annotation
        if get_origin(inner) is None and isclass(inner) and issubclass(inner, BaseModel):
            yield from leaves(inner, f"{prefix}{name}.")
        else:
            yield prefix + name, field
