"""What the documents name exists: functions, files, commands and options."""

from __future__ import annotations

import json
import re
import runpy
import shlex
from pathlib import Path
from pkgutil import resolve_name
from xml.etree import ElementTree

import click
import pytest
import yaml
from paths import DOCS, ROOT

from space_robot.cli.main import cli
from space_robot.flight.graph.node_names import LISTENERS
from space_robot_msgs_py import topics

DOCUMENTS = [
    *(ROOT / "README.md", ROOT / "CONTRIBUTING.md"),
    *sorted(DOCS.rglob("*.md")),
    *sorted((ROOT / "space_robot/help").glob("*.md")),
]
PREFIXES = (
    "",
    "space_robot.",
    "space_robot_control.",
    "space_robot_model.",
    "space_robot_msgs_py.",
    "space_robot_sim.",
    "space_robot_model.dynamics.",
)
WITHOUT_PICTURE = {
    "tables and lists to look things up": (
        "README compare recipes reference/faults reference/metrics reference/parameters "
        "reference/topics manual/bags manual/campaign_variables measurements/performance "
        "measurements/reality"
    ),
    "steps and commands": (
        "manual/cluster manual/flight_code manual/frameworks manual/in_flight manual/installation "
        "manual/launch manual/namespaces manual/replay manual/requirements manual/ros "
        "manual/security manual/urdf manual/viewers"
    ),
    "about code, which it shows, or numbers of a few runs": (
        "explanation/gpu explanation/kernels explanation/one_law_three_times explanation/same_bits"
    ),
}
"""Pages by the reason why they have none."""
PICTURE = re.compile(r"!\[([^\]]*)\]\(([^)]+)\)")
DOTTED = re.compile(r"`([A-Za-z_]\w*(?:\.\w+)+)`")
COMMAND = re.compile(r"space-robot ((?:[a-z]+)\b[^`;|#\n]*)")


def exists(name: str) -> bool:
    """Whether there is something of a dotted name, whole or below one of the packages."""
    for prefix in PREFIXES:
        try:
            resolve_name(prefix + name)
        except (ImportError, AttributeError):
            continue
        return True
    return False


def test_functions_named_in_the_theory_exist() -> None:
    names = sorted(set(DOTTED.findall((ROOT / "docs/explanation/theory.md").read_text("utf-8"))))
    assert len(names) > 20
    assert not [name for name in names if not exists(name)]


def test_snippets_of_the_errata_run(capsys: pytest.CaptureFixture[str]) -> None:
    """And print the numbers that stand below them."""
    text = (ROOT / "docs/explanation/errata.md").read_text("utf-8")
    for snippet in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(snippet, {})
    printed = capsys.readouterr().out
    for number in ("0.0106599", "22857.1428", "-14545.4545"):
        assert number in printed
    for law in ("TDE-STC", "TDE-TSMC", "TDE-SMC"):
        (row,) = re.findall(rf"^\| {law} \|(.*)\|$", text, re.MULTILINE)
        name = law.lower().replace("-", "_")
        delays = " ".join(re.findall(rf"^{name} (.*)$", printed, re.MULTILINE))
        assert re.findall(r"[\d.]+", row) == re.findall(r"[\d.]+(?= ms)", delays)


def test_the_validation_page_has_the_numbers_of_its_last_run() -> None:
    program = runpy.run_path(str(ROOT / "docs/validation"))
    page, numbers = (program[name].read_text("utf-8") for name in ("PAGE", "NUMBERS"))
    rows = json.loads(numbers)["rows"]
    assert program["written"](page, json.loads(numbers)) == page, "run `make validation`"
    assert len(rows) > 20
    assert all(row["difference"] <= row["limit"] for row in rows)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda p: p.name)
def test_links_lead_to_files_and_those_named_with_their_folder_exist(document: Path) -> None:
    text = document.read_text("utf-8")
    for target in re.findall(r"\]\(([^)]+)\)", text):
        if "://" not in target:
            assert (document.parent / target.split("#")[0]).exists(), target
    for name in re.findall(r"`((?:space_robot_\w+|tests|config|docs)/[\w./]+)`", text):
        assert (ROOT / name).exists(), name


def test_every_page_has_a_picture_or_a_reason_to_have_none() -> None:
    pages = {path.relative_to(DOCS).with_suffix("").as_posix() for path in DOCS.rglob("*.md")}
    reasoned = {page for group in WITHOUT_PICTURE.values() for page in group.split()}
    assert reasoned <= pages
    for page in pages - reasoned:
        text = (DOCS / f"{page}.md").read_text("utf-8")
        assert PICTURE.search(text) or "```mermaid" in text, page


def test_pictures_have_a_text_for_those_who_do_not_see_them_and_a_caption() -> None:
    for page in DOCS.rglob("*.md"):
        text = page.read_text("utf-8")
        for alternative, file in PICTURE.findall(text):
            assert alternative, (page, file)
            if file.endswith(".svg"):
                assert re.search(rf"\({re.escape(file)}\)\n\n\*[^\n]+\*\n", text), (page, file)


def test_every_picture_of_the_folder_is_drawn_by_a_script_and_shown_by_a_page() -> None:
    folder = DOCS / "pictures"
    scripts = "".join(path.read_text("utf-8") for path in folder.glob("*.py"))
    drawn = set(re.findall(r"^@theme\.picture\ndef (\w+)", scripts, re.MULTILINE))
    assert drawn == {path.stem for path in folder.glob("*.svg")}
    shown = "".join(path.read_text("utf-8") for path in DOCS.rglob("*.md"))
    assert drawn == set(re.findall(r"pictures/(\w+)\.svg\)", shown))


def test_pictures_are_small_and_follow_the_scheme_of_the_reader() -> None:
    for path in (DOCS / "pictures").glob("*.svg"):
        text = path.read_text("utf-8")
        assert len(text.encode()) < 80_000, path
        assert "@media (prefers-color-scheme:dark){svg{--ink:" in text
        colours = re.findall(r"(?:fill|stroke): ([^;\"]+)", text)
        assert {c for c in colours if not c.startswith("var(--")} <= {"none"}, path
        assert "<metadata" not in text


def test_the_page_on_eleven_laws_has_what_was_flown() -> None:
    text = (ROOT / "docs/law_league.md").read_text("utf-8")
    renewed = runpy.run_path(str(ROOT / "docs/law_league.py"))["renewed"]
    assert renewed(text, ROOT / "docs/law_league") == text
    assert text.count("| `tde_tsmc` | ") == 2


def test_the_comparison_has_the_figures_of_the_measurements() -> None:
    text = (ROOT / "docs/compare.md").read_text("utf-8")
    measured = (ROOT / "docs/measurements/performance.md").read_text("utf-8")
    (row,) = re.findall(r"^\| us per step .*$", text, re.MULTILINE)
    figures = re.findall(r"\d+\.\d+", row)
    assert len(figures) == 4
    for figure in figures:
        assert re.search(rf"\| {re.escape(figure)}\b", measured), figure


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda p: p.name)
def test_commands_and_options_exist(document: Path) -> None:
    for name, *words in map(str.split, COMMAND.findall(document.read_text("utf-8"))):
        command = cli.get_command(click.Context(cli), name)
        assert command is not None, f"space-robot {name}"
        if isinstance(command, click.Group) and words:
            command = command.get_command(click.Context(command), words[0])
            assert command is not None, f"space-robot {name} {words[0]}"
        known = {
            option
            for parameter in command.params
            if isinstance(parameter, click.Option)
            for option in (*parameter.opts, *parameter.secondary_opts)
        }
        for word in words:
            if word.startswith("--"):
                assert word in {*known, "--help"}, f"space-robot {name} {word}"


OF_GOALS = {topics.JOINT_STATES: ("mission_node",)}
"""Who listens, too, while a goal with tolerances is followed; nobody waits for it."""


def test_security_policy_has_one_publisher_a_topic_and_all_listeners() -> None:
    policy = ElementTree.parse(ROOT / "config/security/policy.xml")

    def nodes(access: str, topic: str) -> list[str]:
        return [
            profile.attrib["node"]
            for profile in policy.iter("profile")
            if topic in [item.text for item in profile.iterfind(f"topics[@{access}='ALLOW']/topic")]
        ]

    for topic in (*topics.RECORDED, topics.PLANT_DESCRIPTION):
        assert len(nodes("publish", topic.full_name)) == 1, topic.full_name
        awaited = {*LISTENERS[topic], *OF_GOALS.get(topic, ())}
        assert set(nodes("subscribe", topic.full_name)) == awaited, topic.full_name


def test_ros2_param_set_can_send_the_values_of_the_pages() -> None:
    """It reads them as YAML, and has no parameter for a mapping: that is a text in quotes."""
    commands = [
        shlex.split(line.partition(" && ")[0].partition("  #")[0])
        for page in DOCUMENTS
        for line in page.read_text("utf-8").splitlines()
        if line.startswith("    ros2 param set ")
    ]
    sent = {name: yaml.safe_load(value) for *_, name, value in commands}
    assert not any(isinstance(value, dict) for value in sent.values()), sent
    assert yaml.safe_load(sent["goto"])["duration"] == 8
