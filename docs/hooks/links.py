"""Links from docs/ to other files of the repository lead to pages made of those files."""

from __future__ import annotations

import posixpath
import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files, InclusionLevel
from mkdocs.structure.pages import Page
from notebooks import page_of

DOCS, SHOWN = "docs", "source"
TARGET = re.compile(r"(?<=\]\()(?![a-z]+:|#)([^)#\s]+)(?=[)#])")
LANGUAGES = {".py": "python", ".urdf": "xml", ".xml": "xml", ".yaml": "yaml"}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add a page for each file outside docs/ that a page, or such a file, has a link to."""
    root = Path(config.config_file_path).parent
    pages = [file.src_uri for file in files.documentation_pages()]
    while pages:
        page = files.src_uris[pages.pop()]
        source = _in_repository(page.src_uri)
        for target in TARGET.findall(page.content_string) if source.endswith(".md") else ():
            path = posixpath.normpath(posixpath.join(posixpath.dirname(source), target))
            uri = site_path(path)
            if _is_in_docs(path) or uri in files.src_uris or not (root / path).is_file():
                continue
            files.append(
                File.generated(
                    config,
                    uri,
                    content=_page(root / path, path),
                    inclusion=InclusionLevel.NOT_IN_NAV,
                )
            )
            pages.append(uri)
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn the page's links to the repository's files into links to pages of the site."""
    return rewritten(markdown, _in_repository(page.file.src_uri), page.file.src_uri, files)


def rewritten(markdown: str, source: str, uri: str, files: Files) -> str:
    """Rewrite the links of a text that stands in a file of the repository for a page of the site.

    Args:
        markdown: the text.
        source: the file's path from the repository's top.
        uri: the page's, from the site's top, as Markdown.
        files: all of the site; links to what is not among them stay as they are.
    """

    def new_target(match: re.Match[str]) -> str:
        path = posixpath.normpath(posixpath.join(posixpath.dirname(source), match[1]))
        if site_path(path) not in files.src_uris:
            return match[1]
        return posixpath.relpath(site_path(path), posixpath.dirname(uri) or ".")

    return TARGET.sub(new_target, markdown)


def _is_in_docs(path: str) -> bool:
    return path.startswith(f"{DOCS}/")


def site_path(path: str) -> str:
    """Where a file of the repository is on the site, by both paths from the top."""
    if _is_in_docs(path):
        return page_of(path.removeprefix(f"{DOCS}/"))
    return f"{SHOWN}/{path}" if path.endswith(".md") else f"{SHOWN}/{path}.md"


def _in_repository(uri: str) -> str:
    """Which file of the repository a page shows."""
    if not uri.startswith(f"{SHOWN}/"):
        return f"{DOCS}/{uri}"
    path = uri.removeprefix(f"{SHOWN}/")
    inner = path.removesuffix(".md")
    return inner if Path(inner).suffix else path


def _page(file: Path, path: str) -> str:
    text = file.read_text("utf-8")
    if path.endswith(".md"):
        return text
    return f"# {path}\n\n````{LANGUAGES.get(file.suffix, 'text')}\n{text}````\n"
