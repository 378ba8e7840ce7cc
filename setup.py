"""Packaging for pip and colcon (ament_python); pyproject.toml only configures the tools."""

import re
from pathlib import Path

from setuptools import find_packages, setup

NAME = "space_robot"
ROOT = Path(__file__).resolve().parent
"""Where the files are: `colcon build --symlink-install` links this one into a folder of its own."""


def version() -> str:
    """Return the version of the first heading of the changelog, as in ``## 0.9.0 (unreleased)``."""
    heading = re.search(r"^## (\S+) \(", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M)
    if heading is None:
        raise SystemExit("setup.py: CHANGELOG.md has no heading such as '## 0.9.0 (unreleased)'")
    return heading[1]


def files(folder: str, pattern: str = "*") -> list[Path]:
    """Return the files of a folder, relative to this one's, as setuptools takes data files."""
    return sorted(path.relative_to(ROOT) for path in (ROOT / folder).glob(pattern))


# What `ros2 run` starts, all alike: each hands its name to bin/space-robot. As data files they land
# in lib/space_robot, where it looks, whether pip or colcon installs them.
EXECUTABLES = [str(path) for path in files("resource/executables")]

CONFIG = [
    (f"share/{NAME}/{path.parent}", [str(path)])
    for path in files("config", "**/*.*")
    if path.suffix in (".yaml", ".xml") or path.parent.name == "views"
]

# `space-robot examples` shows and copies them.
EXAMPLES = [
    (f"share/{NAME}/{path.parent}", [str(path)])
    for folder in ("examples", "examples/flight_computer", "examples/learning")
    for path in files(folder)
    if path.suffix in (".c", ".md", ".py", ".urdf") or path.name == "Makefile"
]

LAUNCH = [str(path) for path in files("launch", "*.launch.py")]

setup(
    name=NAME,
    version=version(),
    description="Test bed for the flight software of space robots, on ROS 2",
    license="Apache-2.0",
    maintainer="space_robot maintainers",
    maintainer_email="maintainers@space-robot.example.org",
    packages=find_packages(str(ROOT), include=[f"{NAME}*"]),
    package_data={
        "space_robot.analysis": ["templates/*.j2"],
        "space_robot.analysis.figures": ["*.mplstyle"],
        "space_robot.campaign.report": ["templates/*.j2"],
        "space_robot.choice": ["templates/*.j2"],
        "space_robot.cli": ["templates/*.txt"],
        "space_robot.gpu": ["templates/*.j2"],
        "space_robot.ground": ["templates/*"],
        "space_robot.help": ["*.md"],
        "space_robot.paper": ["templates/*.j2"],
        "space_robot.trace": ["templates/*.j2"],
        "space_robot.view": ["templates/*"],
        "space_robot_control.flight_code": [f"templates/{'*/' * k}*.j2" for k in range(3)],
        "space_robot_msgs_py.ros": ["*.xml"],
    },
    python_requires=">=3.10,<3.14",
    install_requires=[
        "click>=8.1",
        "jinja2>=3.1",
        "matplotlib>=3.8",
        "mcap>=1.5",
        "llvmlite>=0.41",  # numba has the versions that fit
        "numba>=0.58.1",
        "numpy>=1.26,<3",
        "pydantic>=2.7",
        "pyyaml>=6",
        "rich>=13",
        "rosbags>=0.11",
        "scikit-learn>=1.3",  # surrogates of `choose`
        "scipy>=1.11.4",
        "setproctitle>=1.2.2",
        "typing_extensions>=4.8",
        "zstandard>=0.22",
    ],
    extras_require={
        # beside ROS 2 Jazzy from apt: its messages are compiled for Ubuntu's NumPy 1.26, with which
        # pyarrow 26 does not work
        "apt": ["colcon-common-extensions", "numpy<2", "pyarrow<26"],
        # tools/benchmarks; bsk (Basilisk) holds back numpy and matplotlib, so a venv of its own
        "bench": ["bsk", "hypothesis", "mujoco", "pin"],
        "campaign": ["pandas>=2.1", "pyarrow>=14"],  # tables of `campaign`
        "dask": ["distributed>=2024.1"],  # `campaign run --scheduler`
        "dist": ["build>=1.2"],  # `make dist`
        # `make docs`
        "docs": [
            "mermaidx",
            "mkdocs-material>=9.7",
            "mkdocstrings[python]>=1.0",
            "pymdown-extensions<12; python_full_version < '3.11.5'",  # as mkdocstrings there
            "nbconvert",
            "ruff",  # wraps the signatures
            "ziamath",
        ],
        "frameworks": ["fprime-fpp>=3"],  # checks `export --framework fprime`
        "gpu": ["cuda-bindings>=13", "nvidia-cuda-nvrtc>=13"],  # flights on NVIDIA devices
        # telemetry and telecommands; aiohttp serves the display
        "ground": [
            "aiohttp>=3.9",
            "lxml>=5",
            "space-packet-parser>=6",
            "spacepackets>=0.32",
            "yamcs-pymdb>=1.3",
        ],
        "gym": ["gymnasium>=1.0"],  # space_robot.api.gymnasium_env
        "mpc": ["daqp>=0.8"],  # examples/mpc_law.py
        "mutation": ["cosmic-ray"],  # tools/mutation
        "notebooks": ["ipykernel", "pandas>=2.1", "pyarrow>=14"],  # docs/notebooks
        "parquet": ["pyarrow>=14"],  # `analyze --parquet`
        # ROS 2 Jazzy from wheels; never a requirement, for apt's ROS must stay untouched
        "ros": [
            "ros-jazzy-common-interfaces",
            "ros-jazzy-rclpy",
            "ros-rmw-fastrtps-cpp==8.4.3",  # Jazzy's: newer ones belong to other distributions
        ],
        "test": [
            "aiohttp>=3.9",
            "build>=1.2",
            "cvxpy",
            "catkin_pkg",  # ROS's generators of interfaces
            "cuda-bindings>=13",
            "daqp>=0.8",
            "distributed>=2024.1",
            "fprime-fpp>=3",
            "gymnasium>=1.0",
            "hypothesis",
            "ipykernel",
            "lxml>=5",
            "mermaidx",
            "mkdocs-material>=9.7",
            "mkdocstrings[python]>=1.0",
            "pymdown-extensions<12; python_full_version < '3.11.5'",  # as mkdocstrings there
            "mujoco",
            "mypy",
            "nbclient",
            "nbconvert",
            "nvidia-cuda-nvrtc>=13",
            "pandas>=2.1",
            "pin",
            "pre-commit",
            "psutil>=5.9",
            "pyarrow>=14",
            "pytest",
            "pytest-cov",
            "pytest-timeout",
            "pytest-xdist",
            "ruff",
            "scipy-stubs",
            "space-packet-parser>=6",
            "spacepackets>=0.32",
            "setuptools>=70.1",  # builds wheels by itself
            "trimesh>=4",
            "types-PyYAML",
            "types-psutil",
            "viser>=1.1",
            "websockets>=13",
            "xacro",
            "yamcs-pymdb>=1.3",
            "ziamath",
        ],
        "view": ["trimesh>=4", "viser>=1.1"],  # `view`
        "xacro": ["xacro"],  # robots in files that end in .xacro
    },
    entry_points={"console_scripts": ["space-robot = space_robot.cli.main:main"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", LAUNCH),
        (f"lib/{NAME}", EXECUTABLES),
        (f"share/{NAME}/docs/explanation", ["docs/explanation/errata.md"]),  # `reproduce` shows it
        *CONFIG,
        *EXAMPLES,
    ],
)
