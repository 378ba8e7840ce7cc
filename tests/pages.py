"""Pages of the documentation taken apart: what a reader would type, in the page's order."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from paths import DOCS, ROOT

TOPICS = sorted((ROOT / "space_robot/help").glob("*.md"))
"""What `space-robot help` shows."""
PAGES = [
    page
    for page in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.rglob("*.md")), *TOPICS)
    if page.name != "tutorial.md"  # test_tutorial.py has it whole
]
SHELL = {"", "bash", "console", "sh"}
"""Languages of fenced blocks that may hold commands."""
BEGINNING = re.compile(r"(?:\$ )?((?:[A-Z_]+=\S* )*([\w./-]+).*)")
"""Of a line: the command without its prompt, and the command's first word."""
COMMANDS = (
    ". cp dask export for git make mkdir nft pip python plotjuggler python3 rerun ros2 rviz2 sed "
    "source space-robot sudo"
)
"""First words of commands; all other indented lines are what one prints."""
INLINE = re.compile(r"`(space-robot [^`]*\s(?:-|\S*[./@=])[^`]*)`")
"""A whole command within a sentence: one with an option or a file. Others are names."""
FILE = re.compile(r"# ([\w/]+\.(?:py|yaml))\n")
"""First line of a snippet that is a file."""


@dataclass(frozen=True)
class Item:
    """A command, or a snippet in a language."""

    kind: str
    """``shell``, or the language of a fenced block."""
    text: str
    line: int


def name(page: Path) -> str:
    """The page's path in the checkout."""
    return page.relative_to(ROOT).as_posix()


def items(page: Path) -> Iterator[Item]:
    """Commands and snippets of a page, from its top to its end."""
    lines = iter(enumerate(page.read_text("utf-8").splitlines(), 1))
    for number, line in lines:
        if line.startswith("```"):
            language, block = line.strip("`").strip(), []
            for _, inner in lines:
                if inner.startswith("```"):
                    break
                block.append(inner)
            if language in SHELL:
                code = iter(enumerate(block, number + 1))
                for at, inner in code:
                    yield from command(inner, at, code)
            else:
                yield Item(language, "\n".join(block) + "\n", number)
        elif line.startswith("    "):
            yield from command(line, number, lines)
        else:
            for text in INLINE.findall(line):
                yield Item("shell", text, number)


def command(line: str, number: int, following: Iterator[tuple[int, str]]) -> Iterator[Item]:
    """The command that begins on a line, if one does: with the lines on which it goes on."""
    found = BEGINNING.fullmatch(line.strip())
    if found is None or found[2] not in COMMANDS.split():
        return
    text = found[1]
    while text.endswith("\\") or (found[2] == "for" and not text.endswith("done")):
        text += "\n" + next(following)[1].strip()
    yield Item("shell", text, number)


def files(page: Path) -> dict[str, str]:
    """Snippets of a page that name the file they are."""
    return {
        found[1]: item.text
        for item in items(page)
        if item.kind in {"python", "yaml"} and (found := FILE.match(item.text))
    }
