"""The navigation is the list in docs/README.md: bold words are sections, links are their pages."""

from __future__ import annotations

import posixpath
import re
from pathlib import Path

import links
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import Files

INDEX = "README.md"
LINE = re.compile(r"^\*\*(?P<section>[^*]+)\*\*.*|^- .*", re.MULTILINE)
LINK = re.compile(r"\[([^]]+)\]\(([^):#]+)\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Set the navigation; a page that is neither in the list nor added by a hook is a warning."""
    sections: dict[str, list[dict[str, object]]] = {}
    for line in LINE.finditer((Path(config.docs_dir) / INDEX).read_text("utf-8")):
        if line["section"]:
            pages = sections.setdefault(line["section"], [])
        for title, target in LINK.findall(line[0]):
            page = links.site_path(posixpath.normpath(posixpath.join(links.DOCS, target)))
            pages.append({title[0].upper() + title[1:]: page})
    for section, added in config.extra.pop("added").items():
        sections[section] += added
    config.nav = [{"Home": INDEX}, *({title: pages} for title, pages in sections.items())]
    return files
