"""The commands that errors name where a package is missing, and that no text names another one."""

from __future__ import annotations

import importlib.metadata
import re
import shlex

import pytest
from paths import ROOT

from space_robot_msgs_py.config.extras import extra_packages, install_command

REQUIREMENTS = [
    "click>=8.1",
    'viser>=1.1; extra == "view"',
    'trimesh[easy]>=4 ; extra == "view"',
    'xacro; extra == "xacro"',
    "pymdown-extensions<12; python_full_version < '3.11.5' and extra == 'docs'",
]


@pytest.fixture
def metadata(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: REQUIREMENTS)


@pytest.mark.usefixtures("metadata")
def test_a_command_names_the_packages_of_its_extra() -> None:
    assert install_command("view") == "pip install 'viser>=1.1' 'trimesh[easy]>=4'"
    assert install_command("xacro") == "pip install xacro"
    assert extra_packages("docs") == ["pymdown-extensions<12"]


@pytest.mark.usefixtures("metadata")
def test_an_unknown_extra_has_no_packages() -> None:
    assert extra_packages("vie") == extra_packages("view.") == []


def test_where_nothing_is_installed_the_extra_is_installed_from_its_folder(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def requires(name: str) -> list[str]:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "requires", requires)
    assert install_command("view") == "pip install -e '.[view]' in the folder of space_robot"


def test_every_command_of_an_installation_names_packages_only() -> None:
    for extra in ("campaign", "dask", "gym", "parquet", "view", "xacro"):
        words = shlex.split(install_command(extra))
        assert words[:2] == ["pip", "install"], extra
        assert all(re.match(r"[a-z]", word) for word in words[2:]), words


def test_no_text_claims_that_the_project_is_on_an_index() -> None:
    """``pip install space_robot``, with or without extras; a folder or a wheel is none."""
    claim = re.compile(r"pip install ((?!&&|#).)*(?<![/\w])['\"]?space[_-]robot(\[|['\"]|\s|$)")
    folders = ("docs", "examples", "launch", *(p.name for p in ROOT.glob("space_robot*")))
    files = [ROOT / "CONTRIBUTING.md", ROOT / "README.md", ROOT / "Makefile"]
    files += [f for folder in folders for f in (ROOT / folder).rglob("*") if f.suffix in TEXTS]
    claims = [
        f"{file.relative_to(ROOT)}: {line.strip()}"
        for file in files
        for line in file.read_text("utf-8").splitlines()
        if claim.search(line) and file.name != "extras.py"
    ]
    assert not claims, "\n".join(claims)


TEXTS = {".py", ".md", ".j2", ".urdf", ".c"}
