"""YAML to checked data: every error names file, key, value given and values allowed."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar, get_args

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from .errors import InputError

try:
    from yaml import CSafeLoader as SafeLoader  # four times as fast
except ImportError:  # PyYAML was built without libyaml
    from yaml import SafeLoader  # type: ignore[assignment]


class Strict(BaseModel):
    """Base of everything read from a file: unknown keys are errors, values do not change."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, coerce_numbers_to_str=True
    )


class _UniqueKeyLoader(SafeLoader):
    """Takes a key that occurs twice for the mistake it is."""

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if key in seen:
                raise yaml.constructor.ConstructorError(
                    problem=f"the key {key!r} occurs twice", problem_mark=key_node.start_mark
                )
            seen.add(key)
        mapping: dict[Any, Any] = super().construct_mapping(node, deep)
        return mapping


Schema = TypeVar("Schema", bound=BaseModel)


def read_yaml(path: Path) -> dict[str, Any]:
    """The mapping in a YAML file.

    Raises:
        InputError: the file is missing, unreadable, not YAML, or not a mapping.
    """
    try:
        content = yaml.load(path.read_text(encoding="utf-8"), Loader=_UniqueKeyLoader)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({error})") from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f"line {mark.line + 1}: " if mark else ""
        raise InputError(f"{path}: {line}not YAML ({getattr(error, 'problem', error)})") from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: a mapping was expected, got {type(content).__name__}")
    return content


def check(schema: type[Schema], content: Any, where: str) -> Schema:
    """Validate ``content``; ``where`` names its file (and enclosing key) in errors.

    Raises:
        InputError: with the first fault found, in one line.
    """
    try:
        return schema.model_validate(content)
    except ValidationError as error:
        raise InputError(_one_line(error, schema, where)) from None


def _one_line(error: ValidationError, schema: type[BaseModel], where: str) -> str:
    # a misspelt key shows as one missing and one unknown: the unknown one is the cause
    faults = sorted(
        error.errors(include_url=False), key=lambda fault: fault["type"] != "extra_forbidden"
    )
    first = faults[0]
    key = ".".join(str(part) for part in first["loc"])
    given = "" if first["type"] == "missing" else f", got {_short(first['input'])}"
    text = first["msg"].removeprefix("Value error, ")
    if first["type"] == "extra_forbidden":
        allowed = _allowed_keys(schema, first["loc"][:-1])
        text, given = f"unknown key{given}: choose one of {', '.join(allowed)}", ""
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    return f"{where}: {key + ': ' if key else ''}{text}{given}{more}"


def _allowed_keys(schema: Any, location: tuple[int | str, ...]) -> list[str]:
    """Names of the fields of the model that stands at a location within ``schema``."""
    for step in location:
        if isinstance(step, str):
            schema = schema.model_fields[step].annotation
        while not hasattr(schema, "model_fields"):  # Annotated, list
            schema = get_args(schema)[0]
    return sorted(schema.model_fields)


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


def one_of(given: str, allowed: Iterable[str], what: str, context: str = "") -> str:
    """Return ``given`` if it is allowed.

    Raises:
        InputError: naming what was given and what is allowed.
    """
    names = list(allowed)
    if given not in names:
        raise InputError(f"unknown {what} {given!r}{context}: choose one of {', '.join(names)}")
    return given
