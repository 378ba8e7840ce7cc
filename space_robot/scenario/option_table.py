"""The options of a flight, each declared once.

`FlightPlan`, the command line, launch arguments, scenario files and the reference are made from
this table. It imports nothing heavy, so that ``--help`` is quick.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

Kind = Literal["name", "text", "number", "whole number", "switch", "texts", "size"]


@dataclass(frozen=True)
class Option:
    """One option of a flight."""

    name: str
    """Field of `FlightPlan`, key of a scenario file, launch argument."""
    kind: Kind
    """``name``: a name or path, in a scenario also the numbers themselves."""
    help: str
    """``{names}`` stands for the names of the files in `folder`."""
    default: Any = None
    default_text: str = ""
    """Text shown for a default of None or ""; empty: the default itself is shown."""
    low: float | None = None
    high: float | None = None
    above: float | None = None
    choices: tuple[str, ...] = ()
    flag: str = ""
    """On the command line (empty: --name)."""
    metavar: str = ""
    folder: str = ""
    """Folder of config/ with the files, or folders, that can be named."""
    other_names: tuple[str, ...] = ()
    """Names without a file there."""
    needs_graph: bool = False
    """True if the option applies only to a graph of nodes."""
    is_launched: bool = True
    """True if the option is also an argument of the launch file."""

    @property
    def help_text(self) -> str:
        """Return the help with the names of the files and the default."""
        from space_robot_msgs_py.config.installation import config_directory

        text = self.help
        if "{names}" in text:
            files = sorted((config_directory() / self.folder).glob("*.yaml"))
            text = text.replace("{names}", ", ".join(file.stem for file in files))
        return f"{text} [default: {self.default_text}]." if self.default_text else f"{text}."

    @property
    def field(self) -> dict[str, Any]:
        """Arguments of pydantic's ``Field``."""
        limits = {"ge": self.low, "le": self.high, "gt": self.above}
        return {
            "default": self.default,
            "description": self.help_text,
            **{name: limit for name, limit in limits.items() if limit is not None},
        }


OPTIONS = (
    Option(
        "controller",
        "name",
        "Law: {names}, or file.py:Class of your own",
        "tde_stc",
        folder="gains/paper/tuned",
    ),
    Option(
        "case", "name", "Friction, disturbance and payload: {names}, or a path", "1", folder="cases"
    ),
    Option(
        "disturbance",
        "name",
        "Your own disturbance, unknown to the law: a CSV or Parquet file with columns time, "
        "base_force_x..z, base_torque_x..z (base frame) and joints by name, SI units",
        "",
        default_text="none",
        metavar="FILE",
    ),
    Option(
        "sensors", "name", "Sensors: {names}, or a path to a YAML file", "ideal", folder="sensors"
    ),
    Option(
        "actuators",
        "name",
        "Actuators of the base: {names} (none: it floats freely), or a path to a YAML file",
        "ideal",
        folder="actuators",
    ),
    Option(
        "assumed_actuators",
        "name",
        "Actuators of the base as the flight software assumes them",
        default_text="as they are",
        folder="actuators",
    ),
    Option(
        "orbit",
        "name",
        "Orbit, with gravity gradient, drag, sunlight and magnetic field: {names}, or a path to a "
        "YAML file",
        "none",
        folder="orbits",
    ),
    Option(
        "gains",
        "name",
        "Gain set: printed, tuned, robust, default (printed where it flies), or a path",
        "default",
        folder="gains/paper",
        other_names=("default",),
    ),
    Option(
        "robot",
        "name",
        "Robot: {names}, or a path to its YAML, URDF or folder",
        "paper",
        folder="robots",
    ),
    Option(
        "plant_robot",
        "name",
        "Robot that flies, unknown to the laws and the mission",
        default_text="the same robot",
        folder="robots",
    ),
    Option(
        "mission",
        "name",
        "Mission by name or path",
        "",
        default_text="the robot's",
        folder="missions",
    ),
    Option(
        "duration", "number", "Seconds to fly", default_text="the mission's", above=0.0, high=1e6
    ),
    Option("period", "number", "Length of a tick of all nodes, s", default_text="0.0005"),
    Option(
        "substeps", "whole number", "Integration steps of the plant in a tick", default_text="1"
    ),
    Option(
        "compression",
        "text",
        "Compression of the bag",
        default_text="lz4",
        choices=("none", "lz4", "zstd"),
    ),
    Option(
        "split_size",
        "size",
        "Continue the bag in another file after this many bytes, as 500K, 100M, 2G",
        default_text="one file",
        metavar="SIZE",
    ),
    Option(
        "navigation",
        "text",
        "What the laws see: the measurements, or the navigation filter's estimates",
        default_text="direct",
        choices=("direct", "filtered"),
    ),
    Option(
        "command_latency_ticks", "whole number", "Ticks by which the plant applies commands late", 0
    ),
    Option("friction", "switch", "Joint friction of the case, or none", True),
    Option(
        "swaps",
        "texts",
        "Swap to LAW at T simulated seconds; may be repeated",
        flag="--swap",
        metavar="T:LAW",
    ),
    Option(
        "faults",
        "texts",
        "Inject a fault at T simulated seconds; may be repeated; --fault list lists all kinds",
        flag="--fault",
        metavar="KIND@T[-END][:ARG]",
    ),
    Option(
        "events",
        "texts",
        "Capture a target (of config/targets, or a path to its YAML) or release it at T "
        "simulated seconds; may be repeated",
        default_text="the mission's events",
        flag="--event",
        metavar="capture@T:TARGET|release@T[:SPEED]",
    ),
    Option("seed", "whole number", "Seed of the random numbers of faults and sensors", 0, low=0),
    Option(
        "controller_code",
        "text",
        "What answers as the controller: its kernels compiled here (python), the same as C, built "
        "by the system's compiler (c), or a flight computer at udp:HOST:PORT",
        "python",
        metavar="CODE",
    ),
    Option(
        "shadow",
        "text",
        "Let the C code answer, too, and end the flight with exit code 1 at the first number that "
        "differs",
        "none",
        choices=("none", "c"),
    ),
    Option(
        "realtime", "switch", "Pace by the wall clock instead of lockstep", False, needs_graph=True
    ),
    Option(
        "paused",
        "switch",
        "Begin paused: `space-robot sim` resumes the plant, or steps it",
        False,
        needs_graph=True,
    ),
    Option(
        "fifo_priority",
        "whole number",
        "Ask for SCHED_FIFO for plant and controller; for machines with cores to spare",
        0,
        low=0,
        high=98,
        needs_graph=True,
    ),
    Option(
        "namespace",
        "text",
        "ROS namespace of the nodes and their topics, as /sat1: one for each robot in a domain",
        "/",
        metavar="NS",
        needs_graph=True,
    ),
    Option(
        "composed",
        "switch",
        "Run all nodes in one process: faster, and no node can be killed or stopped alone",
        False,
        needs_graph=True,
        is_launched=False,
    ),
    Option(
        "without",
        "texts",
        "Do not start this node, controller or mission: the flight waits for one of your own; may "
        "be repeated",
        choices=("controller", "mission"),
        metavar="NODE",
        needs_graph=True,
    ),
    Option(
        "join_timeout",
        "number",
        "Longest wait for the nodes of --without, s of the wall clock (0: no limit)",
        60.0,
        low=0.0,
        high=1e6,
        needs_graph=True,
    ),
    Option(
        "restart_controller",
        "switch",
        "Restart a controller that died or hangs",
        False,
        needs_graph=True,
        is_launched=False,
    ),
    Option(
        "domain",
        "whole number",
        "ROS domain",
        default_text="ROS_DOMAIN_ID, or a free one",
        low=0,
        high=232,
        needs_graph=True,
        is_launched=False,
    ),
)


def option(name: str) -> Option:
    """Return the option with this name.

    Raises:
        KeyError: If there is none.
    """
    return {entry.name: entry for entry in OPTIONS}[name]


def names(needs_graph: bool | None = None) -> Iterator[str]:
    """Yield the names of options that (do not) need a graph, or of all."""
    yield from (o.name for o in OPTIONS if needs_graph in (None, o.needs_graph))
