"""Processes of this project: how they are started, what environment they have, when they end.

``python .../process.py MODULE ARGUMENT...`` is ``python -m`` without the current folder, which
``-m`` searches first at every import: a user's ``queue.py`` there would run in our processes. Here
only PYTHONPATH and installed packages are searched. (From Python 3.11 on, ``-P`` does the same.)
"""

from __future__ import annotations

import os
import signal
import sys
import threading

FOLDER = os.path.dirname(os.path.abspath(__file__))
LIFELINE = "SPACE_ROBOT_LIFELINE"
"""Environment variable: the standard input is a lifeline held by the process with this pid."""
TIMEOUT_S = 15.0
"""Time from SIGTERM to SIGALRM."""
DEFAULTS = {
    # discovery stays on this machine
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    # no shared memory; rmw_fastrtps 8.4 ignores this with LOCALHOST, so the profile selects UDP,
    # too
    "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
    "FASTRTPS_DEFAULT_PROFILES_FILE": os.path.join(FOLDER, "fastdds_profiles.xml"),
}
"""Defaults of environment variables of ROS processes; the user's have priority."""


def defaults() -> dict[str, str]:
    """Return `DEFAULTS`, and a folder for ROS log files if the home folder cannot be used."""
    if any(os.environ.get(name) for name in ("ROS_LOG_DIR", "ROS_HOME", "HOME")):
        return DEFAULTS
    from tempfile import gettempdir  # slow, and only needed here

    return DEFAULTS | {"ROS_LOG_DIR": os.path.join(gettempdir(), f"ros_log_{os.getuid()}")}


def set_defaults() -> None:
    """Apply `defaults`; to be called before rclpy is imported."""
    for name, value in defaults().items():
        os.environ.setdefault(name, value)


def clean_environment() -> dict[str, str]:
    """Return this process' environment without the current folder (empty entries) in PYTHONPATH."""
    environment = dict(os.environ)
    if "PYTHONPATH" in environment:
        entries = environment["PYTHONPATH"].split(os.pathsep)
        environment["PYTHONPATH"] = os.pathsep.join(entry for entry in entries if entry)
    return environment


def module_command(module: str, *arguments: str) -> list[str]:
    """Return the command line that runs ``module`` as a program with this Python."""
    return [sys.executable, os.path.join(FOLDER, "process.py"), module, *arguments]


# A lifeline ends a child process with its parent, for any reason. The parent holds the only write
# end of a pipe, which the kernel closes at its end, also after SIGKILL; a thread of the child waits
# for that. The pipe of a node is its standard input, since ``ros2 run`` passes on neither signals
# nor other descriptors.


def lifeline() -> dict[str, str]:
    """Return the environment variable for a process whose standard input this process holds."""
    return {LIFELINE: str(os.getpid())}


def starter() -> int:
    """Return the pid of the process that holds this one's lifeline; 0 if there is none."""
    value = os.environ.get(LIFELINE, "")
    return int(value) if value.isdecimal() else 0


def hold_to_standard_input() -> None:
    """End this process with its parent, if standard input is a lifeline."""
    if starter():
        hold_to(0)


def hold_to(descriptor: int) -> None:
    """Send this process SIGTERM when the pipe's other end is closed, and later SIGALRM.

    Called by the main thread.
    """
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    threading.Thread(target=_wait, args=(descriptor,), name="lifeline", daemon=True).start()


def _wait(descriptor: int) -> None:
    while os.read(descriptor, 4096):
        pass
    # by the kernel: a node that hangs in the middleware may keep all Python threads from running
    signal.setitimer(signal.ITIMER_REAL, TIMEOUT_S)
    os.kill(os.getpid(), signal.SIGTERM)


def _main() -> None:
    # Python adds the script's folder, whose modules are not top-level ones
    sys.path[:] = [path for path in sys.path if os.path.abspath(path) != FOLDER]
    root = os.path.dirname(os.path.dirname(FOLDER))
    if root not in sys.path:  # a source tree in the parent's current folder
        sys.path.insert(0, root)
    import runpy

    sys.argv = sys.argv[1:]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    _main()
