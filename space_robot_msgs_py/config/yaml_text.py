"""Strict reading of YAML: limits of size and nesting, and line numbers in errors.

The types are those of ROS parameter files: ``1e3`` is a number, a date is a text.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Hashable, Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO

import yaml

from ..errors import InputError
from .text import MOST_COMPARED, nearest, printable, shortened

try:
    from yaml import CSafeLoader as SafeLoader  # four times as fast
except ImportError:  # PyYAML was built without libyaml
    from yaml import SafeLoader  # type: ignore[assignment]

LONGEST_NAME = 250
"""Maximum displayed characters of a file's name in errors."""
LARGEST_FILE = 16 * 2**20
"""Largest size of a file, bytes."""
DEEPEST = 64
"""Largest depth of nested lists and mappings."""
MOST_VALUES = 200_000
"""Largest number of values in a text, those repeated by aliases included."""

_FLOAT, _TIMESTAMP, _MERGE = (
    f"tag:yaml.org,2002:{kind}" for kind in ("float", "timestamp", "merge")
)
_EXPONENT = re.compile(r"^[-+]?(?:[0-9][0-9_]*(?:\.[0-9_]*)?|\.[0-9][0-9_]*)[eE][-+]?[0-9]+$")


class YamlTextError(InputError):
    """A text is not valid YAML; the message has the line number."""


def read_file(path: Path) -> str:
    """Read the text of a regular file; not of pipes and devices, which may be endless."""
    with _opened(path) as file:
        data = file.read(LARGEST_FILE + 1)
        if len(data) > LARGEST_FILE:
            raise InputError(f"{path}: cannot be read (more than {LARGEST_FILE >> 20} MiB)")
        return data.decode("utf-8")


def check_readable(path: Path) -> None:
    """Check that a file can be read; an `InputError` has the reason."""
    with _opened(path):
        pass


@contextmanager
def _opened(path: Path) -> Iterator[BinaryIO]:
    try:
        # opening a pipe must not block
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        try:
            if not stat.S_ISREG(os.fstat(descriptor).st_mode):
                raise InputError(f"{_shown(path)}: not a file")
            with os.fdopen(descriptor, "rb", closefd=False) as file:
                yield file
        finally:
            os.close(descriptor)
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f"{_shown(path)}: no such file{_similar_file(path)}") from None
    except OSError as error:
        raise InputError(f"{_shown(path)}: cannot be read ({error.strerror})") from None
    except ValueError as error:  # not UTF-8, or an invalid file name
        raise InputError(f"{_shown(path)}: cannot be read ({error})") from None


def _shown(path: Path) -> str:
    return shortened(str(path) if str(path).isprintable() else repr(str(path)), LONGEST_NAME)


def _similar_file(path: Path) -> str:
    try:
        with os.scandir(path.parent) as entries:
            names = sorted(entry.name for entry in islice(entries, MOST_COMPARED))
    except (OSError, ValueError):
        return ""
    near = nearest(path.name, names)[:1]
    return f" (did you mean {printable(str(path.with_name(near[0])))}?)" if near else ""


def is_folder(path: Path) -> bool:
    """Return True if a folder exists; False also for an invalid name."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


def parse_yaml(text: str) -> Any:
    """Return the value of a YAML text.

    Raises:
        YamlTextError: not YAML, a repeated key, or a limit is exceeded.
    """
    try:
        _check_size(text)
        return yaml.load(text, Loader=_Loader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f"line {mark.line + 1}: " if mark else ""
        problem = " ".join(str(getattr(error, "problem", None) or error).split())
        raise YamlTextError(f"{line}not YAML ({problem})") from None
    except ValueError as error:  # invalid characters
        raise YamlTextError(f"not YAML ({error})") from None


def _check_size(text: str) -> None:
    """Refuse nesting and aliases that would exhaust the stack or the memory once they are built."""
    sizes: dict[str | None, int] = {}
    open_collections: list[tuple[str | None, int]] = []
    size = 0
    for event in yaml.parse(text, Loader=_Loader):
        if isinstance(event, yaml.CollectionEndEvent):
            anchor, before = open_collections.pop()
            sizes[anchor] = size - before
        elif isinstance(event, yaml.AliasEvent):
            if any(anchor == event.anchor for anchor, _ in open_collections):
                raise _refused(f"the alias {event.anchor!r} contains itself", event)
            size += sizes.get(event.anchor, 0)
        elif isinstance(event, yaml.NodeEvent):
            size += 1
            sizes[event.anchor] = 1
            if isinstance(event, yaml.CollectionStartEvent):
                open_collections.append((event.anchor, size))
        if size > MOST_VALUES:
            raise _refused(f"more than {MOST_VALUES} values", event)
        if len(open_collections) > DEEPEST:
            raise _refused(f"nested deeper than {DEEPEST} levels", event)


def _refused(problem: str, place: Any) -> yaml.YAMLError:
    return yaml.constructor.ConstructorError(problem=problem, problem_mark=place.start_mark)


class _Loader(SafeLoader):
    """Loader that rejects repeated keys, and values that do not match their tag."""

    yaml_implicit_resolvers = {  # noqa: RUF012  (a class variable, as in the base)
        first: [(tag, pattern) for tag, pattern in resolvers if tag != _TIMESTAMP]
        for first, resolvers in SafeLoader.yaml_implicit_resolvers.items()
    }

    def construct_object(self, node: Any, deep: bool = False) -> Any:
        try:
            value = super().construct_object(node, deep)
            if isinstance(value, int) and not -(2**63) <= value < 2**64:
                raise OverflowError
            return value
        except (ValueError, TypeError, LookupError, AttributeError, OverflowError):
            kind = node.tag.removeprefix("tag:yaml.org,2002:")
            value = f" {node.value[:40]!r}" if isinstance(node.value, str) else ""
            raise _refused(f"the value{value} is not of type {kind}", node) from None

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        if not isinstance(node, yaml.MappingNode):
            raise _refused("a mapping was expected", node)
        keys = set()
        for key_node, _ in node.value:
            if key_node.tag == _MERGE:
                continue
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, Hashable):
                raise _refused("a key must be a text or a number", key_node)
            if key in keys:
                raise _refused(f"the key {key!r} occurs twice", key_node)
            keys.add(key)
        mapping: dict[Any, Any] = super().construct_mapping(node, deep)
        return mapping


_Loader.add_implicit_resolver(_FLOAT, _EXPONENT, list("-+.0123456789"))
