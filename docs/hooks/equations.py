"""Equations become MathML when the site is made, which browsers draw by themselves."""

from __future__ import annotations

import html
import re
from importlib import resources

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

EQUATION = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<tex>.*?)\\[)\]]</(?P=tag)>', re.DOTALL
)
BAR = re.compile(r'<mo[^>]*>(?:\||&#x0007C;)</mo>')
FONT = "STIXTwoMath-Regular.ttf"


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add a font with all that equations need, for those whose system has none."""
    font = str(resources.files("ziamath") / "fonts" / FONT)
    files.append(File.generated(config, f"assets/{FONT}", abs_src_path=font))
    return files


def on_page_content(html: str, page: Page, **_: object) -> str:
    """Draw what Markdown has left as LaTeX."""
    return EQUATION.sub(_mathml, html)


def _mathml(match: re.Match[str]) -> str:
    display = "block" if match["tag"] == "div" else "inline"
    made = convert(html.unescape(match["tex"]).strip(), display=display)
    return BAR.sub('<mo stretchy="false" lspace="0" rspace="0">|</mo>', made)
