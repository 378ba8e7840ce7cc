"""Equations become pictures when the site is made: no script and no font is needed to read them."""

from __future__ import annotations

import re
from functools import cache
from html import unescape
from xml.etree import ElementTree

import ziafont
import ziamath
from mkdocs.structure.pages import Page

EQUATION = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<tex>.*?)\\[)\]]</(?P=tag)>', re.DOTALL
)
NUMBER = re.compile(r"\\tag\{(.*?)\}")
SIZE = 20.0
"""Of the letters, in the pictures' own unit; they are shown as large as the text around them."""
ziafont.config.precision = 2


def on_page_content(html: str, page: Page, **_: object) -> str:
    """Draw what Markdown has left as LaTeX."""
    return EQUATION.sub(lambda found: _equation(found["tex"], found["tag"] == "div"), html)


def _equation(text: str, displayed: bool) -> str:
    number = NUMBER.search(text)
    picture = _picture(" ".join(unescape(NUMBER.sub("", text)).split()), displayed)
    if not displayed:
        return picture
    label = f"<span>({number[1]})</span>" if number else ""
    return f'<div class="equation">{picture}{label}</div>'


@cache
def _picture(tex: str, displayed: bool) -> str:
    """Draw an equation that scales with the text and stands on its line."""
    bars = tex.replace(r"\lvert", "|").replace(r"\rvert", "|")  # theirs are drawn too high
    drawn = ziamath.Latex(bars, size=SIZE, color="currentColor", inline=not displayed)
    svg = drawn.svgxml()
    width, height = (float(svg.attrib.pop(side)) / SIZE for side in ("width", "height"))
    style = f"width: {width:.3f}em; height: {height:.3f}em"
    style += f"; vertical-align: {drawn.getyofst() / SIZE:.3f}em"
    svg.attrib |= {"class": "math", "role": "img", "aria-label": tex, "style": style}
    return ElementTree.tostring(svg, encoding="unicode")
