"""Components for F' and cFS: the model by fpp-check, and flights in frameworks that are here."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Any

import pytest
from flights import planned, space_robot_here

from space_robot.export.folder import FRAMEWORKS, framework_checks, targets
from space_robot.export.software import export
from space_robot_control.flight_code.folder import Exported
from space_robot_control.flight_code.frameworks import framework_files
from space_robot_control.flight_code.instances import write_sources
from space_robot_msgs_py.errors import InputError

SCENARIOS: dict[str, dict[str, Any]] = {
    "paper": {"controller": "tde_stc"},
    "wheels": {"robot": "seven_joint", "mission": "seven_joint", "actuators": "wheels"},
    "orbit": {"orbit": "iss", "actuators": "wheels_and_torquers", "swaps": ["0.1:ctc"]},
}
MODEL = PurePosixPath("fprime/SpaceRobotController/SpaceRobotController.fpp")
HEADER = PurePosixPath("include/space_robot_flight.h")
PATH = os.pathsep.join([os.environ["PATH"], str(Path(sys.executable).parent)])
"""With the programs of this environment; those of a framework come first."""

needs_fpp = pytest.mark.skipif(
    not shutil.which("fpp-check", path=PATH), reason="fpp-check is not installed"
)


@cache
def exported(name: str) -> Exported:
    return export(planned(**SCENARIOS[name]), ["ctc"])


def named(law: str, robot: str = "mine") -> Exported:
    """Flight software whose only law has this name."""
    flight = planned(controller="pd")
    flight.law.__class__ = type("Renamed", (type(flight.law),), {"name": law})
    return Exported(export(flight).software, robot)


def make(folder: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    command = ["make", "--no-print-directory", "-C", str(folder), *arguments]
    variables = {**os.environ, "PATH": PATH, **environment}
    return subprocess.run(command, capture_output=True, text=True, check=False, env=variables)


def checked(software: Exported, folder: Path) -> subprocess.CompletedProcess[str]:
    write_sources(folder, framework_files(software, "fprime"))
    return make(folder / "fprime", "check")


def port(model: str, name: str) -> dict[str, int]:
    """The arrays of a port in the model: their sizes by name."""
    fields = model.split(f"port {name}(")[1].split("\n  )")[0]
    return {field: int(size) for field, size in re.findall(r"\$(\w+): Vector(\d+) @<", fields)}


def snake(name: str) -> str:
    return re.sub("([A-Z])", r"_\1", name).lower()


@needs_fpp
@pytest.mark.parametrize("name", SCENARIOS)
def test_fpp_check_accepts_the_model(name: str, tmp_path: Path) -> None:
    ran = checked(exported(name), tmp_path)
    assert ran.returncode == 0, ran.stderr


@needs_fpp
def test_fpp_check_refuses_a_model_with_an_unknown_type(tmp_path: Path) -> None:
    assert checked(exported("paper"), tmp_path).returncode == 0
    text = (tmp_path / MODEL).read_text("utf-8")
    (tmp_path / MODEL).write_text(text.replace("(law: Law)", "(law: Laws)"), "utf-8")
    assert "symbol Laws is not defined" in make(tmp_path / "fprime", "check").stderr


@pytest.mark.parametrize("name", SCENARIOS)
def test_ports_have_what_the_flight_software_reads(name: str) -> None:
    """By the text of its functions, and the sizes in its header."""
    software = exported(name)
    model = framework_files(software, "fprime")[MODEL]
    header = software.sources[HEADER]
    source = "".join(text for path, text in software.sources.items() if path.suffix == ".c")
    state, reference = (
        dict(re.findall(r"double (\w+)\[(\d+)\];", header.split(f"}} sr_{end};")[0].split("{")[-1]))
        for end in ("state", "reference")
    )
    measured = {snake(field): str(size) for field, size in port(model, "Measurement").items()}
    read = {field for field in state if re.search(rf"\b(state|measured)->{field}\b", source)}
    assert measured == {field: state[field] for field in read}
    desired = {snake(field): str(size) for field, size in port(model, "Reference").items()}
    assert desired == reference
    definitions = dict(re.findall(r"#define SPACE_ROBOT_(\w+) (\d+)", header))
    parts = (int(definitions[part]) for part in ("JOINTS", "WHEELS", "THRUSTERS", "TORQUERS"))
    assert sum(port(model, "Command").values()) == 3 + sum(parts)
    laws = dict(re.findall(r"#define SPACE_ROBOT_LAW_(\w+) (\d+)", header))
    assert dict(re.findall(r"^    \$(\w+) = (\d+)$", model, re.M)) == laws


def test_housekeeping_of_cfs_has_the_channels_of_fprime() -> None:
    for name in SCENARIOS:
        model = framework_files(exported(name), "fprime")[MODEL]
        files = framework_files(exported(name), "cfs")
        message = files[PurePosixPath("cfs/space_robot_app/space_robot_msg.h")]
        channels = re.findall(r"telemetry (\w+): Vector(\d+)", model)
        assert re.findall(r"double (\w+)\[(\d+)\];", message) == channels
        assert ("JointPositions", "7" if name == "wheels" else "6") in channels


@needs_fpp
def test_a_law_named_as_a_type_and_a_robot_named_as_the_end_of_a_comment(tmp_path: Path) -> None:
    software = named("f64", "one */ two\nthree")
    ran = checked(software, tmp_path)
    assert ran.returncode == 0, ran.stderr
    assert "'one * / two three'" in software.sources[HEADER]


@pytest.mark.parametrize("name", ["my law", "7th", "größe", ""])
def test_a_law_whose_name_is_no_identifier_is_refused(name: str) -> None:
    with pytest.raises(InputError, match="cannot be exported as C: a name of letters") as error:
        named(name)
    assert repr(name) in str(error.value)


def test_an_exported_folder_has_one_framework(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What can be verified depends on the programs and sources that are here."""
    folder = tmp_path / "code"
    words = ["--framework", "fprime", "--acceptance-seconds", "0.01"]
    ran = space_robot_here("export", "-o", str(folder), *words)
    assert ran.returncode == 0, ran.stderr
    assert "| `fprime/` | component of F'" in (folder / "README.md").read_text("utf-8")
    assert not (folder / "cfs").exists()
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("FPRIME_ROOT", raising=False)
    missing = {name: reason for name, _, reason in framework_checks(folder)}
    assert missing == {"fpp-check": "fpp-check is not installed", "F'": "FPRIME_ROOT is not set"}
    monkeypatch.setenv("FPRIME_ROOT", "/nowhere")
    assert targets(folder) == {"F'": ["-C", "fprime", "replay"]}


@pytest.mark.parametrize("framework", FRAMEWORKS)
def test_sources_that_are_not_there(framework: str, tmp_path: Path) -> None:
    write_sources(tmp_path, framework_files(exported("paper"), framework))
    variable = FRAMEWORKS[framework][1]
    ran = make(tmp_path / framework, "replay", **{variable: str(tmp_path)})
    assert ran.returncode != 0
    assert f"error: {variable} '{tmp_path}' is no folder of" in ran.stdout


@pytest.mark.docs
@pytest.mark.parametrize("framework", FRAMEWORKS)
def test_the_framework_answers_with_the_same_bits(framework: str, tmp_path: Path) -> None:
    """The component, compiled with the sources that the environment names, flies the mission."""
    name, variable = FRAMEWORKS[framework]
    if not os.environ.get(variable):
        pytest.skip(f"{variable} does not name the sources of {name}")
    folder = tmp_path / "code"
    words = f"--framework {framework} --law ctc --acceptance-seconds 0.2 -o".split()
    ran = space_robot_here("export", *words, str(folder))
    assert ran.returncode == 0, ran.stderr
    ran = make(folder / framework, "replay")
    assert ran.returncode == 0, (ran.stderr or ran.stdout)[-2000:]
    answered = dict(re.findall(r"(\w+)\.bin: (\d+) states answered, every bit equal", ran.stdout))
    assert answered.keys() == {"mission", "faults_tde_stc", "faults_ctc"}
    assert answered["mission"] == "400"
