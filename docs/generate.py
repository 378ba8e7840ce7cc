"""Writes docs/reference from the code: parameters, faults, topics, metrics; and QoS overrides.

    python docs/generate.py

`tests/test_reference.py` sees that the pages are up to date.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import GenericAlias
from typing import Annotated, Any, get_args, get_origin

from space_robot.analysis.series import GROUPS, STATISTICS, SeriesGroup
from space_robot.scenario.faults import PROCESS_KINDS
from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.guidance.mission import MissionNodeSettings
from space_robot_control.laws import laws
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.recorder import RecorderNodeSettings
from space_robot_msgs_py.config.files import flatten
from space_robot_msgs_py.config.settings import NodeSettings, leaves
from space_robot_msgs_py.samples import CommandSignals, Reference, State, TelemetrySignals
from space_robot_msgs_py.signals import carried_by
from space_robot_sim.faults.grammar import Kind
from space_robot_sim.plant.settings import MOST_TICKS, PLANT_KINDS, PlantNodeSettings

REFERENCE = Path(__file__).parent / "reference"
OVERRIDES = REFERENCE.parents[1] / "config/qos/record_overrides.yaml"
MADE = "Made by `python docs/generate.py`: change the code, not this page."
NODES: dict[str, type[NodeSettings]] = {
    "plant": PlantNodeSettings,
    "controller": ControllerNodeSettings,
    "mission": MissionNodeSettings,
    "recorder": RecorderNodeSettings,
}
ROS_TYPES = {bool: "bool", int: "integer", float: "double", str: "string"}
EXAMPLES = {
    "P": "0.1",
    "TICKS": "2",
    "SIGMA": "1e-5",
    "STEP": "1e-5",
    "TORQUE": "0.5",
    "JOINT": "3",
    "BASE_AXIS=RATE": "base_x=1e-5",
    "BASE_AXIS=FIELD": "base_x=1e-6",
    "JOINT=TORQUE": "3=20",
    "SECONDS": "1.5",
    "AXIS=FACTOR": "all=0.99",
    "AXIS=TORQUE": "base_x=0.01",
}
"""An argument as it may be given, by its form; of others it follows from what is allowed."""
NAMED = {"AXIS": "base_x", "BASE_AXIS": "base_x", "JOINT": "3", "WHEEL": "2", "THRUSTER": "3"}

FIELDS = {
    "/joint_states": "`name`: n actuated joints, then passive ones, whose `effort` is 0",
    "/base/state": "`joint_names` = `[base]`; rotations are sent as x, y, z, w",
    "/command": "`name` = `base_x`, `base_y`, `base_z`, the joints, then wheels, thrusters and "
    "magnetic torquers of the base",
    "/reference/joints": "100 `points`, point i is i ticks after the stamp",
    "/reference/base": "as many `points`, of `joint_names` = `[base]`",
    "/controller/telemetry": "`data`: the tick, then four rows of n + 3, axes as in `/command`, in"
    " rho-space: sliding variable s (rad/s), pseudo-acceleration u (rad/s²), time-delay estimate "
    "N̂ (N m), error e (rad)",
    "/controller/signals": "telemetry for plots, axes as in `/command`",
    "/controller/law": "`stamp`: of the first tick answered by this law and these gains; "
    "parameters `controller` and `<law>.<gain>`, n + 3 values each in rho-space, units as in "
    "[control laws](../manual/control_laws.md): `new_parameters` when a controller starts, "
    "`changed_parameters` later",
    "/clock": "`clock`: simulated time",
    "/truth/joints": "true motion, 20 `points`, one tick apart, the first at the stamp; axes as in"
    " `/command`, of the quaternion its vector part",
    "/truth/base": "the same for the base, rotations as in `/base/state`",
    "/wheels/state": "`name`: the wheels",
    "/thrusters/state": "`name`: the thrusters",
    "/motors/state": "`name`: joints with gears",
    "/truth/orbit": "a point per tick; `joint_names` names the numbers",
    "/tf": "true poses, `inertial` → `base_link` → each body relative to its parent: `translation`"
    " (m), `rotation` from `child_frame_id` to `header.frame_id`",
    "/tf_static": "the same for the tools, which are fixed to their bodies",
    "/robot_description": "a URDF of the robot; its links are the frames of `/tf`",
    "/base/odometry": "measured; `pose` of `base_link` in `inertial` (m), `twist` on axes of "
    "`base_link` (m/s, rad/s); covariances 0: not known",
    "/base/imu": "measured, in `base_link`: `orientation` relative to `inertial`, "
    "`angular_velocity` (rad/s); no acceleration (`linear_acceleration_covariance[0]` = -1)",
    "/base/wrench": "on `base_link`, about its origin, as *applied* over the tick that just ended: "
    "`force` of the thrusters (N), `torque` (N m)",
}
"""What the messages of a topic are, beside the fields with signals."""


def pages() -> dict[str, str]:
    """The text of each page by the name of its file."""
    return {
        "parameters.md": parameters(),
        "faults.md": faults(),
        "topics.md": topic_page(),
        "metrics.md": metrics(),
    }


def table(head: Sequence[str], rows: Iterator[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def parameters() -> str:
    """All parameters of all nodes."""
    shared = dict(leaves(NodeSettings))
    defaults = dict(flatten(PlantNodeSettings.resolve({}).model_dump()))
    parts = [
        "# Parameters",
        MADE,
        "Defaults are those of a flight without options: the schema, `config/space_robot.yaml`,"
        " the mission `paper`, case 1. A list `double[]` over axes (base x, y, z, joints), wheels, "
        "thrusters or torquers may have one value for all. For how to set parameters see "
        "[configuration](../manual/configuration.md).",
        "## All nodes",
        table(HEAD, iter([*_rows(shared, defaults), AUTOSTART])),
    ]
    for node, schema in NODES.items():
        own = {name: field for name, field in leaves(schema) if name not in shared}
        defaults = dict(flatten(schema.resolve({}).model_dump()))
        rows = [*_rows(own, defaults), *([STEP_TICKS] if node == "plant" else [])]
        parts += [f"## {node}_node", table(HEAD, iter(rows))]
        if node == "controller":
            parts += [
                "Each gain `<law>.<gain>` is a list, with one value per axis or one for all axes; "
                "its default is in the gain set; an optional one is 0 where the set lacks it. Like "
                "`controller`, gains can be changed in flight. A search of gains looks in the "
                "range given, of the gain or (x J) of the gain divided by the inertia of its "
                "axis.",
                table(("parameter", "search", "description"), _gains()),
            ]
    return "\n\n".join(parts) + "\n"


HEAD = ("parameter", "type", "default", "range", "description")
ONE_EACH = re.compile(r"; one value for all .*")
"""What is said once, at the top of the page."""
AUTOSTART = (
    "`autostart`",
    "bool",
    "true",
    "",
    "configure and activate at startup; false: wait for transitions",
)
STEP_TICKS = (
    "`step_ticks`",
    "integer",
    "1",
    f"[1, {MOST_TICKS:g}]",
    "ticks per step of a paused plant (service ~/step); can be changed in flight",
)


def _rows(fields: Mapping[str, Any], defaults: Mapping[str, Any]) -> Iterator[Sequence[str]]:
    for name, field in fields.items():
        default = defaults[name]
        yield (
            f"`{name}`",
            _ros_type(field.annotation),
            _text(default),
            _range(field),
            ONE_EACH.sub("", field.description or "").replace("|", "\\|"),
        )


def _ros_type(annotation: Any) -> str:
    if get_origin(annotation) is list or isinstance(annotation, GenericAlias):
        return f"{_ros_type(get_args(annotation)[0])}[]"
    if get_origin(annotation) is Annotated:
        return _ros_type(get_args(annotation)[0])
    return ROS_TYPES.get(annotation, "string")


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if value == [""]:
        return ""
    if isinstance(value, list):
        return f"[{', '.join(_text(item) for item in value)}]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _range(field: Any) -> str:
    bounds = {
        name: getattr(item, name)
        for item in field.metadata
        for name in ("ge", "gt", "le", "lt")
        if hasattr(item, name)
    }
    if not bounds:
        return ""
    low = f"[{bounds['ge']:g}" if "ge" in bounds else f"({bounds.get('gt', -math.inf):g}"
    high = f"{bounds['le']:g}]" if "le" in bounds else f"{bounds.get('lt', math.inf):g})"
    return f"{low}, {high}".replace("e+0", "e").replace("inf", "∞")


def _gains() -> Iterator[Sequence[str]]:
    for name, law in laws().items():
        ranges = law.gain_ranges()
        for gain, description in law.gain_descriptions().items():
            span, optional = ranges[gain], " (optional)" if gain in law.optional_gains() else ""
            looks = f"{span.lower:g} to {span.upper:g}{' x J' if span.per_inertia else ''}"
            looks += "" if span.scale == "log" else ", linear"
            yield f"`{name}.{gain}`", looks, description.replace("|", "\\|") + optional


def faults() -> str:
    """All kinds of faults."""
    parts = [
        "# Kinds of faults",
        MADE,
        "`KIND@T[-END][:ARGUMENT]`, times in simulated seconds;"
        " their use is described in [faults](../manual/faults.md).",
    ]
    for title, kinds in (
        ("Faults of the plant", PLANT_KINDS),
        ("Faults of processes", PROCESS_KINDS),
    ):
        head = ("fault", "unit", "default", "effect", "example")
        parts += [f"## {title}", table(head, map(_kind, kinds.values()))]
    return "\n\n".join(parts) + "\n"


def _kind(kind: Kind) -> Sequence[str]:
    example = f"{kind.name}@2-3" if kind.lasts else f"{kind.name}@2"
    default = ""
    if kind.argument:
        about = [NAMED[kind.argument.about.name]] if kind.argument.about else []
        number = [f"{kind.argument.high / 100.0:g}"] if kind.argument.symbol else []
        example += f":{EXAMPLES.get(kind.argument.form, '='.join([*about, *number]))}"
    if kind.default is not None:
        default = "for ever" if math.isinf(kind.default) else f"{kind.default:g}"
    unit = kind.argument.unit if kind.argument else ""
    return f"`{kind.form}`", unit, default, kind.description, f"`{example}`"


def topic_page() -> str:
    """All topics of the graph."""
    rows = (
        (
            f"`{topic.full_name}`",
            _type(topic),
            str(topic.depth),
            "transient local" if topic.transient_local else "volatile",
            _occasion(topic),
        )
        for topic in (
            *topics.RECORDED,
            *topics.STANDARD,
            topics.MARKERS,
            topics.DIAGNOSTICS,
            topics.SIMULATION_PAUSED,
            topics.PLANT_DESCRIPTION,
        )
    )
    fields = (
        (f"`{topic.full_name}`", _fields(topic))
        for topic in (t.recorded for t in (*topics.RECORDED, *topics.STANDARD))
    )
    return (
        "\n\n".join(
            [
                "# Topics",
                MADE,
                "All topics are reliable and keep the last messages (history). Every topic but the"
                " last seven is recorded; the plant's description is stored in the bag. These are "
                "the names without a namespace. In a namespace, for instance `/sat1`, all topics"
                " but `/diagnostics` begin with it (`/sat1/joint_states`), and so do the frames in"
                " `/tf` and of `/base/odometry`, `/base/imu` and `/base/wrench` except `inertial`."
                " If tf2_msgs is installed, the plant also publishes"
                " `/tf` and `/tf_static` themselves.",
                table(("topic", "type", "history", "durability", "published"), rows),
                "## Subscribers",
                "rclpy's usual queue of 10 messages is 5 ms of a topic with a message each tick: a"
                " node that is held up for longer loses some (of 10,000 messages 6,242 and 5,022"
                " came in two trials, with the history of the table all)."
                " Subscribe with the history of the table where each message counts, as recorders"
                " do (`config/qos/record_overrides.yaml`), and publish `/command` with it; for"
                " displays take `/base/odometry`, `/base/imu` or `/tf`, which have 100 Hz.",
                "## Fields",
                "A tick is 0.5 ms by default, so a topic with a message each tick has 2 kHz; the "
                "reference has 20 Hz, telemetry and clock have 100 Hz. `n` is the number of "
                "actuated joints. Fields that are not listed are empty. For [prismatic joints]"
                "(../manual/passive_joints.md) read rad as m, and N m as N. In rho-space the first"
                " three axes are the vector part of the base's quaternion: read rad as 1 there. "
                "The reference is sent up to 0.5 s ahead of the flight.",
                table(("topic", "fields (unit; frame)"), fields),
            ]
        )
        + "\n"
    )


def _fields(topic: topics.Topic) -> str:
    """What a topic's messages are, and each field with its signals."""
    said: dict[str, list[str]] = {}
    for _, signal, field in carried_by(topic, State, Reference, CommandSignals, TelemetrySignals):
        about = "; ".join(filter(None, (signal.unit, signal.frame)))
        text = f"{signal.text} ({about})" if about else signal.text
        said.setdefault(field.path, []).append(text)
    parts = [f"`{path}`: {', '.join(texts)}" for path, texts in said.items()]
    return "; ".join([*filter(None, [FIELDS.get(topic.full_name, "")]), *parts])


def _type(topic: topics.Topic) -> str:
    return f"{topic.type}, in bags `{topic.carries.name}`" if topic.carries else topic.type


def _occasion(topic: topics.Topic) -> str:
    if topic in (*topics.SCENE, topics.PLANT_DESCRIPTION) and topic.is_latched:
        return "once"
    if topic is topics.MARKERS:
        return "at most every 33 ms, while there is a subscriber"
    if topic in topics.STANDARD:
        return "at 100 Hz (`base_topics_rate`), while there is a subscriber"
    if topic.carries:
        return "every 10 ms, or every tick if the period is longer"
    if topic is topics.SIGNALS:
        return "as /controller/telemetry"
    if topic is topics.MOTORS_STATE:
        return "each tick, if joints have gears"
    if topic is topics.MAGNETOMETER:
        return "each tick, if the base has magnetic torquers"
    if topic is topics.TRUTH_ORBIT:
        return "every 20 ticks, if the robot is in an orbit"
    if topic.per_tick and topic.is_optional:
        return "each tick, if the base has them"
    if topic.is_optional:
        return "every 20 ticks, if sensors or actuators have errors"
    return "each tick" if topic.per_tick else "at an event" if topic.is_event else "periodically"


def metrics() -> str:
    """Metrics by name: a table for each group of them in reports."""
    groups: dict[str, list[Sequence[str]]] = {}
    for group in GROUPS.values():
        rows = groups.setdefault(group.title, [])
        of_series = group.quantities if isinstance(group, SeriesGroup) else {}
        for column, q in of_series.items():
            first, *others = q.statistics
            names = [f"`{column}.{first}`", *(f"`.{statistic}`" for statistic in others)]
            rows.append((", ".join(names), q.unit, q.text))
        further = group.derived if isinstance(group, SeriesGroup) else group.quantities
        rows += [(f"`{name}`", q.unit, q.text) for name, q in further.items()]
    statistics = "\n".join(f"- `{name}`: {text}" for name, text in STATISTICS.items())
    text = f"""# Metrics

{MADE}

Names of metrics in tables and JSON of `space-robot analyze`, in `flight.metrics`, and in `require`
and the tables of campaigns ([explained](../manual/analysis.md#what-each-metric-means)). `*` stands
for columns, sources and joints, `{{joint}}`, `{{wheel}}`, ... for each that the robot has, and
`{{unit}}` for the unit of the column. Statistics of series over a flight:

{statistics}
"""
    for title, rows in groups.items():
        head = ("metric", "unit", "meaning")
        text += f"\n## {title.capitalize()}\n\n{table(head, iter(rows))}\n"
    return text


def overrides() -> str:
    """The quality of service with which `ros2 bag record` is to listen: the topics' own."""
    lines = [
        "# Made by `python docs/generate.py`, for `ros2 bag record --qos-profile-overrides-path`:",
        "# by default it listens with a queue of ten messages, and loses a fifth to a half of a",
        "# topic at 2 kHz.",
    ]
    for topic in (*topics.RECORDED, *topics.FOR_OTHERS):
        durability = "transient_local" if topic.transient_local else "volatile"
        lines += [
            f"{topic.full_name}:",
            "  history: keep_last",
            f"  depth: {topic.depth}",
            "  reliability: reliable",
            f"  durability: {durability}",
        ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write all pages, and the overrides."""
    REFERENCE.mkdir(exist_ok=True)
    for name, text in pages().items():
        (REFERENCE / name).write_text(text, "utf-8")
    OVERRIDES.write_text(overrides(), "utf-8")


if __name__ == "__main__":
    main()
