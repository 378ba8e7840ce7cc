"""Requirements and their evidence: the shipped set, verdicts of each method, the matrix."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from command import Run
from flights import space_robot_here
from paths import CONFIG, ROOT

import space_robot as sr
from space_robot.campaign.report.documents import markdown, record
from space_robot.campaign.report.findings import Findings
from space_robot.trace.evidence import gather_evidence
from space_robot.trace.requirements import RequirementSet, read_requirements

SHIPPED = CONFIG / "requirements/paper.yaml"
SHORT = {"duration": 0.1}
MET = {"metric": "attitude.max", "below": 1.0}
MISSED = {"metric": "attitude.max", "below": 1e-30}
NEEDS = {
    "FLT-007": importlib.util.find_spec("rclpy") is not None,
    "SW-001": bool(shutil.which("make") and shutil.which("gcc")),
}
"""Whether what some requirements need is here."""


@pytest.fixture(scope="module")
def matrix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that the shipped set's verification writes."""
    folder = tmp_path_factory.mktemp("trace") / "matrix"
    ran = space_robot_here("trace", "--workers", "0", "--out", str(folder))
    assert ran.returncode == 0, ran.stderr
    assert "30 requirements: " in ran.stdout
    return folder


def rows_of(path: Path) -> dict[str, dict[str, Any]]:
    rows = json.loads(path.read_text("utf-8"))["requirements"]
    return {row["id"]: row for row in rows}


def evidence_of(space_robot: Run, folder: Path, **requirements: Any) -> tuple[int, dict[str, Any]]:
    """Exit code, and the rows of a file with these requirements."""
    content = {n.replace("_", "-"): {"text": "t", **r} for n, r in requirements.items()}
    (folder / "mine.yaml").write_text(yaml.safe_dump({"requirements": content}))
    code, out, err = space_robot("trace", str(folder / "mine.yaml"), "--workers", "0", "--json")
    assert code in (0, 1), err
    return code, {row["id"]: row for row in json.loads(out)["requirements"]}


def test_every_shipped_requirement_is_verified(matrix: Path) -> None:
    rows = rows_of(matrix / "matrix.json")
    assert len(rows) == 30
    for name, row in rows.items():
        is_possible = NEEDS.get(name, True)
        assert row["verdict"] == ("verified" if is_possible else "not verified"), row
        assert row["method"] != "inspection", "nobody has inspected anything"


def test_limits_have_margin(matrix: Path) -> None:
    """Half again as much would still be met: no limit is the result with its last digit rounded."""
    for row in rows_of(matrix / "matrix.json").values():
        for value, limit in zip(row["measured"], row["limits"], strict=True):
            if match := re.search(r" (below|above) (\S+)", limit):
                bound = float(match[2])
                is_met = 1.4 * value < bound if match[1] == "below" else value > 1.4 * bound
                assert is_met, (row["id"], value, limit)


def test_numbers_are_those_of_the_log(matrix: Path) -> None:
    """Of the attitude's error by its quaternions, and of the first joints."""
    log = sr.Scenario(case="1").fly().log
    assert (log.reference_base[:, :4] == [1.0, 0.0, 0.0, 0.0]).all()
    angle = 2.0 * np.arcsin(np.linalg.norm(log.quaternion[:, 1:], axis=1).max())
    rows = rows_of(matrix / "matrix.json")
    (measured,) = rows["PNT-001"]["measured"]
    assert measured == pytest.approx(np.degrees(angle) * 3600.0, rel=1e-6)
    error = (log.reference_joints[:, 0] - log.joint_positions)[:, :3]
    by_axis = np.sqrt(np.mean(error**2, axis=0)).mean()
    assert rows["TRK-001"]["measured"][0] == pytest.approx(by_axis, rel=1e-9)


def test_the_matrix_says_the_same_in_each_form(matrix: Path) -> None:
    rows = rows_of(matrix / "matrix.json")
    page, text = ((matrix / f"matrix.{s}").read_text("utf-8") for s in ("html", "md"))
    for name, row in rows.items():
        (line,) = (line for line in text.splitlines() if line.startswith(f"| {name} "))
        assert row["text"] in line
        assert row["digest"] in line
        assert f"| {row['verdict']} |" in line
        assert f'<td class=" label">{name}</td>' in page
    assert not re.search(r"(src|href)=", page)
    assert list(rows_of(matrix / "matrix.json")) == list(read_requirements("paper").requirements)


def test_equal_flights_are_flown_once_and_the_same_numbers_come_again() -> None:
    """Also where the options are written otherwise."""
    flights = [SHORT, {**SHORT, "case": "1", "controller": "tde_stc"}, {**SHORT, "case": "3"}]
    content = {
        f"A-{k}": {"text": "t", "flight": {"scenario": options, "require": [MET]}}
        for k, options in enumerate(flights)
    }
    every = RequirementSet.model_validate({"requirements": content}).requirements
    totals: list[int] = []

    def count(total: int) -> Any:
        totals.append(total)
        return lambda: None

    first, again = (gather_evidence(every, "mine.yaml", workers, count) for workers in (0, 2))
    assert totals == [2, 2]
    assert first == again
    assert first["A-0"] == first["A-1"]
    assert first["A-0"].digest != first["A-2"].digest


def test_an_impossible_limit_in_a_copy_is_violated(tmp_path: Path, space_robot: Run) -> None:
    content = yaml.safe_load(SHIPPED.read_text("utf-8"))
    content["requirements"]["PNT-001"]["flight"]["require"][0]["below"] = 1e-9
    (tmp_path / "broken.yaml").write_text(yaml.safe_dump(content))
    words = ("trace", str(tmp_path / "broken.yaml"), "--only", "PNT-001,PNT-002", "--workers", "0")
    code, out, _ = space_robot(*words)
    assert code == 1
    assert out.splitlines()[-1] == "2 requirements: 1 verified, 0 open, 0 not verified, 1 violated"


def test_flights(tmp_path: Path, space_robot: Run) -> None:
    """The worst of several numbers counts; a flight that ends early violates what is required."""
    diverges = {"gains": {"h_bar": 1000.0}, "duration": 2.0}
    code, rows = evidence_of(
        space_robot,
        tmp_path,
        A_1={"flight": {"scenario": SHORT, "require": [MET, MISSED]}},
        A_2={"flight": {"scenario": diverges, "require": [MET]}},
    )
    assert code == 1
    assert (rows["A-1"]["verdict"], len(rows["A-1"]["measured"])) == ("violated", 2)
    assert rows["A-2"]["verdict"] == "violated"
    assert "diverged" in rows["A-2"]["remark"]


def test_campaigns(tmp_path: Path, space_robot: Run) -> None:
    """Eight runs decide nothing; a bound that nothing meets is decided by them."""
    study: dict[str, Any] = {"scenario": SHORT, "laws": ["ctc"], "runs": 8}
    study["vary"] = {"robot.links[*].mass": {"normal": 1.0, "sigma": 0.01, "relative": True}}
    study["require"] = {
        name: {**condition, "in": 0.9, "id": name.upper()}
        for name, condition in (("met", MET), ("missed", MISSED))
    }
    (tmp_path / "study.yaml").write_text(yaml.safe_dump(study))
    own = {"study": str(tmp_path / "study.yaml")}
    code, rows = evidence_of(
        space_robot,
        tmp_path,
        A_1={"campaign": {**own, "requirement": "met"}},
        A_2={"campaign": {**own, "requirement": "missed"}},
        A_3={"campaign": {**own, "requirement": "met", "runs": 40}},
    )
    assert [row["verdict"] for row in rows.values()] == ["open", "violated", "verified"]
    assert rows["A-1"]["remark"] == "ctc: met in 8 of 8"
    assert rows["A-1"]["confidence"] == 0.9
    assert rows["A-1"]["digest"] == rows["A-2"]["digest"] != rows["A-3"]["digest"]
    assert code == 1
    flown = sr.Campaign.load(own["study"]).run(workers=0)
    findings = Findings.of(flown)
    assert [v["id"] for v in record(findings)["requirements"]] == ["MET", "MISSED"]
    assert "## MET met: " in markdown(findings)


def test_tests(tmp_path: Path, space_robot: Run) -> None:
    """Passed, failed, skipped, and not there."""
    file = tmp_path / "test_mine.py"
    body = "import pytest\ndef test_a(): pass\ndef test_b(): assert 0\n"
    file.write_text(f"{body}def test_c(): pytest.skip('no device')\n")
    path = f"tests/{os.path.relpath(file, ROOT / 'tests')}"
    names = ("test_a", "test_b", "test_c", "test_a[1]")
    code, rows = evidence_of(
        space_robot, tmp_path, **{f"A_{k}": {"test": f"{path}::{n}"} for k, n in enumerate(names)}
    )
    verdicts = [row["verdict"] for row in rows.values()]
    assert verdicts == ["verified", "violated", "not verified", "not verified"]
    assert "1 skipped" in rows["A-2"]["remark"]
    assert code == 1


def test_analyses_and_inspections(tmp_path: Path, space_robot: Run) -> None:
    def plan(metric: str, options: str = "", **bound: float) -> dict[str, Any]:
        command = f"space-robot plan{options} --json"
        return {"analysis": {"command": command, "require": [{"metric": metric, **bound}]}}

    words = {"by": "A. Nobody", "date": "2026-01-31", "words": "all bolts are marked"}
    code, rows = evidence_of(
        space_robot,
        tmp_path,
        A_1=plan("segments.1.duration_s", above=14.0),
        A_2=plan("segment", above=0.0),
        A_3=plan("duration_s", " nowhere", above=0.0),
        A_4={"inspection": words},
    )
    assert code == 0, "not verified is not violated"
    assert rows["A-1"]["verdict"] == "verified"
    assert rows["A-1"]["measured"] == [15.0]
    assert rows["A-2"]["remark"] == "no number segment"
    assert "nowhere" in rows["A-3"]["remark"]
    assert {rows[name]["verdict"] for name in ("A-2", "A-3")} == {"not verified"}
    assert rows["A-4"]["remark"] == words["words"]
    listed = space_robot("trace", str(tmp_path / "mine.yaml"), "--list", "--only", "A-4").out
    assert "inspection" in listed
    assert "A-1" not in listed


def test_exported_code_names_what_is_allocated_to_it(tmp_path: Path, space_robot: Run) -> None:
    content = {
        name: {"text": f"{name} */ {'long ' * 40}", "allocated_to": part, "test": "tests/a.py::b"}
        for name, part in (("SW-1", "flight_software"), ("PNT-1", None))
    }
    (tmp_path / "mine.yaml").write_text(yaml.safe_dump({"requirements": content}))
    words = ("--requirements", str(tmp_path / "mine.yaml"), "--acceptance-seconds", "0.1")
    ran = space_robot("export", "-o", str(tmp_path / "code"), *words)
    assert ran.code == 0, ran.err
    header = (tmp_path / "code/include/space_robot_flight.h").read_text("utf-8")
    (named,) = re.findall(r"/\*\n \* SW-1: SW-1 \* /.*?\*/\n#ifndef", header, re.DOTALL)
    assert named.count("long") == 40
    assert "PNT-1" not in header
