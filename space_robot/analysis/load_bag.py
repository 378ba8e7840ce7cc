"""Reading a recorded flight."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from space_robot_msgs_py.bag.flight_log import FlightLog


def load_bag(
    path: str | Path, remap: Mapping[str, str] | None = None, namespace: str | None = None
) -> FlightLog:
    """Read a recorded flight as NumPy arrays, one row a tick.

    Some of its fields, for N ticks and n joints:

    - ``time`` (N,) s, simulated
    - ``quaternion`` (N, 4) ``[w, x, y, z]``, the base's attitude in the inertial frame
    - ``angular_velocity`` (N, 3) rad/s, in the base frame
    - ``base_position`` (N, 3) m and ``base_velocity`` (N, 3) m/s, in the inertial frame
    - ``joint_positions`` (N, n) rad and ``joint_velocities`` (N, n) rad/s
    - ``applied_torque`` (N, n+3) N m over the interval that ended at the tick: base x, y, z in the
      base frame, then the joints
    - ``commanded_torque`` (N, n+3) N m, the answer to the tick; None if not recorded
    - ``reference_joints`` (N, 3, n) desired position, velocity, acceleration: rad, rad/s, rad/s2
    - ``reference_base`` (N, 10) desired quaternion ``[w, x, y, z]``, angular velocity rad/s and
      acceleration rad/s2, in the base frame
    - ``joint_names``, and ``description``: what was flown (controller, case, gains, ...)
    - ``damage``, ``unfinished``, ``lost``: what is wrong with the bag, empty or zero if nothing.
      Ticks that could not be read are NaN; ``whole`` (N,) says which are not.

    Args:
        path: the bag's folder, or a single .mcap or .db3 file.
        remap: our topic by the bag's, as in ``{"/arm/joint_states": "/joint_states"}``.
        namespace: of the robot to be read, as ``/sat1``; None: of the only one in the bag.

    Raises:
        InputError: no bag is there, or no flight in it; one line says why.
    """
    from space_robot_msgs_py.bag.reader import read_flight
    from space_robot_msgs_py.config.arguments import as_path

    return read_flight(as_path(path, "path"), remap, namespace=namespace)
