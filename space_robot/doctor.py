"""The checks of the machine, in the order in which they are shown.

Imports wait, so that a package that is missing or broken is a result, too.
"""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, Literal, NamedTuple

from space_robot_msgs_py.config.installation import install_packages, requirements
from space_robot_msgs_py.config.text import one_line_of
from space_robot_msgs_py.errors import SpaceRobotError

from .processes.software import installed_version

Status = Literal["ok", "warning", "missing"]

ROS = "ROS 2"
"""Name of the check of ROS 2 itself."""
DISTRIBUTION, WHEEL = "jazzy", "ros-jazzy-rclpy"
"""The tested ROS 2, and the package that brings its rclpy by pip."""
OLDEST, NEWEST = (3, 10), (3, 13)
"""Versions of Python that setup.py admits."""
USES = {
    "ros": "fly, goto and sim",
    "campaign": "the tables of campaign",
    "view": "view",
    "parquet": "analyze --parquet",
    "xacro": "robots in xacro files",
    "gym": "Gymnasium environments",
    "gpu": "flights on an NVIDIA device",
    "dask": "campaign run --scheduler",
    "mpc": "the example of model predictive control",
    "notebooks": "the notebooks of the documentation",
}
"""Extras for users, and what needs them."""
GIGABYTE = 1 << 30
"""Memory to compile kernels and fly a graph."""
CLOCK_PERIOD_S, CLOCK_S = 0.0005, 2.0
"""Period of the paper's controller, which the wall clock is tried with, and for how long."""
POLICIES = {os.SCHED_OTHER: "SCHED_OTHER", os.SCHED_FIFO: "SCHED_FIFO", os.SCHED_RR: "SCHED_RR"}
COMPILER_TIMEOUT_S = 5.0


class CheckedItem(NamedTuple):
    """Result of one check of the machine."""

    name: str
    status: Status
    text: str
    """What there is, in a line."""
    advice: str = ""
    """What to do; empty if there is nothing to do."""
    values: Mapping[str, Any] = {}
    """The same as numbers and names, for programs."""

    @property
    def prevents_flights(self) -> bool:
        """True if no flight can run in one process because of it."""
        is_required = self.name in ("Python", "packages", "flights", "kernels")
        return is_required and self.status == "missing"


def judged(
    name: str, text: str, advice: str, values: Mapping[str, Any], otherwise: Status = "warning"
) -> CheckedItem:
    """Return an item that is ok if there is no advice."""
    return CheckedItem(name, otherwise if advice else "ok", text, advice, values)


def examine() -> Iterator[CheckedItem]:
    """Yield the results of all checks; no flight and no node is started."""
    yield check_python()
    yield from check_packages(requirements())
    flights = check_flights()
    yield flights
    if flights.prevents_flights:  # what follows imports the same
        return
    yield check_kernels()
    yield check_processor()
    yield check_memory()
    yield check_deadlines(measure_lateness())
    yield check_gpu()
    yield from check_ros()
    yield check_compilers()


def check_python(python: tuple[int, int] = sys.version_info[:2]) -> CheckedItem:
    """Check the version of Python."""
    number = platform.python_version()
    text = f"{number} ({platform.python_implementation()}, {sys.executable})"
    values = {"version": number, "executable": sys.executable, "platform": platform.platform()}
    versions = f"3.{OLDEST[1]} to 3.{NEWEST[1]}"
    advice = f"install Python {versions}, and space_robot into an environment of it"
    is_tested = OLDEST <= python <= NEWEST
    return judged("Python", text, "" if is_tested else advice, values, "missing")


def check_packages(required: Mapping[str, list[str]]) -> Iterator[CheckedItem]:
    """Check the packages required by each extra, and without one (key "")."""
    packages = required.get("", [])
    versions, lacking, lack = _installed(packages)
    if not packages:
        text = "space_robot is not installed; it runs from its folder"
        advice = "pip install -e . in the folder of space_robot, so that versions can be checked"
        yield CheckedItem("packages", "warning", text, advice)
    else:
        shown = ("numpy", "numba", "scipy", "pydantic", "matplotlib", "mcap")
        text = ", ".join(f"{name} {versions[name]}" for name in shown if name in versions)
        advice = install_packages(lacking) if lacking else ""
        yield judged("packages", lack or text, advice, versions, "missing")
    for extra, use in USES.items():
        name, packages = f"extra {extra}", required.get(extra, [])
        versions, lacking, lack = _installed(packages)
        if not packages:
            text = f"{use}: unknown, the installed space_robot does not list this extra"
            yield CheckedItem(name, "warning", text, "install space_robot again")
            continue
        text = lack or ", ".join(f"{package} {number}" for package, number in versions.items())
        advice = f"{install_packages(lacking)}, if you need it" if lacking else ""
        yield judged(name, f"{use}: {text}", advice, versions, "missing")


def _installed(packages: Sequence[str]) -> tuple[dict[str, str | None], list[str], str]:
    """Return the version of each package, the requirements not installed, and a text of these."""
    names = [re.split(r"[^\w.-]", requirement, maxsplit=1)[0] for requirement in packages]
    versions = {name: installed_version(name) for name in names}
    lacking = [text for text, name in zip(packages, names, strict=True) if not versions[name]]
    return versions, lacking, f"not installed: {', '.join(lacking)}" if lacking else ""


def check_flights() -> CheckedItem:
    """Resolve the default flight without flying it."""
    try:
        from .flight.plan import Scenario, resolve

        plan = resolve(Scenario()).options
    except Exception as error:  # whatever fails here would end a flight
        text = f"no flight can be prepared ({one_line_of(error)})"
        advice = "reinstall space_robot, with the versions of constraints.txt"
        return CheckedItem("flights", "missing", text, advice)
    text = f"a flight under {plan.controller} can be prepared in one process"
    return CheckedItem("flights", "ok", text)


def check_kernels() -> CheckedItem:
    """Check the folder of compiled kernels, and if those of this version are there."""
    from space_robot_msgs_py.compiled.cache import cache_directory

    from .flight.compilation import MARK, mark_file

    folder, is_compiled = cache_directory(), mark_file(MARK).exists()
    values = {"folder": str(folder), "is_compiled": is_compiled}
    text, advice = f"compiled for this version, in {folder}", ""
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        text = f"{folder} cannot be written ({error.strerror})"
        advice = "set NUMBA_CACHE_DIR to a folder that can be written"
        return CheckedItem("kernels", "missing", text, advice, values)
    if folder.is_relative_to(tempfile.gettempdir()):
        text = f"in the temporary folder {folder}"
        advice = (
            "set NUMBA_CACHE_DIR to a folder that stays: what is compiled is lost at the next boot"
        )
    elif not is_compiled:
        text = f"not compiled yet for this version; they will be kept in {folder}"
        advice = "nothing: the first flight compiles them, in one to five minutes"
    return judged("kernels", text, advice, values)


def check_processor() -> CheckedItem:
    """Check the cores that may be used, their load, the scheduling policy, and the clock."""
    cores, load = len(os.sched_getaffinity(0)), os.getloadavg()[0]
    resolution = time.get_clock_info("monotonic").resolution
    policy = POLICIES.get(os.sched_getscheduler(0), "another policy")
    values = {"cores": cores, "clock_resolution_s": resolution, "policy": policy}
    values["load_average"] = load
    text = (
        f"{cores} of {os.cpu_count()} cores, load {load:.1f}; {policy}; "
        f"clock resolution {1e9 * resolution:g} ns"
    )
    advice = ""
    if cores < 2:
        advice = "a graph of nodes flies faster with two cores; one core is enough for simulate"
    elif load > cores:
        advice = "other programs use the processor: flights take longer"
    return judged("processor", text, advice, values)


def check_memory(table: Path = Path("/proc/meminfo")) -> CheckedItem:
    """Check the memory that is available, as a file in the format of ``/proc/meminfo`` has it."""
    lines = [line.split() for line in table.read_text("ascii").splitlines()]
    sizes = {words[0]: 1024 * int(words[1]) for words in lines}
    total, available = sizes["MemTotal:"], sizes["MemAvailable:"]
    text = f"{available / 1e9:.1f} GB of {total / 1e9:.1f} GB available"
    advice = "close other programs: the first flight compiles kernels, which takes about 1 GB"
    values = {"total_bytes": total, "available_bytes": available}
    return judged("memory", text, advice if available < GIGABYTE else "", values)


def check_gpu() -> CheckedItem:
    """Check for a device that flights could fly on; none is needed."""
    from .gpu.cuda import find_device

    try:
        device = find_device()
    except SpaceRobotError as error:
        return CheckedItem("GPU", "ok", f"none: {str(error).rpartition('used: ')[2]}")
    text = f"{device.name}, {device.free_bytes / 1e9:.1f} GB free"
    return CheckedItem("GPU", "ok", text, values={"free_bytes": device.free_bytes})


def measure_lateness() -> dict[str, Any]:
    """Wait for deadlines as the plant node does by the wall clock; return how late they end, s."""
    import numpy as np

    from space_robot_sim.plant.pacing import SPIN_BEFORE_DEADLINE_S, WallClock

    ticks = round(CLOCK_S / CLOCK_PERIOD_S)
    lateness = np.zeros(ticks)
    clock = WallClock(CLOCK_PERIOD_S)
    clock.start(0)
    for tick in range(ticks):
        while (left := clock.left(tick)) > 0.0:
            if left > SPIN_BEFORE_DEADLINE_S:
                time.sleep(left - SPIN_BEFORE_DEADLINE_S)
        lateness[tick] = -left
        clock.slip(tick)
    median, high = np.percentile(lateness, [50, 99])
    return {
        "period_s": CLOCK_PERIOD_S,
        "ticks": ticks,
        "median_s": float(median),
        "percentile_99_s": float(high),
        "worst_s": float(lateness.max()),
        "late_ticks": int((lateness > CLOCK_PERIOD_S).sum()),
        "lost_time_s": clock.lost_time_s,
    }


def check_deadlines(lateness: Mapping[str, Any]) -> CheckedItem:
    """Judge a measurement: 99 % of the ticks must end within a period of their deadline."""
    period = lateness["period_s"]
    names = {"median_s": "median", "percentile_99_s": "99 %", "worst_s": "worst"}
    numbers = ", ".join(f"{1e6 * lateness[key]:.0f} us ({name})" for key, name in names.items())
    late = f"{lateness['late_ticks']} of {lateness['ticks']} ticks more than a period late"
    is_kept = lateness["percentile_99_s"] < period and not lateness["lost_time_s"]
    text = f"be kept by the wall clock: late by {numbers}; {late}"
    text = f"{1e-3 / period:g} kHz {'can' if is_kept else 'cannot'} {text}"
    advice = (
        "close other programs, or fly --realtime with a longer --period; flights without "
        "--realtime are not affected"
    )
    return judged("wall clock", text, "" if is_kept else advice, lateness)


def check_ros() -> Iterator[CheckedItem]:
    """Check ROS 2, its middleware, and the domain; only the first where there is no ROS."""
    try:
        file = str(import_module("rclpy").__file__)
        identifier: str = import_module("rclpy.utilities").get_rmw_implementation_identifier()
    except Exception as error:  # a broken installation fails in many ways
        text = f"rclpy cannot be imported ({one_line_of(error)})"
        advice = (
            "source /opt/ros/jazzy/setup.bash if ROS 2 is installed, or install the extra ros; "
            "simulate flies without ROS"
        )
        yield CheckedItem(ROS, "missing", text, advice)
        return
    yield check_distribution(file, os.environ)
    yield check_middleware(identifier, os.environ)
    yield check_domain()


def check_distribution(file: str, environment: Mapping[str, str]) -> CheckedItem:
    """Check which ROS 2 the rclpy of a file belongs to, by ``ROS_DISTRO`` of ``setup.bash``."""
    from .flight.graph.processes import has_ros2_run

    wheel = installed_version(WHEEL)
    distribution = environment.get("ROS_DISTRO") or (DISTRIBUTION if wheel else "unknown")
    origin = f"wheel {WHEEL} {wheel}" if wheel else "no wheel"
    starts = "`ros2 run`" if has_ros2_run() else "Python"
    text = f"{distribution}, rclpy from {file} ({origin}); nodes are started through {starts}"
    values = {"distribution": distribution, "rclpy": file, "wheel": wheel}
    advice = "the project is tested with ROS 2 Jazzy: source /opt/ros/jazzy/setup.bash"
    return judged(ROS, text, "" if distribution == DISTRIBUTION else advice, values)


def check_middleware(identifier: str, environment: Mapping[str, str]) -> CheckedItem:
    """Check transports and discovery range of the middleware, as ``rmw_fastrtps_cpp``."""
    from space_robot_msgs_py.ros.process import defaults

    effective = {**defaults(), **environment}
    names = (
        "ROS_AUTOMATIC_DISCOVERY_RANGE",
        "ROS_STATIC_PEERS",
        "FASTDDS_BUILTIN_TRANSPORTS",
        "FASTRTPS_DEFAULT_PROFILES_FILE",
        "CYCLONEDDS_URI",
    )
    values = {name: effective[name] for name in names if effective.get(name)} | {"rmw": identifier}
    discovery, transports = effective[names[0]], effective[names[2]]
    text = f"{identifier}, discovery {discovery}, transports {transports}"
    advice = (
        "export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST and unset ROS_STATIC_PEERS, unless nodes "
        "of other machines are to take part"
    )
    is_local = discovery == "LOCALHOST" and not effective.get("ROS_STATIC_PEERS")
    return judged("middleware", text, "" if is_local else advice, values)


def check_domain(number: int | None = None) -> CheckedItem:
    """Take and release a ROS domain, as a flight does; None: ``ROS_DOMAIN_ID``, or a free one."""
    from .flight.graph.domain import domain_asked_for, is_quiet, ros_domain

    asked = domain_asked_for(number)
    try:
        with ros_domain(number) as domain:
            is_empty = is_quiet(domain)
    except SpaceRobotError as error:
        advice = "unset ROS_DOMAIN_ID, so that each flight takes a free domain, or set a free one"
        return CheckedItem("ROS domain", "warning", str(error), advice, {"domain": asked})
    chosen = "chosen by you" if asked is not None else "free; a flight takes such a one by itself"
    values = {"domain": domain, "is_empty": is_empty}
    text = f"{domain} ({chosen}){'' if is_empty else ': other programs may be in it'}"
    advice = "none if you know them; else take another domain with --domain"
    return judged("ROS domain", text, "" if is_empty else advice, values)


def check_compilers(search_path: str | None = None) -> CheckedItem:
    """Check the compilers of C; ``search_path``: None: ``PATH``."""
    from space_robot_control.flight_code.instances import COMPILERS

    own = os.environ.get("CC", "")
    names = list(dict.fromkeys(filter(None, (own, *COMPILERS))))
    paths = {name: shutil.which(name, path=search_path) for name in names}
    versions = {name: _first_line(path) for name, path in paths.items() if path}
    text, advice = "; ".join(f"{name}: {line}" for name, line in versions.items()), ""
    if own and own not in versions:
        text, advice = f"CC={own} is not there", "unset CC, or set it to gcc or clang"
    elif not versions:
        text = "no cc, gcc or clang"
        advice = "sudo apt install gcc make, if you need export or --controller-code c"
    elif not shutil.which("make", path=search_path):
        text, advice = "no make", "sudo apt install make, if you need export"
    return judged("C compiler", text, advice, versions, "missing")


def _first_line(path: str) -> str:
    """Return the first line of a compiler's ``--version``."""
    try:
        command, nothing = [path, "--version"], subprocess.DEVNULL
        output = subprocess.check_output(command, stdin=nothing, timeout=COMPILER_TIMEOUT_S)
    except (OSError, subprocess.SubprocessError) as error:
        return f"does not run ({error})"
    return next(iter(output.decode(errors="replace").splitlines()), "")


def can_fly(items: Iterable[CheckedItem]) -> bool:
    """Return True if nothing prevents flights in one process."""
    return not any(item.prevents_flights for item in items)


def can_fly_with_ros(items: Sequence[CheckedItem]) -> bool:
    """Return True if nothing prevents flights as ROS 2 nodes."""
    return can_fly(items) and any(i.name == ROS and i.status != "missing" for i in items)
