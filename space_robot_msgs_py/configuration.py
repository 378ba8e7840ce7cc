"""Settings of the nodes: from files in ``config/``, by name, with overrides on top.

``config/`` holds ROS parameter files (and the robots). A node's settings are the defaults of
its schema, then the files its selectors name (a robot, a case, ...), then what the user gives.
The nodes and the in-process flight resolve them here, so both fly the same numbers.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from inspect import isclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, get_origin

from pydantic import AfterValidator, BaseModel, Field
from typing_extensions import Self

from .errors import InputError
from .samples import Timebase
from .validation import Strict, check, read_yaml, short
from .yaml_text import check_file

Tree = dict[str, Any]

Texts = Annotated[list[str], AfterValidator(lambda texts: texts or [""])]
"""Texts of which empty ones count for nothing: ROS has no empty list of strings."""

GRAPH_FILE = "space_robot.yaml"
"""The file of the graph's defaults in the config folder."""


def config_directory() -> Path:
    """The ``config/`` folder: the source tree's, or the one installed under ``share/``.

    Raises:
        InputError: the installation is incomplete.
    """
    for parent in Path(__file__).resolve().parents:
        for folder in (parent / "config", parent / "share/space_robot/config"):
            if (folder / GRAPH_FILE).is_file():
                return folder
    raise InputError("the package's config folder is not installed: reinstall space_robot")


def named_file(kind: str, name: str) -> Path:
    """``config/<kind>/<name>.yaml``, or ``name`` itself if it is a path to a YAML file.

    Raises:
        InputError: there is no such file; names the ones there are.
    """
    if name.endswith((".yaml", ".yml")):
        path = Path(name)
        check_file(path)
        return path
    folder = config_directory() / kind
    names = sorted(file.stem for file in folder.glob("*.yaml"))
    if name not in names:
        raise InputError(
            f"unknown {kind.rstrip('s')} {short(name)}: choose one of {', '.join(names)}, "
            "or a path to a .yaml file"
        )
    return folder / f"{name}.yaml"


def mission_file(robot: str, mission: str) -> Path:
    """The file of a mission, of the robot's own if it is empty.

    Raises:
        InputError: there is none, or no such robot; names those there are.
    """
    if mission:
        return named_file("missions", mission)
    named_file("robots", robot)  # first: else its mission would be said to be unknown
    name = Path(robot).stem
    try:
        return named_file("missions", name)
    except InputError as error:
        raise InputError(f"robot {short(robot)} has no mission of its own, {error}") from None


def node_parameters(path: Path, node: str) -> Tree:
    """What a ROS parameter file says to a node (keys ``/**``, then its ROS name), as a tree.

    Raises:
        InputError: the file cannot be read or is not a ROS parameter file.
    """
    merged: Tree = {}
    for name, content in read_yaml(path).items():
        if not isinstance(content, dict) or list(content) != ["ros__parameters"]:
            raise InputError(
                f"{path}: {name}: 'ros__parameters' was expected below the node's name"
            )
        given = content["ros__parameters"] or {}
        if not isinstance(given, dict):
            raise InputError(f"{path}: {name}: parameters were expected, got {short(given)}")
        if str(name).strip("/") in ("**", f"{node}_node"):
            merged = merge(merged, nest(given))
    return merged


def merge(below: Tree, above: Mapping[str, Any]) -> Tree:
    """``below`` with the leaves of ``above`` put over it."""
    merged = dict(below)
    for key, value in above.items():
        old = merged.get(key)
        both = isinstance(old, dict) and isinstance(value, Mapping)
        merged[key] = merge(old, value) if both else value  # type: ignore[arg-type]
    return merged


def nest(flat: Mapping[Any, Any]) -> Tree:
    """``{"a.b": 1}`` to ``{"a": {"b": 1}}``.

    Raises:
        InputError: something is given as a value and as a group of values.
    """
    tree: Tree = {}
    for key, value in flat.items():
        head, _, rest = str(key).partition(".")
        inner = nest({rest: value}) if rest else nest(value) if isinstance(value, dict) else value
        if head in tree and isinstance(tree[head], dict) is not isinstance(inner, dict):
            raise InputError(f"{head}: given as a value, and as a group of values")
        tree = merge(tree, {head: inner})
    return tree


def flatten(tree: Mapping[Any, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """``{"a": {"b": 1}}`` to ``("a.b", 1)``, leaf by leaf; an empty mapping is one."""
    for key, value in tree.items():
        if isinstance(value, Mapping) and value:
            yield from flatten(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


class NodeSettings(Strict):
    """What every node of the graph is told; each node's schema derives from it."""

    node: ClassVar[str]
    """What the node is: plant, controller, mission, recorder."""
    selectors: ClassVar[tuple[str, ...]] = ("robot",)
    """Fields that choose configuration files."""

    robot: str = Field("paper", description="a robot of config/robots, or a path to its YAML")
    period: Annotated[float, Field(ge=1e-5, le=0.1)] = Field(
        0.0005, description="length of a tick, s; the same for all nodes"
    )
    fifo_priority: Annotated[int, Field(ge=0, le=98)] = Field(
        0, description="SCHED_FIFO priority to ask for (0: the usual scheduling)"
    )

    @classmethod
    def ros_name(cls) -> str:
        """The node's name in ROS, key of its section in parameter files; also its executable."""
        return f"{cls.node}_node"

    @property
    def timebase(self) -> Timebase:
        """Ticks and stamps at this period."""
        return Timebase(round(self.period * 1e9))

    @classmethod
    def layers(cls, selected: Mapping[str, str]) -> list[Path]:
        """The parameter files below the user's overrides, for the selectors' values."""
        return [config_directory() / GRAPH_FILE]

    @classmethod
    def resolve(cls, overrides: Mapping[str, Any]) -> Self:
        """Settings from the files and the user's (dotted or nested) overrides.

        Raises:
            InputError: naming the file or override at fault.
        """
        where = f"{cls.node} parameters"
        given, tree = nest(overrides), Tree()
        base = node_parameters(config_directory() / GRAPH_FILE, cls.node)
        chosen = check(cls, merge(base, given), where)
        selected = {name: str(getattr(chosen, name)) for name in cls.selectors}
        for path in cls.layers(selected):
            layer = node_parameters(path, cls.node)
            check(cls, merge(tree, layer), str(path))
            tree = merge(tree, layer)
        return check(cls, merge(tree, given), where)


def leaves(schema: type[BaseModel], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted name and pydantic field of every setting of a schema."""
    for name, field in schema.model_fields.items():
        inner = field.annotation
        if get_origin(inner) is None and isclass(inner) and issubclass(inner, BaseModel):
            yield from leaves(inner, f"{prefix}{name}.")
        else:
            yield prefix + name, field
