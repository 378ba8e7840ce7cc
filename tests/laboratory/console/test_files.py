"""Files and folders that appear whole, and what killed processes have left of them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from space_robot.console.files import ABANDONED_S, whole_file, whole_folder
from space_robot_msgs_py.errors import InputError


@pytest.mark.parametrize("name", ["c.parquet", "[a]*.csv"])
def test_what_a_killed_process_has_left_is_removed_by_the_next_one(
    name: str, tmp_path: Path
) -> None:
    """Not what may still be written, and not what has another name."""
    left, folder, new, other = (
        tmp_path / f".{text}"
        for text in (f"{name}.0123abcd", f"{name}.ffffffff", f"{name}.00000000", "x.0123abcd")
    )
    folder.mkdir()
    (folder / "inner").write_text("half", "utf-8")
    for path in (left, new, other):
        path.write_text("half", "utf-8")
    for path in (left, folder, other):
        before = path.stat().st_mtime - 2.0 * ABANDONED_S
        os.utime(path, (before, before))
    with whole_file(tmp_path / name) as file:
        file.write(b"whole")
    assert (tmp_path / name).read_text("utf-8") == "whole"
    assert sorted(tmp_path.iterdir()) == sorted([tmp_path / name, new, other])


def test_a_folder_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    folder = tmp_path / "one"
    with pytest.raises(InputError, match="cannot be written"), whole_folder(folder) as place:
        (place / "a").rename(place / "b")
    assert not [*tmp_path.iterdir()]
    for text in ("1", "2"):
        with whole_folder(folder) as place:
            (place / "a").write_text(text, "utf-8")
    assert [path.name for path in tmp_path.iterdir()] == ["one"]
    assert (folder / "a").read_text("utf-8") == "2"
