"""What has no translation to C is refused in one line: data/refusals/flight_code.yaml."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import pytest
import yaml
from exported_kernels import text_of
from paths import DATA

from space_robot_control.flight_code.c99.language import FLOAT, ArrayOf, NotInSubsetError

ROWS: list[dict[str, Any]] = yaml.safe_load((DATA / "refusals/flight_code.yaml").read_text("utf-8"))
HEAD = """
import numpy as np

from space_robot_msgs_py.compiled.kernels import kernel


@kernel
def written(values):
    values[0] += 1.0
    return values[0]


@kernel
def kernel_under_test(a, row):
"""


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["construct"])
def test_a_construct_is_refused_with_file_line_and_what_to_write(
    row: dict[str, Any], tmp_path: Path
) -> None:
    path = tmp_path / "refused.py"
    path.write_text(HEAD + "".join(f"    {line}\n" for line in row["body"]))
    spec = importlib.util.spec_from_file_location("refused", path)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    with pytest.raises(NotInSubsetError) as error:
        text_of((module.kernel_under_test, FLOAT, ArrayOf((4,))))
    line = HEAD.count("\n") + row.get("line", len(row["body"]))
    assert str(error.value).startswith(f"{path}, line {line}: ")
    for part in (row["construct"], " cannot be exported as C: ", row["instead"]):
        assert part in str(error.value)
    assert "\n" not in str(error.value)
