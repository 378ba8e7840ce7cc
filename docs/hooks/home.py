"""The first page begins as the repository's README does."""

from __future__ import annotations

from pathlib import Path

import links
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import Files
from mkdocs.structure.pages import Page

INDEX = "README.md"
END = "\n## What you see"


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Put README's beginning before the list of documents, whose title becomes a heading."""
    if page.file.src_uri != INDEX:
        return markdown
    page.meta["hide"] = ["navigation"]
    readme = Path(config.config_file_path).with_name("README.md").read_text("utf-8")
    beginning = links.rewritten(readme.partition(END)[0], "README.md", INDEX, files)
    return f"{beginning}\n#{markdown}"
