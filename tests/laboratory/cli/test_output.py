"""Output that cannot be written: one line, its exit code, and nothing half-made."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from command import Run

from space_robot.console.files import whole_file
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.errors import InputError

COMMAND = [sys.executable, "-m", "space_robot.cli.main"]


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("output") / "bag"
    simulate(Flight(resolve(FlightPlan(duration=0.1))), path)
    return path


Mount = Callable[[str], Path]


@pytest.fixture
def mounted(tmp_path: Path) -> Iterator[Mount]:
    """A folder with a file system of its own: read-only, or of a size."""
    folders: list[Path] = []

    def mount(options: str) -> Path:
        folder = tmp_path / f"mounted_{len(folders)}"
        folder.mkdir()
        command = ["mount", "-t", "tmpfs", "-o", options, "none", str(folder)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False)
        except FileNotFoundError:
            pytest.skip("there is no mount command")
        if done.returncode:
            pytest.skip(f"nothing may be mounted here: {done.stderr.strip()}")
        folders.append(folder)
        return folder

    yield mount
    for folder in folders:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def one_line(errors: str) -> str:
    (line,) = [text for text in errors.splitlines() if not text.startswith("wrote ")]
    assert line.startswith("space-robot: error: ")
    return line


@pytest.mark.parametrize("options", [(), ("--json",)])
def test_a_full_standard_output_is_one_line_and_exit_code_1(
    bag: Path, options: tuple[str, ...]
) -> None:
    with open("/dev/full", "w") as full:
        result = subprocess.run(
            [*COMMAND, "analyze", str(bag), *options],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert "standard output cannot be written (No space left on device)" in one_line(result.stderr)
    assert result.returncode == 1


def test_a_reader_that_has_gone_is_no_error_to_tell(bag: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as pipe:
        result = subprocess.run(
            [*COMMAND, "analyze", str(bag), "--json"],
            stdout=pipe,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert (result.returncode, result.stderr) == (1, "")


def test_a_full_standard_error_ends_no_flight() -> None:
    with open("/dev/full", "w") as full:
        result = subprocess.run(
            [*COMMAND, "simulate", "--duration", "0.1", "--json"],
            stdout=subprocess.PIPE,
            stderr=full,
            text=True,
            check=False,
        )
    assert result.returncode == 0
    assert json.loads(result.stdout)["ticks"] == 200


@pytest.mark.parametrize("option", ["--csv", "--parquet", "--html", "--plot"])
def test_files_on_a_full_or_read_only_file_system(
    bag: Path, mounted: Mount, option: str, space_robot: Run
) -> None:
    for options, why in (("ro", "Read-only file system"), ("size=16k", "No space left on device")):
        folder = mounted(options)
        target = folder if option == "--plot" else folder / f"x.{option[2:]}"
        code, _, err = space_robot("analyze", bag, option, target)
        line = one_line(err)
        assert str(folder) in line
        assert why in line or "no permission" in line
        assert code == 2
        assert list(folder.iterdir()) == []


def test_below_a_file_nothing_can_be_written(bag: Path, tmp_path: Path, space_robot: Run) -> None:
    (tmp_path / "file").touch()
    for option in ("--csv", "--html", "--plot"):
        target = tmp_path / "file" / "x" / f"y.{option[2:]}"
        code, _, err = space_robot("analyze", bag, option, target)
        assert code == 2
        assert str(tmp_path / "file") in err.splitlines()[-1]


def test_a_replay_that_is_refused_leaves_no_empty_table(tmp_path: Path, space_robot: Run) -> None:
    code, _, err = space_robot("replay", tmp_path / "nowhere", "--csv", tmp_path / "x.csv")
    assert code == 2
    assert list(tmp_path.iterdir()) == []
    assert "no such bag" in err


def test_an_older_file_stays_whole_if_the_new_one_fails(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_text("older")

    def fail() -> None:
        with whole_file(path, replace=True) as file:
            file.write(b"half")
            raise OSError(28, "No space left on device")

    with pytest.raises(InputError, match="cannot be written"):
        fail()
    assert path.read_text() == "older"
    assert list(tmp_path.iterdir()) == [path]
    with whole_file(path, replace=True) as f:
        f.write(b"newer")
    assert path.read_text() == "newer"


def test_a_device_is_written_and_not_replaced(tmp_path: Path) -> None:
    """By links of the test's own: one that were replaced would cost no system its device."""
    null, full = (tmp_path / name for name in ("null", "full"))
    for link in (null, full):
        link.symlink_to(Path("/dev") / link.name)
    with whole_file(null, replace=True) as file:
        file.write(b"gone")
    with (
        pytest.raises(InputError, match="No space left on device"),
        whole_file(full, replace=True) as file,
    ):
        file.write(b"x")
    assert all(link.is_symlink() and link.is_char_device() for link in (null, full))


def test_letters_that_no_terminal_has_are_shown_somehow(bag: Path, tmp_path: Path) -> None:
    strange = tmp_path / os.fsdecode(b"a\xff\x1b[31m")
    strange.symlink_to(bag)
    result = subprocess.run(
        [*COMMAND, "analyze", str(strange), "--plot", str(tmp_path / "figures")],
        capture_output=True,
        check=False,
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )
    assert result.returncode == 0, result.stderr
    assert b"RMS" in result.stdout
    assert b"Traceback" not in result.stderr


def test_a_flight_that_diverges_is_told_in_json_too(tmp_path: Path, space_robot: Run) -> None:
    given = ["simulate", "--controller", "ctc", "--gains", "printed", "--duration", "1", "--json"]
    for bag in (None, tmp_path / "bag"):
        options = ["--bag", str(bag)] if bag else []
        code, out, err = space_robot(*given, *options)
        assert code == 1
        report = json.loads(out)
        assert (report["controller"], report["gains"]) == ("ctc", "printed")
        tick = report["diverged"]["tick"]
        assert f"diverged at tick {tick}" in report["error"]
        assert report["error"] in err
        assert (report["outcome"], report["reason"]) == ("diverged", report["error"])
        assert report["diverged"]["time_s"] == pytest.approx(tick * 0.0005)
        if bag:
            assert 0 < report["ticks"] <= tick + 1
            assert report["bag"] == str(bag)
