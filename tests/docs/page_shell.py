"""A page's commands typed into a shell, one after the other, as its reader would."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from bags import entries_of, mcap_of, rosbags_bag, within
from flights import space_robot_here
from pages import Item, files, items, name
from paths import CONFIG, DATA, DOCS

SHORTER = {
    r"campaign run .*first": "--runs 12 --workers 0",  # row 11 is flown again
    # a grid of four
    r"campaign run .*(sensor_grades|tool_errors)": "--runs 4 --workers 0",
    r"campaign run .*base_actuators": "--runs 6 --workers 0",  # a grid of six
    r"campaign run .*ets_vii": "--runs 6 --workers 0",  # grids of six and of three
    r"campaign run .*noise": "--runs 2 --workers 0",  # a grid of two
    r"campaign run": "--runs 1 --workers 0",
    r"campaign report (?!.*--metric)": "--metric attitude.rms",
    r"export": "--acceptance-seconds 0.3",
    r"gains check(?! .*(--controller|--plant-robot|--robot))": "--controller tde_stc",
    r"fly .*--scenario": "--help",  # a scenario is read before
    r"fly .*(kill|stop)_": "--duration {}",
    r"fly": "--composed --duration 0.2",
    r"choose": "--law ctc --law pd --evaluations 2 --runs 2 --duration 1.1 --ripple 10 --workers 0 "
    "--actuators wheels",
    r"gains tune --law": "--evaluations 8 --ripple 10",
    r"new .*(--(force|passive)|geared)": "--help",  # tests/laboratory/cli/test_new_command.py
    r"new (robot )?\S+\.(urdf|yaml)": "--law ctc --law pd --evaluations 1 --runs 2 --workers 0",
    r"reproduce": "--only tde_stc/1 --duration 0.2 --jobs 1",
    r"simulate": "--duration {}",
    r"stability": "--duration 2",
    r"view": "--no-open",
}
"""What is added to a command that begins so; {} is half a second after the last time in it."""
TIME = re.compile(r"(@|--(?:swap|from|to)\0)(\d[\d.]*)(?:(-)(\d[\d.]*))?")
SOONER = 20.0
"""What times of faults, swaps, events and parts are divided by, so flights are short."""
LASTS_S = {"docs/manual/analysis.md": 16.0, "docs/manual/view.md": 15.2}
"""Flights of pages that look at a later time."""
OF_GRAPHS = re.compile(
    r"fly .*(--(composed|domain|realtime|restart-controller|scenario)|list|\w:[A-Z])"
)
"""Commands that need a graph. All other options of `fly` are those of `simulate`, which flies the
same bits (tests/laboratory/flight/graph holds it to that) and is asked in its place."""
LOOKING = re.compile(r"(analyze|campaign report|gains check|plan|stability|view) (?!.*--(csv|out))")
"""Commands whose files no other command reads; pages repeat them."""
PLACEHOLDERS = {
    "COMMAND": "fly",
    "D": "2",
    "F": "100",
    "FOLDER": "flights/one",
    "LAW": "ctc",
    "LINK": "upper_arm",
    "MODE": "filtered",
    "NAME": "ets_vii",
    "S": "tactical",
    "SIGMA": "1e-4",
}
"""What stands for a word in capitals."""
EXIT_CODES = {
    r"diff flights/one flights/two": 1,
    r"gains check --(plant-robot|robot paper_geared)": 1,
    r"replay .*k_1": 1,
    r"robot ETSVII.urdf$": 2,
    r"simulate --controller ctc --gains printed$": 1,
}
"""Of commands that do not end with 0, as their pages say."""
NOT_RUN = {
    r"\. .venv/bin/activate": "the tests have an environment",
    r"(ROS_DOMAIN_ID=7 )?(ros2|rviz2|plotjuggler)\b": "ROS 2 from apt",
    r"(source|python -m colcon|export ROS_|for node in)\b": "ROS 2 from apt",
    r"overrides=|sed -E ": "ROS 2 from apt: test_topics.py runs the sed",
    r"rerun\b": "a viewer of 100 MB",
    r"(git|mkdir -p ws|cp TraceableRobotModels|pip|python3 -m venv|sudo apt)\b": "from elsewhere",
    r"python docs/random_arms.py": "300 flights and 200 gain sets",
    r"python docs/flown": "its tables: tests/test_flown_pages.py",
    r"make\b|BAG_FUZZ_EXAMPLES": "runs these tests, or for long",
    r"nft\b": "the machine's firewall",
    r".*--device gpu|python tools/gpu_check.py": "a GPU: tests/laboratory/gpu",
    r"dask\b|.*--scheduler": "a cluster: tests/laboratory/processes/test_pool.py has one",
    r"python docs/law_league.py": "eleven laws, for some hours",
    r"python docs/ets_vii_tables.py": "450 flights: test_ets_vii.py flies some of them",
    r"python docs/campaign_statistics.py": "a minute: test_verdicts.py compares its table",
    r"python docs/view_picture.py": "a browser: tests/laboratory/view has one",
    r"space-robot (sim|fly --paused)\b": "two terminals: test_pause_and_step.py flies and steps",
    r"space-robot fly --without\b": "two terminals: test_others_in_the_domain.py flies",
    r"ROS_DOMAIN_ID=7 python examples": "two terminals: test_examples.py runs it",
    r"space-robot ground\b|npm\b": "never ends; a browser: tests/laboratory/ground has one",
    r"space-robot fly .*--tele": "two terminals: tests/laboratory/flight/graph flies",
    r"space-robot trace( --out| *#|$)": "all 30, a minute: tests/laboratory/trace verifies them",
    r"space-robot goto\b": "two terminals: test_pause_and_step.py flies and moves",
    r"space-robot analyze flights/tde_stc_case1_": "printed at a flight's end",
    r"space-robot view flights/mine": "a flight of the reader's robot: tests/laboratory/view",
    r"space-robot view (--live|.*\.webp)": "never ends; a browser: tests/laboratory/view",
}
"""Commands that are not run, and why."""
PYTHON_ELSEWHERE = {
    "README.md": "tests/laboratory/api/test_python_manual.py",
    "docs/explanation/errata.md": "tests/test_docs.py",
    "docs/manual/python.md": "tests/laboratory/api/test_python_manual.py",
}
"""Pages whose snippets another test runs."""


def _bag_of_others(folder: Path) -> None:
    """One flight, recorded by someone whose joint states have another name."""
    space_robot_here("simulate", "--duration", "0.1", "--bag", str(folder / "ours"))
    entries = [
        (n.replace("/joint_states", "/arm/joint_states"), *rest)
        for n, *rest in entries_of(folder / "ours")
    ]
    (folder / "theirs").mkdir()
    mcap_of(folder / "theirs/x.mcap", entries)


def _bag_of_two(folder: Path) -> None:
    """Two robots' flights in one bag, as ROS's recorder makes it."""
    space_robot_here("simulate", "--duration", "0.1", "--bag", str(folder / "ours"))
    entries = entries_of(folder / "ours")
    both = sorted([*within("/sat1", entries), *within("/sat2", entries)], key=lambda e: e[2])
    (folder / "flights").mkdir()
    rosbags_bag(folder / "flights/both", both, lambda writer: None)


def _urdf(folder: Path) -> None:
    for file in ("my.urdf", "my.xacro"):
        shutil.copy(DATA / "docs.urdf", folder / file)
    shutil.copy(DATA / "ground_arm.urdf", folder / "arm.urdf")


def _urdf_with_a_defect(folder: Path) -> None:
    """And the law of the page on laws."""
    text = (DATA / "docs.urdf").read_text("utf-8")
    _urdf(folder)
    (folder / "ETSVII.urdf").write_text(text.replace('izz="2"', 'izz="9"'))
    (folder / "my_laws.py").write_text(files(DOCS / "manual/own_law.md")["my_laws.py"])


def _slow_gains(folder: Path) -> None:
    (folder / "slow").mkdir()
    gains = {"ctc": {"k_p": [9.0], "k_d": [6.0]}}
    content = {"controller_node": {"ros__parameters": gains}}
    (folder / "slow/ctc.yaml").write_text(yaml.safe_dump(content))


GIVEN: dict[str, Callable[[Path], None]] = {
    "space_robot/help/own-robot.md": _urdf,
    "README.md": _urdf,
    "docs/recipes.md": _urdf,
    "docs/manual/analysis.md": _bag_of_others,
    "docs/manual/namespaces.md": _bag_of_two,
    "docs/manual/urdf.md": _urdf,
    "docs/measurements/reality.md": _slow_gains,
    "docs/your_robot.md": _urdf_with_a_defect,
}
"""Makes the files that a page takes for granted."""

CLIENT = r"""
set -euo pipefail
trap 'printf "end\0" > "$PIPES/ask"' EXIT
ask() {
    printf '%s\0' "$PWD" "${PYTHONPATH-}" "$@" > "$PIPES/ask"
    read -r answer < "$PIPES/answer"
    cat "$PIPES/printed"
}
space-robot() { ask space-robot "$@"; }
python() { "$PYTHON" "$@"; }
"""
"""`space-robot` asks the test's process, which has imported all of it already."""


def is_run(item: Item) -> bool:
    """Whether it is a command that is run here."""
    return item.kind == "shell" and not any(re.match(p, item.text) for p in NOT_RUN)


def needs_graph(page: Path) -> bool:
    """Whether a command of the page starts a node, or many."""
    return any(
        is_run(item) and re.search(rf"space-robot ({OF_GRAPHS.pattern})", item.text)
        for item in items(page)
    )


class PageShell:
    """Runs pages, each in a folder of its own."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self._new: dict[str, Path] = {}
        """Folders that `space-robot new` made of the URDF of the documentation, by its options:
        it flies all laws, and pages repeat it."""
        self._seen: dict[tuple[str, ...], subprocess.CompletedProcess[str]] = {}

    def run(self, page: Path) -> list[str]:
        """Run commands and snippets from top to end; return what failed."""
        folder = self._folder(page)
        pipes = folder.with_suffix(".pipes")
        pipes.mkdir()
        for pipe in ("ask", "answer"):
            os.mkfifo(pipes / pipe)
        bash = subprocess.Popen(
            ["bash", "-c", "\n".join([CLIENT, *self._script(page)])],
            cwd=folder,
            text=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            env={**os.environ, "PIPES": str(pipes), "PYTHON": sys.executable},
        )
        failures: list[str] = []
        names: dict[str, Any] = {}
        while (asked := (pipes / "ask").read_bytes().decode().split("\0")[:-1]) != ["end"]:
            with pytest.MonkeyPatch.context() as patch:
                patch.chdir(asked[0])
                if asked[2] == "python":
                    printed, failure = "", self._python(asked[3], names)
                else:
                    self._find_modules(asked[1], patch)
                    printed, failure = self._space_robot(page, asked[3:])
            failures += [failure] if failure else []
            (pipes / "printed").write_text(printed)
            (pipes / "answer").write_text("\n")
        told = bash.communicate()[1]
        return failures + ([told] if bash.returncode else [])

    def _folder(self, page: Path) -> Path:
        """Where the page's reader is: the files that it shows are there, and those it has not."""
        folder = self.root / name(page).replace("/", "_")
        folder.mkdir()
        (folder / "config").symlink_to(CONFIG)
        for path, text in files(page).items():
            (folder / path).parent.mkdir(exist_ok=True)
            (folder / path).write_text(text)
        if name(page) in GIVEN:
            GIVEN[name(page)](folder)
        return folder

    def _script(self, page: Path) -> list[str]:
        """The page's lines, each once."""
        words = re.compile(rf"\b({'|'.join(PLACEHOLDERS)})\b")
        found = [
            words.sub(lambda m: PLACEHOLDERS[m[1]], re.sub(r" +#.*", "", item.text))
            if is_run(item)
            else f"ask python {shlex.quote(item.text)}"
            for item in items(page)
            if is_run(item) or (item.kind == "python" and name(page) not in PYTHON_ELSEWHERE)
        ]
        return list(dict.fromkeys(found))

    def _python(self, code: str, names: dict[str, Any]) -> str:
        file = Path("snippet.py").resolve()  # kernels are cached beside their file
        file.write_text(code)
        try:
            exec(compile(code, str(file), "exec"), names)
        except Exception:
            return code + traceback.format_exc()
        return ""

    def _find_modules(self, python_path: str, patch: pytest.MonkeyPatch) -> None:
        """Let modules of the page's folder be imported, and no older ones of their names."""
        patch.setenv("PYTHONPATH", python_path)
        for path in filter(None, python_path.split(os.pathsep)):
            patch.syspath_prepend(Path(path).resolve())
        for module, found in list(sys.modules.items()):
            if Path(getattr(found, "__file__", None) or "/").is_relative_to(self.root):
                del sys.modules[module]

    def _space_robot(self, page: Path, given: list[str]) -> tuple[str, str]:
        """What the command printed, and how it failed."""
        command = shorter(given, LASTS_S.get(name(page), 0.0))
        ended = self._made_again(command) or space_robot_here(*command)
        line = " ".join(given)
        wanted = next((code for p, code in EXIT_CODES.items() if re.match(p, line)), 0)
        if ended.returncode == wanted:
            return ended.stdout, ""
        told = f"exit code {ended.returncode}, not {wanted}\n{ended.stderr[-1500:]}"
        return "", f"space-robot {line}\n(run as {' '.join(command)}): {told}"

    def _made_again(self, command: tuple[str, ...]) -> subprocess.CompletedProcess[str] | None:
        """A copy of a robot's folder made before; the first time it is made for the copies.

        What only looks, another page has seen.
        """
        if LOOKING.match(" ".join(command)):
            if command not in self._seen:
                self._seen[command] = space_robot_here(*command)
            return self._seen[command]
        if command[:2] != ("new", "my.urdf") or "--help" in command:
            return None
        options = " ".join(command)
        folder = command[command.index("--out") + 1]
        if (kept := self._new.get(options)) is None:
            ended = space_robot_here(*command)
            self._new[options] = self.root / f"new{len(self._new)}"
            shutil.copytree(folder, self._new[options])
            return ended
        shutil.copytree(kept, folder)
        return subprocess.CompletedProcess(command, 0, "", "")


def shorter(given: list[str], lasts_s: float) -> tuple[str, ...]:
    """The command as it is run: with its flights cut short."""
    command = list(given)
    if given[0] == "fly" and "--help" not in given and not OF_GRAPHS.match(" ".join(given)):
        command[0] = "simulate"
    if given[:2] == ["campaign", "run"]:
        command[2] = short_campaign(given[2])
    if "--help" in given or "list" in given:
        return tuple(command)
    times = [lasts_s / SOONER]

    def sooner(found: re.Match[str]) -> str:
        before, *rest = found.groups(default="")
        times.extend(float(text) / SOONER for text in rest[::2] if text)
        return before + "-".join(f"{float(text) / SOONER:g}" for text in rest[::2] if text)

    command = TIME.sub(sooner, "\0".join(command)).split("\0")
    added = next((a for p, a in SHORTER.items() if re.match(p, " ".join(command))), "")
    return (*command, *added.format(f"{max(times) + 0.5:g}").split())


def short_campaign(file: str) -> str:
    """A copy of a campaign whose flights last half a second; what is required, from their start."""
    path = Path(file) if file.endswith(".yaml") else CONFIG / f"campaigns/{file}.yaml"
    content = yaml.safe_load(path.read_text("utf-8"))
    content.setdefault("scenario", {})["duration"] = 0.5
    for requirement in content.get("require", {}).values():
        requirement.pop("from_s", None)
    Path("short").mkdir(exist_ok=True)
    copy = Path("short") / path.name
    copy.write_text(yaml.safe_dump(content, sort_keys=False))
    return str(copy)
