"""A law of one's own by the path of its file: imported on the user's word, never on a bag's."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from space_robot.campaign.store.software import file_digests
from space_robot.scenario.objects import law_parameter
from space_robot_control.laws import find_law, importable_name
from space_robot_msgs_py.errors import InputError

CODE = """
from pathlib import Path
from space_robot_control.laws.ctc import ComputedTorque
Path(__file__).with_name("was_run").touch()
class Mine(ComputedTorque):
    name = "{name}"
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder: a law's file is in it, and one of the same name in ``other``."""
    for place in (tmp_path, tmp_path / "other"):
        place.mkdir(exist_ok=True)
        (place / "my_law.py").write_text(CODE.format(name=place.name.replace("-", "_")))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path])
    return tmp_path


@pytest.mark.parametrize("path", ["my_law.py", "./my_law.py", "{}/my_law.py", "../{}/my_law.py"])
def test_a_file_is_a_law_by_any_path_to_it(folder: Path, path: str) -> None:
    name = path.format(str(folder) if path.startswith("{}") else folder.name)
    law = find_law(f"{name}:Mine")
    assert (law.name, law) == (folder.name.replace("-", "_"), find_law("my_law.py:Mine"))


def test_files_of_one_name_in_two_folders_are_two_laws(folder: Path) -> None:
    one, two = find_law("my_law.py:Mine"), find_law("other/my_law.py:Mine")
    assert one is not two
    assert two.name == "other"
    assert importable_name(one) == "my_law.py:Mine", "another process imports it by its path"
    assert importable_name(two) == "other/my_law.py:Mine"
    for law in (one, two):
        assert find_law(importable_name(law)) is law, "what nodes and bags say finds it again"
        assert law_parameter(law) == importable_name(law)


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("my_law:Mine", "name the file, my_law.py:Mine"),
        ("other.my_law:Mine", "name the file, other/my_law.py:Mine"),
        ("my_law.py", "name the class as well"),
        ("nothing.py:Mine", "no such file"),
        ("nothing:Mine", "PYTHONPATH"),
        ("a" * 300 + ":Mine", "PYTHONPATH"),
        ("a\0.py:Mine", "cannot be read"),
    ],
)
def test_what_to_do_is_said_and_nothing_is_run(folder: Path, name: str, hint: str) -> None:
    with pytest.raises(InputError, match=hint) as caught:
        find_law(name)
    assert len(str(caught.value)) < 500
    assert not (folder / "was_run").exists()


def test_a_misspelt_class_is_suggested(folder: Path) -> None:
    with pytest.raises(InputError, match=r"unknown class 'Mien' of my_law\.py.*Mine"):
        find_law("my_law.py:Mien")


def test_a_file_that_fails_is_one_line_and_can_be_mended(folder: Path) -> None:
    (folder / "bad.py").write_text("raise RuntimeError('half\\nmade')")
    with pytest.raises(InputError, match=r"bad\.py:X.*RuntimeError: half made"):
        find_law("bad.py:X")
    (folder / "bad.py").write_text(CODE.format(name="mended").replace("Mine", "X"))
    assert find_law("bad.py:X").name == "mended"


def test_a_campaign_keeps_the_digest_of_a_laws_file(folder: Path) -> None:
    before = file_digests({"laws": ["ctc", "./my_law.py:Mine=gains/"]})
    (folder / "my_law.py").write_text("")
    assert list(before) == ["my_law.py"]
    assert file_digests({"laws": ["./my_law.py:Mine"]}) != before
