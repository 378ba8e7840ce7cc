"""Diagrams become pictures when the site is made: a reader's browser need not fetch Mermaid."""

from __future__ import annotations

import html
import re

import mermaidx
from mkdocs.structure.pages import Page

DIAGRAM = re.compile(r'<pre class="diagram"><code>(.*?)</code></pre>', re.DOTALL)


def on_page_content(html: str, page: Page, **_: object) -> str:
    """Draw the blocks that are written for Mermaid."""
    return DIAGRAM.sub(_svg, html)


def _svg(match: re.Match[str]) -> str:
    return f'<figure class="diagram">{mermaidx.render(html.unescape(match[1])).svg()}</figure>'
