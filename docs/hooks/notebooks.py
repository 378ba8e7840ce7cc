"""Notebooks become pages, with the outputs that are in them."""

from __future__ import annotations

import posixpath

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from nbconvert import MarkdownExporter

SUFFIX = ".ipynb"


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Put a page and its pictures in the place of each notebook; nothing is run."""
    exporter = MarkdownExporter()
    for notebook in [file for file in files if file.src_uri.endswith(SUFFIX)]:
        text, resources = exporter.from_filename(str(notebook.abs_src_path))
        files.remove(notebook)
        folder, name = posixpath.split(notebook.src_uri.removesuffix(SUFFIX))
        for output, content in resources["outputs"].items():
            text = text.replace(f"({output})", f"({name}_{output})")
            files.append(File.generated(config, f"{folder}/{name}_{output}", content=content))
        files.append(File.generated(config, page_of(notebook.src_uri), content=text))
    return files


def page_of(uri: str) -> str:
    """Name the page of what may be a notebook."""
    return uri.removesuffix(SUFFIX) + ".md" if uri.endswith(SUFFIX) else uri
