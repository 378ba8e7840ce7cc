"""The options of a flight, each declared once as a field.

The command line, launch arguments, scenario files and the reference are made from these fields;
`space_robot.scenario.scenario.Scenario` has them and validates their values. Nothing heavy is
imported, not even Pydantic, so that ``--help`` is quick.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, Literal, get_args, get_origin, get_type_hints


@dataclass(frozen=True)
class Option:
    """A field of `Options`, and what a user reads and writes of it."""

    help: str
    """``{names}`` stands for the names of the files in `folder`."""
    default: Any
    default_text: str = ""
    """Text shown for a default of None or ""; empty: the default itself is shown."""
    low: float | None = None
    high: float | None = None
    above: float | None = None
    metavar: str = ""
    folder: str = ""
    """Folder of config/ with the files, or folders, that can be named."""
    node: str = ""
    """Node for which alone it is; without meaning where that node is another's."""
    sets: str = ""
    """Node, or "all", whose parameter of the same name it is where it differs from the default."""
    needs_graph: bool = False
    """True if the option applies only to a graph of nodes."""
    is_launched: bool = True
    """True if the option is also an argument of the launch file."""
    annotation: Any = Any
    """Of the field."""
    kind: Any = Any
    """Its type without None; of a list, that of its items."""
    is_list: bool = False
    choices: tuple[str, ...] = ()

    @cached_property
    def help_text(self) -> str:
        """Return the help with the names of the files and the default."""
        from space_robot_msgs_py.config.installation import config_directory

        text = self.help
        if "{names}" in text:
            files = sorted((config_directory() / self.folder).glob("*.yaml"))
            text = text.replace("{names}", ", ".join(file.stem for file in files))
        return f"{text} [default: {self.default_text}]." if self.default_text else f"{text}."

    def with_type(self, hint: Any) -> Option:
        """Return the option of a field with this annotation."""
        kinds = [kind for kind in get_args(hint) if kind is not type(None)]
        kind = hint if get_origin(hint) is Literal or not kinds else kinds[0]
        choices = get_args(kind) if get_origin(kind) is Literal else ()
        is_list = get_origin(hint) is list
        return replace(self, annotation=hint, kind=kind, is_list=is_list, choices=choices)


option: Any = Option  # a field has the type of its value, not this one
of_controller: Any = partial(Option, node="controller", sets="controller")
of_graph: Any = partial(Option, needs_graph=True)
of_command: Any = partial(of_graph, is_launched=False)
"""Of a graph that `fly` starts: the launch file has no such argument."""


class Options:
    """Fields of a scenario; one of type Any is a name, a path or an object."""

    controller: Any = option(
        "Law: {names}, or file.py:Class of your own",
        "tde_stc",
        folder="gains/paper/tuned",
        node="controller",
    )
    """Unless it is set, that of the gain set's ``controller.yaml``, if there is one."""
    case: Any = option("Friction, disturbance and payload: {names}, or a path", "1", folder="cases")
    disturbance: Any = option(
        "Your own disturbance, unknown to the law: a CSV or Parquet file with columns time, "
        "base_force_x..z, base_torque_x..z (base frame) and joints by name, SI units",
        "",
        default_text="none",
        metavar="FILE",
    )
    sensors: Any = option("Sensors: {names}, or a path to a YAML file", "ideal", folder="sensors")
    actuators: Any = option(
        "Actuators of the base: {names} (none: it floats freely), or a path to a YAML file",
        "ideal",
        folder="actuators",
    )
    assumed_actuators: Any = option(
        "Actuators of the base as the flight software assumes them",
        None,
        default_text="as they are",
        folder="actuators",
        node="controller",
    )
    orbit: Any = option(
        "Orbit, with gravity gradient, drag, sunlight and magnetic field: {names}, or a path to "
        "a YAML file",
        "none",
        folder="orbits",
    )
    gains: Any = option(
        "Gain set: printed, tuned, robust, default (printed where it flies), or a path",
        "default",
        folder="gains/paper",
        node="controller",
    )
    robot: Any = option(
        "Robot: {names}, or a path to its YAML, URDF or folder", "paper", folder="robots"
    )
    plant_robot: Any = option(
        "Robot that flies, unknown to the laws and the mission",
        None,
        default_text="the same robot",
        folder="robots",
    )
    mission: Any = option(
        "Mission by name or path", "", default_text="the robot's", folder="missions"
    )
    duration: float | None = option(
        "Seconds to fly", None, default_text="the mission's", above=0.0, high=1e6
    )
    period: float | None = option(
        "Length of a tick of all nodes, s", None, default_text="0.0005", sets="all"
    )
    substeps: int | None = option(
        "Integration steps of the plant in a tick", None, default_text="1", sets="plant"
    )
    compression: Literal["none", "lz4", "zstd"] | None = option(
        "Compression of the bag", None, default_text="lz4", sets="recorder"
    )
    split_size: str | int | None = option(
        "Continue the bag in another file after this many bytes, as 500K, 100M, 2G",
        None,
        default_text="one file",
        metavar="SIZE",
        sets="recorder",
    )
    navigation: Literal["direct", "filtered"] | None = of_controller(
        "What the laws see: the measurements, or the navigation filter's estimates",
        None,
        default_text="direct",
    )
    command_latency_ticks: int = option("Ticks by which the plant applies commands late", 0)
    friction: bool = option("Joint friction of the case, or none", True)
    swaps: list[str] = option(
        "Swap to LAW at T simulated seconds; may be repeated",
        [],
        metavar="T:LAW",
        node="controller",
    )
    faults: list[str] = option(
        "Inject a fault at T simulated seconds; may be repeated; --fault list lists all kinds",
        [],
        metavar="KIND@T[-END][:ARG]",
    )
    events: list[str] = option(
        "Capture a target (of config/targets, or a path to its YAML) or release it at T "
        "simulated seconds; may be repeated",
        [],
        default_text="the mission's events",
        metavar="capture@T:TARGET|release@T[:SPEED]",
        sets="plant",
    )
    seed: int = option("Seed of the random numbers of faults and sensors", 0, low=0)
    controller_code: str = of_controller(
        "What answers as the controller: its kernels compiled here (python), the same as C, "
        "built by the system's compiler (c), or a flight computer at udp:HOST:PORT",
        "python",
        metavar="CODE",
    )
    shadow: Literal["none", "c"] = of_controller(
        "Let the C code answer, too, and end the flight with exit code 1 at the first number "
        "that differs",
        "none",
    )
    telemetry: str = of_controller(
        "Send telemetry as CCSDS packets to udp:HOST:PORT, or write them to a file",
        "",
        default_text="none",
        metavar="DESTINATION",
    )
    telemetry_packets: str = of_controller(
        "Packets of the telemetry: {names}, or a path to a YAML file",
        "housekeeping",
        folder="telemetry",
    )
    telecommands: str = of_command(
        "Take telecommands, CCSDS packets, at udp:127.0.0.1:PORT",
        "",
        default_text="none",
        metavar="ADDRESS",
    )
    realtime: bool = of_graph("Pace by the wall clock instead of lockstep", False)
    paused: bool = of_graph(
        "Begin paused: `space-robot sim` resumes the plant, or steps it", False, sets="plant"
    )
    fifo_priority: int = of_graph(
        "Ask for SCHED_FIFO for plant and controller; for machines with cores to spare",
        0,
        low=0,
        high=98,
    )
    namespace: str = of_graph(
        "ROS namespace of the nodes and their topics, as /sat1: one for each robot in a domain",
        "/",
        metavar="NS",
    )
    composed: bool = of_command(
        "Run all nodes in one process: faster, and no node can be killed or stopped alone", False
    )
    without: list[Literal["controller", "mission"]] = of_graph(
        "Do not start this node, controller or mission: the flight waits for one of your own; "
        "may be repeated",
        [],
        metavar="NODE",
    )
    join_timeout: float = of_graph(
        "Longest wait for the nodes of --without, s of the wall clock (0: no limit)",
        60.0,
        low=0.0,
        high=1e6,
    )
    restart_controller: bool = of_command(
        "Restart a controller that died or hangs", False, node="controller"
    )
    domain: int | None = of_command(
        "ROS domain", None, default_text="ROS_DOMAIN_ID, or a free one", low=0, high=232
    )
    parameters: dict[str, dict[str, Any]] = {}  # noqa: RUF012 - Pydantic copies it
    """Further parameters by node, dotted names."""


OPTIONS: dict[str, Option] = {}
"""The options of a command line by name: all fields but `parameters`."""


def _read_fields() -> None:
    for name, hint in get_type_hints(Options).items():
        Options.__annotations__[name] = hint
        if isinstance(option := vars(Options)[name], Option):
            OPTIONS[name] = option.with_type(hint)
            setattr(Options, name, option.default)


_read_fields()
