"""The house keeps its measures: lines and files of each package, and one meaning of each name."""

from __future__ import annotations

import runpy
import subprocess
import sys

import pytest
from paths import ROOT

TOOL = ROOT / "tools/measures.py"
MEASURES = runpy.run_path(str(TOOL))
LIMITS = MEASURES["limits"]()
ADVICE = "say things once, move or cut something; or raise tools/measures.yaml, and say why"


@pytest.mark.parametrize("package", MEASURES["PACKAGES"])
def test_no_package_exceeds_its_lines_and_files(package: str) -> None:
    pairs = zip(MEASURES["size_of"](package), LIMITS["sizes"][package], strict=True)
    for (size, most), what in zip(pairs, ("lines", "files"), strict=True):
        if size > most:
            text = f"{package} has {size} {what}, {size - most} more than {most}: {ADVICE}"
            pytest.fail(text, pytrace=False)


def test_no_further_public_name_is_defined_twice() -> None:
    twice = MEASURES["names_defined_twice"]()
    further = [f"{n}: {', '.join(twice[n])}" for n in twice if n not in LIMITS["twice"]]
    if further:
        pytest.fail("names that stand for two things:\n" + "\n".join(further), pytrace=False)


def test_the_tool_ends_quietly_when_nobody_reads_on() -> None:
    with subprocess.Popen([sys.executable, TOOL], stdout=-1, stderr=-1, text=True) as tool:
        assert tool.stdout
        assert tool.stderr
        assert tool.stdout.readline().split()[0] == MEASURES["PACKAGES"][0]
        tool.stdout.close()
        assert tool.stderr.read() == ""
