"""What the pages of the documentation tell to type works, in the order of each page."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from page_shell import (
    EXIT_CODES,
    GIVEN,
    LASTS_S,
    NOT_RUN,
    PLACEHOLDERS,
    PYTHON_ELSEWHERE,
    SHORTER,
    PageShell,
    is_run,
    needs_graph,
)
from pages import FILE, PAGES, items, name

pytestmark = pytest.mark.docs


@pytest.fixture(scope="module")
def shell(tmp_path_factory: pytest.TempPathFactory) -> PageShell:
    return PageShell(tmp_path_factory.mktemp("pages"))


BY_THE_SITE = "docs/gallery.md"
"""Its commands are run where the site is made, see `test_site`."""


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=name(page), marks=[pytest.mark.ros] if needs_graph(page) else [])
        for page in PAGES
        if name(page) != BY_THE_SITE
    ],
)
def test_the_commands_of_a_page_run(page: Path, shell: PageShell) -> None:
    if needs_graph(page):
        pytest.importorskip("rclpy")
    failed = shell.run(page)
    assert not failed, "\n\n".join(failed)


def test_the_tables_of_commands_have_no_dead_entries() -> None:
    shell = [item for page in PAGES for item in items(page) if item.kind == "shell"]
    for pattern in NOT_RUN:
        assert any(re.match(pattern, item.text) for item in shell), pattern
    run = "\n".join(item.text for item in shell if is_run(item))
    for pattern in (*SHORTER, *EXIT_CODES):
        assert re.search(rf"space-robot {pattern.removesuffix('$')}", run), pattern
    for word in PLACEHOLDERS:
        assert re.search(rf"\b{word}\b", run), word
    assert {*GIVEN, *LASTS_S, *PYTHON_ELSEWHERE} <= {name(page) for page in PAGES}


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_a_command_of_the_page_reads_each_yaml_file_that_it_shows(page: Path) -> None:
    """So the file is what the page says: commands read strictly."""
    run = "\n".join(item.text for item in items(page) if is_run(item))
    for item in items(page):
        if item.kind == "yaml":
            file = FILE.match(item.text)
            assert file is not None, f"line {item.line}: begin the file with its name, # my.yaml"
            assert re.search(rf"\b{file[1]}\b|--gains {Path(file[1]).parent}\b", run), file[1]
