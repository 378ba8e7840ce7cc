"""The first page begins as the repository's README does."""

from __future__ import annotations

from pathlib import Path

import links
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import Files
from mkdocs.structure.pages import Page

INDEX = "README.md"
SECTIONS = ("Two commands", "Gallery")
"""Sections of the README that follow its introduction."""


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Put these parts of README before the list of documents, whose title becomes a heading."""
    if page.file.src_uri != INDEX:
        return markdown
    page.meta["hide"] = ["navigation"]
    readme = Path(config.config_file_path).with_name("README.md").read_text("utf-8")
    introduction, *sections = readme.split("\n## ")
    kept = [section for section in sections if section.startswith(SECTIONS)]
    beginning = links.rewritten("\n## ".join([introduction, *kept]), "README.md", INDEX, files)
    return f"{beginning}\n#{markdown}"
