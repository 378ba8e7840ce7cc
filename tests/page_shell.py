"""A page's commands typed into a shell, one after the other, as its reader would."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from bags import entries_of, mcap_of
from flights import space_robot_here
from pages import Item, files, items, name
from paths import CONFIG, DATA

SHORTER = {
    r"campaign run .*law_league_\d": "--runs 4 --workers 0",  # a grid of four
    r"campaign run .*(first|my.yaml)": "--runs 12 --workers 0",  # row 11 is flown again
    r"campaign run": "--runs 1 --workers 0",
    r"fly .*(kill|stop)_": "--duration {}",
    r"fly": "--composed --duration 0.5",
    r"reproduce": "--only tde_stc/1 --duration 0.5 --jobs 1",
    r"simulate": "--duration {}",
    r"soak": "--minutes 0.001 --duration 0.5",
    r"stability": "--duration 2",
    r"sweep": "--duration {} --draws 1 --jobs 1",
}
"""Options that are added to the commands that begin so; {} is half a second after the last time named."""
TIMES = r"(?<=@)[\d.-]+|(?<=--swap )[\d.]+"
LASTS_S = {"docs/manual/analysis.md": 16.5}
"""Of flights on pages that look at a later time."""
PLACEHOLDERS = {
    "CASE": "3", "COMMAND": "fly", "D": "2", "F": "100", "FOLDER": "flights/one", "LAW": "ctc",
    "LINK": "upper", "MODE": "filtered", "NAME": "ets_vii", "S": "tactical", "SIGMA": "1e-4",
}  # fmt: skip
"""What stands for a word of capitals in a command."""
EXIT_CODES = {
    r"gains check(?! .*(robust|tuned|my_gains))": 1,
}
"""Of commands that end otherwise than with 0, as their pages say."""
NOT_RUN = {
    r"\. .venv/bin/activate": "of an installation",
    r"(ros2|source|python -m colcon|export ROS_|for node in)\b": "ROS 2 from apt",
    r"(git|mkdir -p ws|cp TraceableRobotModels|pip|python3 -m venv|sudo apt)\b": "from elsewhere",
    r"make\b": "these tests, among others",
    r"nft\b": "the machine's firewall",
    r"dask\b|.*--scheduler": "a cluster: tests/control/campaign/runner/test_cluster.py has one",
    r"python docs/law_league.py": "4,000 flights",
    r"python tests/hostile": "half an hour",
}
"""Commands that are not run, and why."""


def _both(folder: Path) -> None:
    """A bag of two robots, as `ros2 bag record` takes it."""


GIVEN: dict[str, Callable[[Path], Any]] = {
    "README.md": lambda folder: shutil.copy(DATA / "arm.urdf", folder / "my.urdf"),
    "docs/manual/urdf.md": lambda folder: shutil.copy(DATA / "arm.urdf", folder / "my.urdf"),
    "docs/your_robot.md": lambda folder: shutil.copy(DATA / "arm.urdf", folder / "ETSVII.urdf"),
}
"""Files that a page takes for granted."""

CLIENT = r"""
set -euo pipefail
trap 'printf "end\0" > "$HERE/ask"' EXIT
ask() {
    printf '%s\0' "$PWD" "${PYTHONPATH-}" "$@" > "$HERE/ask"
    read -r answer < "$HERE/answer"
    cat "$HERE/printed"
}
space-robot() { ask space-robot "$@"; }
"""
"""What is a process of its own elsewhere is asked of the test's: all that it has imported and compiled is there."""


def is_run(item: Item) -> bool:
    """Whether it is a command that can be run here."""
    return item.kind == "shell" and not any(re.match(p, item.text) for p in NOT_RUN)


def starts_graphs(page: Path) -> bool:
    """Whether one of its commands starts ROS processes, or is a node."""
    return any(
        is_run(item) and re.search(r"space-robot (fly|replay|soak)\b", item.text)
        for item in items(page)
    )


class PageShell:
    """Runs pages, each in a folder of its own; a command that needs none of a page's files once."""

    def __init__(self, root: Path) -> None:
        self.root, self.seen = root, set[tuple[str, ...]]()

    def run(self, page: Path) -> list[str]:
        """Run a page from its top to its end; return what failed, a text each."""
        folder = self.root / name(page).replace("/", "_")
        folder.mkdir()
        (folder / "config").symlink_to(CONFIG)
        for path, text in files(page).items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text)
        GIVEN.get(name(page), lambda _: None)(folder)
        found = [item for item in items(page) if is_run(item) or item.kind == "python"]
        script = [
            item.text if item.kind == "shell" else f"ask python {i}" for i, item in enumerate(found)
        ]
        words = "|".join(PLACEHOLDERS)
        script = [re.sub(rf"\b({words})\b", lambda m: PLACEHOLDERS[m[1]], t) for t in script]
        script = list(dict.fromkeys(script))
        here = self.root / "here"
        shutil.rmtree(here, ignore_errors=True)
        here.mkdir()
        for pipe in ("ask", "answer"):
            os.mkfifo(here / pipe)
        bash = subprocess.Popen(
            ["bash", "-c", CLIENT + "\n".join(script)], cwd=folder, text=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
            env={**os.environ, "HERE": str(here)},
        )  # fmt: skip
        failures, names = [], {}
        while (asked := (here / "ask").read_bytes().decode().split("\0")[:-1]) != ["end"]:
            where, python_path, program, *arguments = asked
            with pytest.MonkeyPatch.context() as patch:
                patch.chdir(where)
                if program == "python":
                    failure, printed = self._python(found[int(arguments[0])].text, names), ""
                else:
                    failure, printed = self._space_robot(page, arguments, python_path, patch)
            failures += [failure] * bool(failure)
            (here / "printed").write_text(printed)
            (here / "answer").write_text("done\n")
        told = bash.communicate()[1]
        return failures + [told] * bool(bash.returncode)

    def _python(self, code: str, names: dict[str, Any]) -> str:
        try:
            exec(compile(code, "page", "exec"), names)
        except Exception:
            return code + traceback.format_exc()
        return ""

    def _space_robot(
        self, page: Path, arguments: list[str], python_path: str, patch: pytest.MonkeyPatch
    ) -> tuple[str, str]:
        line = " ".join(arguments)
        times = [float(t) for text in re.findall(TIMES, line) for t in text.split("-") if t]
        lasts = max([LASTS_S.get(name(page), 0.0), *times]) + 0.5
        added = next((o for p, o in SHORTER.items() if re.match(p + r"\b", line)), "")
        added = "" if "--help" in line or "--fault list" in line else added.format(lasts)
        call = (*arguments, *added.split())
        if call in self.seen:
            return "", ""
        patch.setenv("PYTHONPATH", python_path)
        for path in python_path.split(os.pathsep):
            patch.syspath_prepend(Path(path).resolve())
        import time; t0=os.times(); before = set(sys.modules)
        ended = space_robot_here(*call)
        t1=os.times(); print(f"{t1.user+t1.system-t0.user-t0.system:.2f}+{t1.children_user+t1.children_system-t0.children_user-t0.children_system:.2f} {t1.elapsed-t0.elapsed:.1f}", name(page), ' '.join(call), flush=True)
        for module in set(sys.modules) - before:
            file = getattr(sys.modules[module], "__file__", None)
            if file and Path(file).is_relative_to(self.root):
                del sys.modules[module]
        if not any(Path(part).exists() for word in call for part in re.split("[=@:]", word)):
            self.seen.add(call)
        expected = next((c for p, c in EXIT_CODES.items() if re.match(p + r"\b", line)), 0)
        if ended.returncode == expected:
            return "", ended.stdout
        return f"space-robot {' '.join(call)}: {ended.returncode}\n{ended.stderr[-1500:]}", ""
