"""Names, types and quality of service of every topic of the graph.

Names are relative: rclpy puts them into the node's namespace and applies its remappings.
"""

from __future__ import annotations

from typing import Any, NamedTuple

ROOT = "/"
"""The namespace of nodes that are given none."""
INERTIAL_FRAME = "inertial"
BASE_FRAME = "base_link"
"""Frame of the base, as REP 105 has it."""
BASE_JOINT = "base"
"""Name of the base's six degrees of freedom in messages that have one a joint."""
BASE_AXES = ("base_x", "base_y", "base_z")
"""Names of the base's torques in /command."""


class Topic(NamedTuple):
    """One topic of the graph. What its messages say stands with the signals in `samples`."""

    name: str
    """Relative, as nodes give it to rclpy."""
    type: str
    depth: int
    """History kept, in messages. Shallow queues lose data at 2 kHz (keep seconds of traffic)."""
    per_tick: bool = False
    """One message a tick, so a gap in its stamps is a loss."""
    transient_local: bool = False
    """Late joiners get the last ``depth`` messages."""
    is_event: bool = False
    """A message whenever something happens, so a gap in its stamps is no loss."""
    has_stamp: bool = True
    """Its messages begin with a stamp; of others the first number is the tick, unless they hold for
    the whole flight (`is_latched`)."""
    is_optional: bool = False
    """Sent in some flights only, so that silence is no loss."""
    frame: str = ""
    """``frame_id`` of its messages."""
    of: str = ""
    """Attribute of `RobotNames`: its messages name these; an optional one is sent if there are any.
    """
    is_controlling: bool = False
    """The controller waits for it, as a part of a state."""
    stamp_at: int = 0
    """Bytes of a message before its stamp."""
    carries: Topic | None = None
    """Its messages are those of this topic as plain bytes (`wire.viewers.wrap`), for the recorder:
    where the type of those is not installed nobody could send them. A bag has them as this topic's.
    """

    @property
    def full_name(self) -> str:
        """Return its name in the root namespace: in words, counts and reports, wherever it is."""
        return self.in_namespace(ROOT)

    @property
    def is_latched(self) -> bool:
        """True if its last message holds for the whole flight."""
        return self.transient_local and self.depth == 1

    @property
    def recorded(self) -> Topic:
        """The topic that a bag has its messages under, but for the namespace."""
        return self.carries or self

    def in_namespace(self, namespace: str) -> str:
        """Return its full name in a namespace (``/``, ``/sat1``), without remappings."""
        if self.name.startswith("/"):
            return self.name
        return f"/{self.name}" if namespace == ROOT else f"{namespace}/{self.name}"


_JOINTS, _BODY = "sensor_msgs/msg/JointState", "sensor_msgs/msg/MultiDOFJointState"
_JOINT_POINTS = "trajectory_msgs/msg/JointTrajectory"
_BODY_POINTS = "trajectory_msgs/msg/MultiDOFJointTrajectory"
_CARRIER = "std_msgs/msg/UInt8MultiArray"
_LATCHED = Topic("", "std_msgs/msg/String", 1, transient_local=True, is_event=True, has_stamp=False)


def _state(name: str, kind: str, of: str, frame: str = "", **flags: Any) -> Topic:
    return Topic(name, kind, 10_000, per_tick=True, frame=frame, of=of, **flags)


JOINT_STATES = _state("joint_states", _JOINTS, "all_joints", is_controlling=True)
BASE_STATE = _state("base/state", _BODY, "body", INERTIAL_FRAME, is_controlling=True)
# Measurements of the base's actuators; sent if there are any.
WHEELS_STATE = _state(
    "wheels/state", _JOINTS, "wheels", BASE_FRAME, is_optional=True, is_controlling=True
)
THRUSTERS_STATE = _state("thrusters/state", _JOINTS, "thrusters", BASE_FRAME, is_optional=True)
# Motors of joints with gears, seen through them; sent where a robot has any.
MOTORS_STATE = _state("motors/state", _JOINTS, "geared", is_optional=True)
# The magnetic field; sent where the base has magnetic torquers, whose controller needs it.
MAGNETOMETER = _state(
    "magnetometer",
    "sensor_msgs/msg/MagneticField",
    "torquers",
    BASE_FRAME,
    is_optional=True,
    is_controlling=True,
)
COMMAND = _state("command", _JOINTS, "commanded", BASE_FRAME)
# Reference and clock are not transient local: a late joiner would receive old messages, and a
# report of lost ones if the queue overflows meanwhile; at depth 1 a slow one would lose some. The
# mission repeats what is still needed when a subscriber joins, a waiting plant its time.
REFERENCE_JOINTS = Topic("reference/joints", _JOINT_POINTS, 200, of="joints")
REFERENCE_BASE = Topic("reference/base", _BODY_POINTS, 200, frame=INERTIAL_FRAME, of="body")
TELEMETRY = Topic(
    "controller/telemetry", "std_msgs/msg/Float64MultiArray", 1_000, has_stamp=False, of="axes"
)
# Telemetry by names of axes, for plotting tools; no node here subscribes.
SIGNALS = Topic("controller/signals", _JOINTS, 1_000, is_optional=True, frame=BASE_FRAME, of="axes")
LAW = Topic(
    "controller/law", "rcl_interfaces/msg/ParameterEvent", 100, transient_local=True, is_event=True
)
CLOCK = Topic("clock", "rosgraph_msgs/msg/Clock", 1_000)
# True states are sent if sensors or actuators have errors; no flight software subscribes.
TRUTH_JOINTS = Topic("truth/joints", _JOINT_POINTS, 1_000, is_optional=True, of="all_axes")
TRUTH_BASE = Topic(
    "truth/base", _BODY_POINTS, 1_000, is_optional=True, frame=INERTIAL_FRAME, of="body"
)
TRUTH_ORBIT = Topic("truth/orbit", _JOINT_POINTS, 1_000, is_optional=True, frame=INERTIAL_FRAME)

# What viewers need of the robot. ROS has one /tf for all robots: their frames bear the namespace.
TF = Topic("/tf", "tf2_msgs/msg/TFMessage", 100, stamp_at=4)
TF_STATIC = Topic("/tf_static", TF.type, 1, transient_local=True, has_stamp=False)
# Hidden, as names with an underscore are in ROS: nobody but the recorder can read them.
TRANSFORMS = Topic("_transforms", _CARRIER, 1_000, is_optional=True, carries=TF)
TRANSFORMS_STATIC = Topic(
    "_transforms/static",
    _CARRIER,
    1,
    transient_local=True,
    is_event=True,
    is_optional=True,
    carries=TF_STATIC,
)
ROBOT_DESCRIPTION = _LATCHED._replace(name="robot_description", is_optional=True)

STATES = (JOINT_STATES, WHEELS_STATE, BASE_STATE, THRUSTERS_STATE, MOTORS_STATE, MAGNETOMETER)
"""The parts of a state, in the order of sending."""
ALL = (
    JOINT_STATES,
    BASE_STATE,
    COMMAND,
    REFERENCE_JOINTS,
    REFERENCE_BASE,
    TELEMETRY,
    LAW,
    CLOCK,
    TRUTH_JOINTS,
    TRUTH_BASE,
    *(part for part in STATES if part not in (JOINT_STATES, BASE_STATE)),
    TRUTH_ORBIT,
)
"""Topics that a flight log is made from."""
SCENE = (TRANSFORMS, TRANSFORMS_STATIC, ROBOT_DESCRIPTION)
"""Topics for viewers only; they are not read from bags."""
RECORDED = (*ALL, SIGNALS, *SCENE)
"""Topics that the recorder subscribes to."""
TRUTH = (TRUTH_JOINTS, TRUTH_BASE)
BY_NAME = {topic.full_name: topic for topic in ALL}
"""By their full names in the root namespace."""
# Shapes in the inertial frame, for viewers, while one listens; bags have transforms instead.
MARKERS = Topic("markers", "visualization_msgs/msg/MarkerArray", 10, is_optional=True)
# The base in standard messages of one frame each, for other nodes; sent while one subscribes.
ODOMETRY = Topic("base/odometry", "nav_msgs/msg/Odometry", 100, is_optional=True)
IMU = Topic("base/imu", "sensor_msgs/msg/Imu", 100, is_optional=True)
WRENCH = Topic("base/wrench", "geometry_msgs/msg/WrenchStamped", 100, is_optional=True)
STANDARD = (ODOMETRY, IMU, WRENCH)
JOINT_TRAJECTORY = Topic("joint_trajectory", _JOINT_POINTS, 10, is_event=True)
"""Trajectories that other nodes, such as MoveIt, send to the mission."""
# One topic for all robots of a domain, as usual in ROS: each status has its node's name.
DIAGNOSTICS = Topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", 100)
SIMULATION_PAUSED = _LATCHED._replace(name="simulation/paused", type="std_msgs/msg/Bool")
"""True while the simulation is paused; not recorded, since bags are in simulated time."""
PLANT_DESCRIPTION = _LATCHED._replace(name="_plant_description")
"""Description of the plant as JSON, which the recorder stores in the bag."""
ROSOUT = Topic("/rosout", "rcl_interfaces/msg/Log", 1_000, transient_local=True)
"""The log of all nodes of a domain, with the depth that ROS's own publishers have."""
FOR_OTHERS = (
    TF,
    TF_STATIC,
    MARKERS,
    *STANDARD,
    JOINT_TRAJECTORY,
    DIAGNOSTICS,
    SIMULATION_PAUSED,
    ROSOUT,
)
"""Topics that `ros2 bag record` records and our recorder does not."""
