"""The gallery's pages are made when the site is, by the commands that it shows for each picture.

A picture becomes a link to its page. With `extra.gallery_s` above 0 flights last that long after
their last event: tests need no more.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import tempfile
from collections.abc import Iterator
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

GALLERY = "gallery.md"
SECTION = re.compile(r"^## (.+)\n((?:(?!## ).*\n?)*)", re.MULTILINE)
COMMAND = re.compile(r"^    space-robot (.+)$", re.MULTILINE)
PICTURE = re.compile(
    r"^!\[(?P<alt>.*)\]\((?P<picture>gallery/(?P<name>\w+)\.webp)\)$", re.MULTILINE
)
EVENT = re.compile(r"@([\d.]+)")
LOOK = """\
[![{alt}]({picture})](gallery/{name}.html)
{{ .gallery }}

<details class="gallery" ontoggle="this.lastElementChild.src ||= 'gallery/{name}.html'">
<summary>Turn it with the mouse, here</summary><iframe title="{alt}"></iframe></details>
"""
"""Beside the link a frame, which is empty until it is opened: eight scenes at once are slow."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Fly, and add the page of each section."""
    text = (Path(config.docs_dir) / GALLERY).read_text("utf-8")
    for name, content in pages(text, float(config.extra["gallery_s"])):
        files.append(File.generated(config, f"gallery/{name}.html", content=content))
    return files


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Let pictures lead to the pages."""
    if page.file.src_uri != GALLERY:
        return markdown
    return PICTURE.sub(lambda match: LOOK.format(**match.groupdict()), markdown)


def pages(text: str, longest_s: float = 0.0) -> Iterator[tuple[str, bytes]]:
    """Run the commands of each section; yield its picture's name and the page that they write.

    Args:
        text: of the gallery.
        longest_s: of the flights; 0: as they are.

    Raises:
        PluginError: a command failed, or a section has no picture or wrote no page.
    """
    for title, section in SECTION.findall(text):
        picture = PICTURE.search(section)
        with tempfile.TemporaryDirectory() as folder:
            for line in COMMAND.findall(section):
                run(shortened(shlex.split(line), longest_s), Path(folder))
            written = [*Path(folder).glob("*.html")]
            if picture is None or len(written) != 1:
                raise PluginError(f"{GALLERY}: {title}: one picture and one page were expected")
            yield picture["name"], written[0].read_bytes()


def shortened(words: list[str], longest_s: float) -> list[str]:
    """Return a command that opens no browser, and whose flight is no longer than needed."""
    if words[0] == "view":
        return [*words, "--no-open", *(["--rate", "2"] if longest_s else [])]
    if longest_s and words[0] == "simulate":
        last = max([0.0, *map(float, EVENT.findall(" ".join(words)))])
        return [*words, "--duration", f"{last + longest_s:g}"]
    if longest_s and words[:2] == ["campaign", "run"]:
        return [*words, "--runs", "2", "--workers", "0"]
    if longest_s and words[:2] == ["campaign", "report"]:
        return [*words, "--metric", "attitude.rms"]
    return words


def run(words: list[str], folder: Path) -> None:
    """Run a command of `space-robot` in a folder, in this process.

    Raises:
        PluginError: it failed; with what it said.
    """
    from space_robot.cli.main import main

    said, here = io.StringIO(), Path.cwd()
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            main(words)
    except SystemExit as ended:
        if ended.code:
            raise PluginError(f"space-robot {shlex.join(words)}: {said.getvalue()}") from None
    finally:
        os.chdir(here)
