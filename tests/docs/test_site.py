"""`make docs` makes a site without a warning, whole, that fetches nothing when it is read."""

from __future__ import annotations

import os
import re
import sys
from collections import Counter
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from command import run_program
from paths import DOCS, ROOT

MarkdownIt = pytest.importorskip("markdown_it").MarkdownIt
pytestmark = pytest.mark.docs
for tool in ("material", "mermaidx", "mkdocstrings", "nbconvert", "pandas", "viser", "ziamath"):
    pytest.importorskip(tool)

PAGES = sorted(path for path in DOCS.rglob("*.md") if path != DOCS / "README.md")
SECTIONS = re.compile(r"^(?:\*\*[^*]+\*\*.*|- .*)$", re.MULTILINE)
"""Lines of docs/README.md that the navigation is made of."""
NARROW = (
    "index.html",
    "gallery.html",
    "compare.html",
    "tutorial.html",
    "law_league.html",
    "notebooks/paper.html",
    "explanation/theory.html",
    "reference/parameters.html",
    "reference/commands.html",
    "reference/api/space_robot_control/laws.html",
)
"""Pages with wide tables, code, equations, diagrams, outputs and long names."""
OF_VISER = re.compile(
    r"^log:|GL Driver Message|GPU stall|WebGL|swiftshader|THREE\.Clock: .* deprecated",
    re.IGNORECASE,
)
"""What viser and its libraries print of themselves, also for lack of a graphics card."""
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
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1", "GALLERY_S": "0.2"}
    made = run_program(command, cwd=ROOT, env=environment)
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
    drawn = (site / "explanation/fault_handling.html").read_text("utf-8")
    assert '<figure class="diagram"><svg' in drawn


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


def test_the_navigation_has_no_page_and_no_title_twice(site: Path) -> None:
    """And what a beginner looks for is at the beginning."""
    home = (site / "index.html").read_text("utf-8")
    (bar,) = re.findall(r'<nav class="md-tabs".*?</nav>', home, re.DOTALL)
    tabs = [text.strip() for text in re.findall(r">\s*([^<>]+?)\s*</a>", bar)]
    assert tabs[:3] == ["Home", "Getting started", "Manual"]
    titles, targets = [], []
    for section in SECTIONS.findall((DOCS / "README.md").read_text("utf-8")):
        for title, target in re.findall(r"\[([^]]+)\]\(([^):#]+)\)", section):
            titles.append(title.lower())
            targets.append(target)
    assert len(set(titles)) == len(titles)
    assert len(set(targets)) == len(targets)
    beginning = (site / "your_robot.html").read_text("utf-8")
    assert re.search(r'md-tabs__item--active">\s*<a[^>]*>\s*Getting started', beginning)


def test_each_picture_of_the_gallery_leads_to_a_page_made_by_its_commands(site: Path) -> None:
    text = (DOCS / "gallery.md").read_text("utf-8")
    names = re.findall(r"\(gallery/(\w+)\.webp\)", text)
    assert len(names) == text.count("\n## ") == 8
    shown = (site / "gallery.html").read_text("utf-8")
    for name in names:
        assert (DOCS / f"gallery/{name}.webp").stat().st_size < 100_000, name
        assert f'<a href="gallery/{name}.html"><img' in shown
        assert f"src ||= 'gallery/{name}.html'" in shown
        assert 1e4 < (site / f"gallery/{name}.html").stat().st_size < 3e6, name
    flown = (site / "gallery/five_laws.html").read_text("utf-8")
    for law in re.findall(r"--controller (\w+)", text):
        assert law in flown


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Headless Chromium without a network."""
    pytest.importorskip("websockets")
    sys.path.insert(0, str(DOCS))
    from devtools import Browser, chromium

    if chromium() is None:
        pytest.skip("no Chromium")
    with Browser() as started:
        yield started


@pytest.mark.parametrize(
    ("words", "page"),
    [
        ("bounded real lemma", "explanation/theory.html"),
        ("echo_scale", "reference/parameters.html"),
        ("mass_matrix", "reference/api/index.html"),
    ],
)
def test_the_search_finds(site: Path, browser: Any, words: str, page: str) -> None:
    """As files, without a server: what could not be loaded would be told on the console."""
    tab = browser.tab()
    tab.open(f"{(site / 'index.html').as_uri()}?q={words.replace(' ', '+')}")
    results = tab.wait(
        "[...document.querySelectorAll('.md-search-result__link')].map(a => a.href).join(' ')"
    )
    assert page in results
    assert not tab.messages
    tab.shut()


def test_the_gallery_turns_without_a_message(site: Path, browser: Any) -> None:
    """A page opened within the gallery draws its flight and says nothing."""
    tab = browser.tab()
    tab.open((site / "gallery.html").as_uri())
    assert not tab.messages
    tab.value("document.querySelector('details.gallery').open = true")
    tab.wait("document.querySelector('details.gallery iframe').src.includes('gallery/case_1.html')")
    assert not complaints(tab)
    assert all(url.startswith(("file:", "data:", "blob:", "about:")) for url in tab.requests)
    tab.open((site / "gallery/case_1.html").as_uri())
    tab.wait("window.spaceRobot && spaceRobot.time() > 0")
    assert not complaints(tab)
    tab.open((site / "gallery/verdict_of_a_campaign.html").as_uri())
    assert tab.value("document.querySelectorAll('table').length")
    tab.shut()


def test_no_page_is_wider_than_a_phone(site: Path, browser: Any) -> None:
    """Tables scroll in themselves; those of the reference are one column of blocks."""
    tab = browser.tab(390, 800, is_phone=True)
    tab.ask("Network.setBlockedURLs", urls=["*search*"])  # as large as all the rest
    wide = {}
    for name in NARROW:
        tab.open((site / name).as_uri())
        if (width := tab.value("document.documentElement.scrollWidth")) > 390:
            wide[name] = width
    assert not wide
    tab.open((site / "reference/parameters.html").as_uri())
    cells = "[...document.querySelectorAll('.rows td')].map(td => td.getBoundingClientRect())"
    assert tab.value(f"{cells}.every(box => box.right <= 390)")
    size = "parseFloat(getComputedStyle(document.querySelector('.rows td')).fontSize)"
    assert tab.value(size) >= 11.0
    tab.shut()


def complaints(tab: Any) -> list[str]:
    """Messages of a page, but for those of viser."""
    return [text for text in tab.messages if not OF_VISER.search(text)]
