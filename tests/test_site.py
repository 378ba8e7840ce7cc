"""`make docs` makes a site without a warning, whole, that fetches nothing when it is read."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from html.parser import HTMLParser
from pathlib import Path

import pytest
from paths import DOCS, ROOT

MarkdownIt = pytest.importorskip("markdown_it").MarkdownIt
for tool in ("material", "mermaidx", "mkdocstrings", "nbconvert", "ziamath"):
    pytest.importorskip(tool)

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
PAGES = sorted(path for path in DOCS.rglob("*.md") if path != DOCS / "README.md")
OUTSIDE = re.compile(r"^(?:https?:)?//")


class Elements(HTMLParser):
    """How often each element begins in the article, and what the page loads by itself."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.counts: Counter[str] = Counter()
        self.loaded: list[str] = []
        self._in_article = False
        self.feed(page.read_text("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._in_article |= tag == "article"
        self.counts[tag] += self._in_article
        if tag != "a":
            self.loaded += [v for k, v in attrs if k in ("src", "href", "data") and v]
        self.loaded += re.findall(r"url\((.*?)\)", dict(attrs).get("style") or "")

    def handle_endtag(self, tag: str) -> None:
        self._in_article &= tag != "article"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    made = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)],
        cwd=ROOT,
        text=True,
        capture_output=True,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
    )
    said = made.stdout + made.stderr
    assert made.returncode == 0, said
    assert not re.findall(r"WARN.*|ERROR.*", said), said
    return folder


def test_every_document_is_a_page_with_all_its_lists_tables_and_blocks(site: Path) -> None:
    """Where the site's Markdown reads a text otherwise than GitHub's, one of these differs."""
    differing = {}
    for path in PAGES:
        tokens = MarkdownIt("commonmark").enable("table").parse(path.read_text("utf-8"))
        asked = Counter(token.type for token in tokens)
        drawn = Elements(site / path.relative_to(DOCS).with_suffix(".html")).counts
        blocks = asked["fence"] + asked["code_block"]
        expected = (asked["list_item_open"], asked["table_open"], asked["tr_open"], blocks)
        diagrams = sum(token.info == "mermaid" for token in tokens)
        shown = (drawn["li"], drawn["table"], drawn["tr"], drawn["pre"] + diagrams)
        if shown != expected:
            differing[path.relative_to(DOCS).as_posix()] = (shown, expected)
    assert not differing


def test_equations_and_diagrams_are_drawn(site: Path) -> None:
    text = (DOCS / "explanation/theory.md").read_text("utf-8")
    equations = re.findall(r"\$\$.+?\$\$|\$[^$]+\$", text, re.DOTALL)
    page = (site / "explanation/theory.html").read_text("utf-8")
    assert page.count('class="math"') == len(equations) > 100
    numbers = re.findall(r"\\tag\{(.*?)\}", text)
    assert all(f"<span>({number})</span>" in page for number in numbers)
    for html in site.rglob("*.html"):
        text = html.read_text("utf-8")
        assert "arithmatex" not in text
        assert 'class="diagram"><code>' not in text
    assert '<figure class="diagram"><svg' in (site / "index.html").read_text("utf-8")


def test_commands_and_the_names_for_users_are_there(site: Path) -> None:
    commands = (site / "reference/commands.html").read_text("utf-8")
    assert '<h3 id="campaign-run">' in commands
    assert "--restart-controller" in commands
    names = (site / "reference/api/index.html").read_text("utf-8")
    for name in ("space_robot.Scenario", "space_robot.load_bag"):
        assert f'id="{name}"' in names, name
    law = (site / "reference/api/space_robot_control/laws.html").read_text("utf-8")
    assert law.count('id="space_robot_control.laws.base.ControlLaw"') == 1


def test_links_to_sources_lead_to_pages_of_them(site: Path) -> None:
    page = (site / "manual/campaign_variables.html").read_text("utf-8")
    assert 'href="../source/config/campaigns/first.yaml.html"' in page
    shown = (site / "source/config/campaigns/first.yaml.html").read_text("utf-8")
    assert "sensors" in shown


def test_no_page_loads_anything_from_elsewhere(site: Path) -> None:
    pages = [*site.rglob("*.html")]
    assert len(pages) > len(PAGES)
    for page in pages:
        assert not [*filter(OUTSIDE.match, Elements(page).loaded)], page
    for sheet in site.rglob("*.css"):
        loaded = re.findall(
            r"url\(['\"]?(.*?)['\"]?\)|@import\s+['\"](.*?)['\"]", sheet.read_text()
        )
        assert not [url for url in map("".join, loaded) if OUTSIDE.match(url)], sheet


def test_the_search_knows_all_pages(site: Path) -> None:
    index = json.loads((site / "search/search_index.json").read_text("utf-8"))
    known = {entry["location"].split("#")[0] for entry in index["docs"]}
    assert {path.relative_to(DOCS).with_suffix(".html").as_posix() for path in PAGES} <= known


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_a_browser_without_network_reads_and_searches_it(site: Path, tmp_path: Path) -> None:
    """As files, without a server: what could not be loaded would be told on the console."""
    address = f"{(site / 'index.html').as_uri()}?q=bounded+real+lemma"
    shown = subprocess.run(
        [
            str(CHROMIUM),
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--dump-dom",
            f"--user-data-dir={tmp_path}",
            "--host-resolver-rules=MAP * ~NOTFOUND",
            "--enable-logging=stderr",
            "--virtual-time-budget=20000",
            address,
        ],
        text=True,
        capture_output=True,
        timeout=120,
        check=True,
    )
    assert not re.findall(r".*:CONSOLE.*", shown.stderr)
    (results,) = re.findall(r'<ol class="md-search-result__list".*?</ol>', shown.stdout, re.DOTALL)
    assert "explanation/theory.html" in results
