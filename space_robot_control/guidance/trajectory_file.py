"""Trajectories from CSV and Parquet files.

Columns are ``time`` (s, rising), every joint with a motor by its name (rad, or m of prismatic
joints), and, if the base turns, its quaternion ``q_w, q_x, q_y, q_z``. Columns ``<joint>_rate``
(rad/s or m/s) are optional: they must belong to the positions. Other columns are not read.
"""

from __future__ import annotations

import json
from pathlib import Path

from space_robot_msgs_py.config.columns import read_columns
from space_robot_msgs_py.config.yaml_text import YamlTextError, parse_yaml


def with_columns(text: str, folder: Path) -> str:
    """Return the text of a segment with the columns of its file in place of the file's name.

    Args:
        text: of the segment, YAML.
        folder: where a relative path begins.

    Raises:
        InputError: the file cannot be read.
    """
    try:
        content = parse_yaml(text)
    except YamlTextError:
        return text  # refused where segments are read
    if not isinstance(content, dict) or not isinstance(name := content.get("file"), str):
        return text
    rest = {key: value for key, value in content.items() if key != "file"}
    return json.dumps({"trajectory": read_columns(folder / name), **rest})
