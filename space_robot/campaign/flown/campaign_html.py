"""A campaign as tables for notebooks: flights, variables, requirements."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import yaml

from space_robot_msgs_py.config.text import html_table

from ..study import Requirement, Study
from ..verdicts.requirements import Verdict


def study_html(study: Study) -> str:
    """Return what a campaign flies, varies and requires."""
    runs = study.runs or (study.until and study.until.runs)
    flights = f", {runs} runs, {runs * len(study.laws)} flights" if runs else ""
    caption = f"{study.where}: {', '.join(study.laws)}{flights}"
    return "".join(
        (
            html_table(("option", "value"), _pairs(study.scenario), caption),
            html_table(("variable", "distribution"), _pairs(study.vary)),
            html_table(("requirement", "demand"), _demands(study.require)),
        )
    )


def verdicts_html(caption: str, verdicts: Sequence[Verdict]) -> str:
    """Return the verdicts of a flown campaign."""
    heads = ("requirement", "law", "point", "verdict", "met", "at least", "at most")
    rows = [
        [
            verdict.requirement,
            verdict.law,
            verdict.point,
            verdict.word,
            f"{verdict.met} of {verdict.runs}",
            f"{verdict.limits.low:.4f}",
            f"{verdict.limits.high:.4f}",
        ]
        for verdict in verdicts
    ]
    return html_table(heads, rows, caption)


def demand_of(requirement: Requirement) -> str:
    """Return a requirement as a sentence."""
    way = "below" if requirement.above is None else "above"
    end = "" if requirement.to_s is None else f" to {requirement.to_s:g} s"
    window = f" from {requirement.from_s:g} s{end}" if requirement.from_s or end else ""
    return (
        f"{requirement.metric} {way} {requirement.bound:g}{window} "
        f"in {100.0 * requirement.share:g} % of the cases, "
        f"with {100.0 * requirement.confidence:g} % confidence"
    )


def _pairs(content: Mapping[str, Any]) -> Iterator[list[str]]:
    for name, value in content.items():
        yield [name, value if isinstance(value, str) else _flow(value)]


def _flow(value: Any) -> str:
    """Return a value in one line of YAML."""
    text = yaml.safe_dump(value, default_flow_style=True, width=10**9, allow_unicode=True)
    return text.removesuffix("\n").removesuffix("\n...")


def _demands(require: Mapping[str, Requirement]) -> Iterator[list[str]]:
    for name, requirement in require.items():
        yield [name, demand_of(requirement)]
