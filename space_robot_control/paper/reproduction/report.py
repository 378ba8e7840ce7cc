"""``report.html``: everything on one self-contained page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from space_robot_msgs_py.config.files import config_directory

from ...analysis.tables import Table
from ...analysis.template import template
from .figures import FigureGroup


def render(
    provenance: dict[str, Any],
    parameters: dict[str, Any],
    claims: Table,
    tables: Sequence[Table],
    figure_groups: Sequence[FigureGroup],
) -> str:
    """Render the page as HTML, without references to anything outside itself.

    Raises:
        InputError: the package's data files are not installed.
    """
    parameter_texts = {name: json.dumps(value, indent=1) for name, value in parameters.items()}
    return template("space_robot_control.paper.reproduction", "report.html.j2").render(
        provenance=provenance, parameters=parameter_texts, claims=claims, tables=tables,
        figure_groups=figure_groups, errata=errata(),
    )  # fmt: skip


def errata() -> str:
    """Read ``docs/explanation/errata.md``, of the source tree or where it was installed."""
    return (config_directory().parent / "docs/explanation/errata.md").read_text("utf-8")
