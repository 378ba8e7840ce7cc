"""What commands of pages have made, kept for the pages that repeat them.

Pages repeat commands: a bag that one command records is analyzed on many. Of two commands with the
same words and the same inputs only the first is run; the other is given copies of its outputs. The
inputs are the paths among the words: the commands that made them, or their content.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from subprocess import CompletedProcess
from typing import NamedTuple

PARTS = re.compile(r"[=@:,\s\[\]{}'\"]+")
"""What stands between the paths in a word of a command, and in a file."""
LARGEST_TEXT = 100_000
"""Of a file that may name others, bytes."""


class Result(NamedTuple):
    """What a command has printed and made."""

    ended: CompletedProcess[str]
    outputs: dict[str, Path]
    """Copies of the files and folders that it made, by their names in the command."""


class PageResults:
    """Results by command and inputs; commands are run in the page's folder."""

    def __init__(self, root: Path) -> None:
        """``root``: where outputs are kept."""
        self._root = root
        root.mkdir()
        self._results: dict[str, Result] = {}
        self._makers: dict[Path, str] = {}
        """Keys of the commands that made paths."""

    def key(self, command: tuple[str, ...]) -> str:
        """The command with what it reads, as a digest."""
        said = "\0".join([*command, *self._inputs(command)])
        return hashlib.sha256(said.encode()).hexdigest()

    def again(self, key: str) -> CompletedProcess[str] | None:
        """Make once more what a command has made; None if it has not been run."""
        if key not in self._results:
            return None
        ended, outputs = self._results[key]
        for part, kept in outputs.items():
            Path(part).parent.mkdir(parents=True, exist_ok=True)
            _copy(kept, Path(part))
        self._keep_makers(key, outputs)
        return ended

    def keep(
        self, key: str, command: tuple[str, ...], before: set[str], ended: CompletedProcess[str]
    ) -> None:
        """Keep what a command made that was just run; ``before``: `content` before it was.

        Not of commands that made something that they do not name.
        """
        new = content() - before
        outputs = [part for part in dict.fromkeys(_parts(command)) if os.path.normpath(part) in new]
        self._keep_makers(key, outputs)
        named = tuple(os.path.normpath(part) + "/" for part in outputs)
        folders = {str(folder) + "/" for part in named for folder in Path(part).parents}
        if all((path + "/").startswith(named) or path + "/" in folders for path in new):
            folder = self._root / key
            copies = {part: folder / str(number) for number, part in enumerate(outputs)}
            for part, kept in copies.items():
                folder.mkdir(exist_ok=True)
                _copy(Path(part), kept)
            self._results[key] = Result(ended, copies)

    def _keep_makers(self, key: str, outputs: dict[str, Path] | list[str]) -> None:
        self._makers |= {Path(part).resolve(): f"{key} {part}" for part in outputs}

    def _inputs(self, words: tuple[str, ...] | list[str], depth: int = 0) -> Iterator[str]:
        for part in _parts(words):
            path = Path(part).resolve()
            if maker := self._makers.get(path):
                yield maker
            elif path.is_relative_to(Path.cwd()):  # else of the checkout
                files = sorted(path.rglob("*")) if path.is_dir() else [path]
                for file in (file for file in files if file.is_file()):
                    data = file.read_bytes()
                    yield hashlib.sha256(data).hexdigest()
                    if depth == 0 and len(data) < LARGEST_TEXT:  # it may name others
                        yield from self._inputs(PARTS.split(data.decode("utf-8", "ignore")), 1)


def content() -> set[str]:
    """All paths in the page's folder."""
    return {os.path.relpath(path) for path in Path.cwd().rglob("*")}


def _parts(words: tuple[str, ...] | list[str]) -> Iterator[str]:
    """The paths in words that exist, but for the folders that the page is in."""
    for word in words:
        for part in dict.fromkeys([word, *PARTS.split(word)]):
            if part.strip("./") and len(part) < 200 and os.path.exists(part):
                yield part


def _copy(source: Path, target: Path) -> None:
    if source.is_dir():
        shutil.copytree(source, target, copy_function=os.link)  # commands replace whole files
    else:
        os.link(source, target)
