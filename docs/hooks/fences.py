"""Words after a block's language tell the tests something; GitHub skips them, and so does this."""

from __future__ import annotations

import re

from mkdocs.structure.pages import Page

WORDS = re.compile(r"^(```+\w+) [^`\n]+$", re.MULTILINE)


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Leave the words out, with which the block would be none."""
    return WORDS.sub(r"\1", markdown)
