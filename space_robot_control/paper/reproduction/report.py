"""``report.html``: everything on one self-contained page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, NamedTuple

from space_robot_msgs_py.config.files import config_directory

from ...analysis.template import template
from .claims import Claim
from .gallery import Picture
from .table import Block


class Chapter(NamedTuple):
    """Pictures under one heading."""

    title: str
    pictures: list[Picture]


def render(
    provenance: dict[str, Any],
    parameters: dict[str, Any],
    claims: Sequence[Claim],
    tables: Sequence[Block],
    chapters: Sequence[Chapter],
) -> str:
    """The page as HTML without references to anything outside itself.

    Raises:
        InputError: the package's data files are not installed.
    """
    parameter_texts = {name: json.dumps(value, indent=1) for name, value in parameters.items()}
    return template("space_robot_control.paper.reproduction", "report.html.j2").render(
        provenance=provenance, parameters=parameter_texts, claims=claims, tables=tables,
        chapters=chapters, errata=errata(),
    )  # fmt: skip


def errata() -> str:
    """The text of ``docs/errata.md``, from the source tree or where it was installed."""
    return (config_directory().parent / "docs" / "errata.md").read_text("utf-8")
