"""The pages whose commands start ROS processes; the others: test_pages.py."""

from __future__ import annotations

from pathlib import Path

import pytest
from page_shell import PageShell, needs_graph
from pages import PAGES, name

pytest.importorskip("rclpy")


@pytest.fixture(scope="module")
def shell(tmp_path_factory: pytest.TempPathFactory) -> PageShell:
    return PageShell(tmp_path_factory.mktemp("pages"))


@pytest.mark.parametrize("page", [page for page in PAGES if needs_graph(page)], ids=name)
def test_the_commands_of_a_page_run(page: Path, shell: PageShell) -> None:
    failed = shell.run(page)
    assert not failed, "\n\n".join(failed)
