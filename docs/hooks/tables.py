"""The reference's tables: found first by the search, and read on a phone, a block for each row.

Every cell has the name of its column, for the style sheet.
"""

from __future__ import annotations

import re
from itertools import chain, repeat

from mkdocs.structure.pages import Page

REFERENCE = "reference/"
TABLE = re.compile(r"<table>.*?</table>", re.DOTALL)
HEAD = re.compile(r"<th>(.*?)</th>")
ROW = re.compile(r"<tr>.*?</tr>", re.DOTALL)
CELL = re.compile(r"<td>")


BOOST = 5.0
"""Of the pages in the search: who types a parameter's name looks for its line."""


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Let the search list the tables first."""
    if is_table(page):
        page.meta["search"] = {"boost": BOOST}
    return markdown


def on_page_content(html: str, page: Page, **_: object) -> str:
    """Name the cells of the tables that are made of the code."""
    if not is_table(page):
        return html
    return TABLE.sub(lambda match: f'<div class="rows">{named(match[0])}</div>', html)


def is_table(page: Page) -> bool:
    """Return True for the pages that docs/generate.py makes."""
    return page.file.src_uri.startswith(REFERENCE) and page.file.src_uri.count("/") == 1


def named(table: str) -> str:
    """Return a table whose cells have the name of their column as ``data-label``."""
    heads = HEAD.findall(table)

    def row(match: re.Match[str]) -> str:
        labels = chain(heads, repeat(""))
        return CELL.sub(lambda _: f'<td data-label="{next(labels)}">', match[0])

    return ROW.sub(row, table)
