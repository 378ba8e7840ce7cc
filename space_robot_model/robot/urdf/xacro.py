"""URDF written with xacro, the macro language of ROS: expanded by the package of that name."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

from space_robot_msgs_py.config.yaml_text import check_file
from space_robot_msgs_py.errors import InputError


def expand_xacro(path: Path) -> str:
    """Return the URDF text that a xacro file stands for, every argument at its default.

    Raises:
        InputError: the package is not installed, or does not like the file.
    """
    check_file(path)
    try:
        import xacro
    except ImportError:
        raise InputError(
            f"{path}: xacro is not installed: `pip install 'space_robot[xacro]'` or `apt install "
            "ros-jazzy-xacro`, or expand the file elsewhere to a .urdf"
        ) from None
    said = io.StringIO()  # warnings, and where it was when it failed
    try:
        with contextlib.redirect_stderr(said):
            document = xacro.process_file(str(path))
        return str(document.toprettyxml(indent="  "))
    except (Exception, SystemExit) as error:  # whatever the expressions in a file come to
        words, more = (" ".join(text.split()) for text in (str(error), said.getvalue()))
        words += "" if more in words else f" {more}"
        raise InputError(f"{path}: xacro cannot expand it ({words[:300]})") from None
