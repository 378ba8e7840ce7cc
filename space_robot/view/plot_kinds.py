"""What can be plotted of a flight, and the names that choose it."""

from __future__ import annotations

from space_robot_msgs_py.errors import InputError

PLOT_KINDS = {
    "attitude": "error of the base's attitude, or its drift",
    "joints": "errors of the joints",
    "tool": "distance of the tool from its path",
    "base": "drift of the base's position",
    "rates": "angular velocity of the base",
    "positions": "positions of the joints",
    "velocities": "velocities of the joints",
    "deflection": "passive joints, and motors behind gears",
    "torques": "torques on base and joints",
    "wheels": "momentum, torque and speed of the wheels",
    "thrusters": "pulses of the thrusters",
    "momentum": "angular momentum of robot and wheels together",
    "estimates": "errors of the measured state",
    "orbit": "torques from outside and the magnetic field",
}
"""What can be plotted, by the name that chooses it."""


def parse_kinds(text: str) -> tuple[str, ...]:
    """Return the names in a list such as ``attitude,wheels``.

    Raises:
        InputError: one is not of `PLOT_KINDS`, or there is none.
    """
    from space_robot_msgs_py.config.validation import one_of  # slow

    names = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    if not names:
        raise InputError(f"--plots: choose of {', '.join(PLOT_KINDS)}")
    for name in names:
        one_of(name, PLOT_KINDS, "plot", " for --plots")
    return names
