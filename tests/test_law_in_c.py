"""The page that shows one law three times has what the kernel and its export are."""

from __future__ import annotations

import inspect
import re
from typing import Any

import pytest
from shown import ROOT

from space_robot.export.software import export
from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot_control.controller import time_delay_estimation
from space_robot_control.laws import tde_stc

PAGE = "docs/explanation/one_law_three_times.md"
MARK = r"(line )\d+"


@pytest.fixture(scope="module")
def sources() -> dict[str, str]:
    exported = export(Flight(resolve(Scenario())))
    return {path.name: text for path, text in exported.sources.items()}


def unwrapped(text: str) -> str:
    return " ".join(text.split())


def test_listings_and_lines_of_tables_are_those_of_kernel_and_export(
    sources: dict[str, str],
) -> None:
    text = (ROOT / PAGE).read_text("utf-8")
    (python,) = re.findall(r"```py\n(.*?)```", text, re.DOTALL)
    law: Any = tde_stc.time_delay_super_twisting
    assert python == inspect.getsource(law.py_func)
    (c,) = re.findall(r"```c\n(.*?)```", text, re.DOTALL)
    assert re.sub(MARK, r"\1", c) in re.sub(MARK, r"\1", sources["laws.c"])
    python = unwrapped(inspect.getsource(tde_stc) + inspect.getsource(time_delay_estimation))
    c = unwrapped(sources["laws.c"] + sources["estimate.c"])
    rows = re.findall(r"^\| \(\d+\) .* \| `(.*)` \| `(.*)` \|$", text, re.MULTILINE)
    assert len(rows) == 6
    for left, right in rows:
        assert left in python
        assert right in c


def test_the_low_pass_is_exported_where_it_is_used(sources: dict[str, str]) -> None:
    assert "smooth" not in sources["estimate.c"]
    plan = Scenario(parameters={"controller": {"acceleration_filter_hz": 50.0}})
    with_filter = export(Flight(resolve(plan))).sources
    assert any("smooth_force" in text for text in with_filter.values())
