"""Names, types and quality of service of every topic of the graph.

Names are relative: rclpy puts them into the node's namespace and applies its remappings.
"""

from __future__ import annotations

from typing import NamedTuple

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
    """Its messages are those of this topic as plain bytes (`wire.carrier`), for the recorder: where
    the type of those is not installed nobody could send them. A bag has them as this topic's."""

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


JOINT_STATES = Topic(
    "joint_states",
    "sensor_msgs/msg/JointState",
    10_000,
    per_tick=True,
    of="all_joints",
    is_controlling=True,
)
BASE_STATE = Topic(
    "base/state",
    "sensor_msgs/msg/MultiDOFJointState",
    10_000,
    per_tick=True,
    frame=INERTIAL_FRAME,
    of="body",
    is_controlling=True,
)
# What the base's actuators tell of themselves; sent where there are any.
WHEELS_STATE = Topic(
    "wheels/state",
    "sensor_msgs/msg/JointState",
    10_000,
    per_tick=True,
    is_optional=True,
    frame=BASE_FRAME,
    of="wheels",
    is_controlling=True,
)
THRUSTERS_STATE = Topic(
    "thrusters/state",
    "sensor_msgs/msg/JointState",
    10_000,
    per_tick=True,
    is_optional=True,
    frame=BASE_FRAME,
    of="thrusters",
)
# Motors of joints with gears, seen through them; sent where a robot has any.
MOTORS_STATE = Topic(
    "motors/state",
    "sensor_msgs/msg/JointState",
    10_000,
    per_tick=True,
    is_optional=True,
    of="geared",
)
# The magnetic field; sent where the base has magnetic torquers, whose controller needs it.
MAGNETOMETER = Topic(
    "magnetometer",
    "sensor_msgs/msg/MagneticField",
    10_000,
    per_tick=True,
    is_optional=True,
    frame=BASE_FRAME,
    of="torquers",
    is_controlling=True,
)
COMMAND = Topic(
    "command", "sensor_msgs/msg/JointState", 10_000, per_tick=True, frame=BASE_FRAME, of="commanded"
)
# Reference and clock are not transient local: a late joiner would receive the past, and that a
# message was lost if one is pushed out meanwhile; at depth 1 a slow one would lose some. The
# mission says again what is still needed when somebody joins, a plant that waits its time.
REFERENCE_JOINTS = Topic(
    "reference/joints", "trajectory_msgs/msg/JointTrajectory", 200, of="joints"
)
REFERENCE_BASE = Topic(
    "reference/base",
    "trajectory_msgs/msg/MultiDOFJointTrajectory",
    200,
    frame=INERTIAL_FRAME,
    of="body",
)
TELEMETRY = Topic(
    "controller/telemetry", "std_msgs/msg/Float64MultiArray", 1_000, has_stamp=False, of="axes"
)
# The telemetry once more, by name: what viewers plot; nobody here reads it.
SIGNALS = Topic(
    "controller/signals",
    "sensor_msgs/msg/JointState",
    1_000,
    is_optional=True,
    frame=BASE_FRAME,
    of="axes",
)
LAW = Topic(
    "controller/law", "rcl_interfaces/msg/ParameterEvent", 100, transient_local=True, is_event=True
)
CLOCK = Topic("clock", "rosgraph_msgs/msg/Clock", 1_000)
# The truth is sent where what the sensors tell may differ from it; no flight software listens.
TRUTH_JOINTS = Topic(
    "truth/joints", "trajectory_msgs/msg/JointTrajectory", 1_000, is_optional=True, of="all_axes"
)
TRUTH_BASE = Topic(
    "truth/base",
    "trajectory_msgs/msg/MultiDOFJointTrajectory",
    1_000,
    is_optional=True,
    frame=INERTIAL_FRAME,
    of="body",
)
TRUTH_ORBIT = Topic(
    "truth/orbit",
    "trajectory_msgs/msg/JointTrajectory",
    1_000,
    is_optional=True,
    frame=INERTIAL_FRAME,
)

# What viewers need of the robot. ROS has one /tf for all robots: their frames bear the namespace.
TF = Topic("/tf", "tf2_msgs/msg/TFMessage", 100, stamp_at=4)
TF_STATIC = Topic("/tf_static", TF.type, 1, transient_local=True, has_stamp=False)
CARRIER = "std_msgs/msg/UInt8MultiArray"
# Hidden, as names with an underscore are in ROS: nobody but the recorder can read them.
TRANSFORMS = Topic("_transforms", CARRIER, 1_000, is_optional=True, carries=TF)
TRANSFORMS_STATIC = Topic(
    "_transforms/static",
    CARRIER,
    1,
    transient_local=True,
    is_event=True,
    is_optional=True,
    carries=TF_STATIC,
)
ROBOT_DESCRIPTION = Topic(
    "robot_description",
    "std_msgs/msg/String",
    1,
    transient_local=True,
    is_event=True,
    has_stamp=False,
    is_optional=True,
)

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
    *(part for part in STATES if part.is_optional),
    TRUTH_ORBIT,
)
"""All that tell of a flight: who reads a bag reads these."""
SCENE = (TRANSFORMS, TRANSFORMS_STATIC, ROBOT_DESCRIPTION)
"""What viewers show of it; nobody here reads them again."""
RECORDED = (*ALL, SIGNALS, *SCENE)
"""All that the recorder listens to."""
TRUTH = (TRUTH_JOINTS, TRUTH_BASE)
BY_NAME = {topic.full_name: topic for topic in ALL}
"""By their full names in the root namespace."""
# Shapes in the inertial frame, for viewers, while one listens; bags have transforms instead.
MARKERS = Topic("markers", "visualization_msgs/msg/MarkerArray", 10, is_optional=True)
# The base once more, in standard messages of one frame each, for others' nodes: while one listens.
ODOMETRY = Topic("base/odometry", "nav_msgs/msg/Odometry", 100, is_optional=True)
IMU = Topic("base/imu", "sensor_msgs/msg/Imu", 100, is_optional=True)
WRENCH = Topic("base/wrench", "geometry_msgs/msg/WrenchStamped", 100, is_optional=True)
STANDARD = (ODOMETRY, IMU, WRENCH)
JOINT_TRAJECTORY = Topic(
    "joint_trajectory", "trajectory_msgs/msg/JointTrajectory", 10, is_event=True
)
"""Trajectories that others, as MoveIt, ask the mission to follow; the reference tells what came of
it."""
# One for all robots of a domain, as ROS has it: each status tells its node's name.
DIAGNOSTICS = Topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", 100)
SIMULATION_PAUSED = Topic(
    "simulation/paused",
    "std_msgs/msg/Bool",
    1,
    transient_local=True,
    is_event=True,
    has_stamp=False,
)
"""True while the plant is held: not recorded, for a bag tells nothing of the wall clock's time."""
PLANT_DESCRIPTION = Topic(
    "_plant_description",
    "std_msgs/msg/String",
    1,
    transient_local=True,
    is_event=True,
    has_stamp=False,
)
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
"""What the recorder leaves out and `ros2 bag record` hears."""
