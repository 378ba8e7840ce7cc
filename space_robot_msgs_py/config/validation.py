"""Validation of YAML data; every error names file, key, value and allowed values."""

from __future__ import annotations

import pickle
import re
from collections.abc import Iterable
from dataclasses import InitVar, is_dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from pydantic import BaseModel, ConfigDict, ValidationError, ValidationInfo, field_validator
from pydantic.fields import FieldInfo

from ..errors import InputError
from ..topics import ROOT
from .text import choices, printable
from .yaml_text import YamlTextError, parse_yaml, read_file


class StrictModel(BaseModel):
    """Base class of data from files, parameters and options, without extra keys or conversions.

    Only an integer may stand for a float, and a number for a name (``case: 1``).
    """

    # built at first use: a command needs few of all schemas
    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, strict=True, defer_build=True
    )

    @field_validator("*", mode="before")
    @classmethod
    def _meant(cls, value: Any, field: ValidationInfo) -> Any:
        if isinstance(value, tuple):  # in strict models no list
            return list(value)
        wanted = cls.model_fields[field.field_name or ""].annotation
        if wanted is str and isinstance(value, (int, float)) and not isinstance(value, bool):
            return str(value)
        return value


Schema = TypeVar("Schema", bound=BaseModel)


ON_NUMBERS = {
    *("greater_than", "greater_than_equal", "less_than", "less_than_equal"),
    *("float_type", "int_type", "byte_size", "byte_size_unit"),
}
"""Kinds of errors that show the description of their field, since it has the unit."""
UNKNOWN_KEY = ("extra_forbidden", "unexpected_keyword_argument")
NO_MAPPING = ("model_type", "dataclass_type", "named_tuple_type", "arguments_type")
MOST_KEPT = 100_000
"""Maximum length of a text with cached content, in characters."""
_NAMESPACE = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")


def read_yaml(path: Path) -> dict[str, Any]:
    """Read the mapping in a YAML file; the caller may modify it.

    Raises:
        InputError: the file is missing, unreadable, not a file, not YAML, or not a mapping.
    """
    text = read_file(path)
    try:
        content = pickle.loads(_pickled(text)) if len(text) <= MOST_KEPT else parse_yaml(text)
    except YamlTextError as error:
        raise InputError(f"{path}: {error}") from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: a mapping was expected, got {type(content).__name__}")
    return content


@lru_cache(maxsize=128)
def _pickled(text: str) -> bytes:
    # parsing is slow and files are read again and again; a pickle gives each reader its own copy
    return pickle.dumps(parse_yaml(text))


def validate(schema: type[Schema], content: Any, where: str) -> Schema:
    """Validate ``content``; ``where`` names its file (and enclosing key) in errors.

    Raises:
        InputError: a value is invalid; the first error, in one line.
    """
    try:
        return schema.model_validate(content)
    except ValidationError as error:
        raise InputError(one_line(error, schema, where)) from None


def one_line(error: ValidationError, schema: type[BaseModel], where: str) -> str:
    """Return the first error as a line with key, value and allowed values."""
    # a misspelt key gives a missing and an unknown key: the unknown one is the cause
    faults = sorted(
        error.errors(include_url=False), key=lambda fault: fault["type"] not in UNKNOWN_KEY
    )
    first = faults[0]
    key = printable(".".join(str(part) for part in first["loc"]))
    got = "" if first["type"] == "missing" else f", got {short(first['input'])}"
    text = first["msg"].removeprefix("Value error, ")
    if first["type"] in NO_MAPPING:
        text = "a mapping was expected"
    if first["type"] in UNKNOWN_KEY:
        fields = _fields(_field_at(schema, first["loc"][:-1])[0]).items()
        allowed = sorted(str(name) for name, field in fields if not field.exclude)
        text, got = f"unknown key{got}: {choices(str(first['loc'][-1]), allowed)}", ""
    if first["type"] in ON_NUMBERS and (description := _field_at(schema, first["loc"])[1]):
        got += f" ({description.removesuffix('.')})"
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    return f"{where}: {key + ': ' if key else ''}{text}{got}{more}"


def _field_at(schema: Any, location: tuple[int | str, ...]) -> tuple[Any, str]:
    description = ""
    for step in location:
        fields = _fields(schema)
        if step in fields:
            schema, description = fields[step].annotation, fields[step].description or ""
        else:  # an item of a list, a value of a mapping
            schema, description = (get_args(schema) or (schema,))[-1], ""
        while get_origin(schema) not in (None, list, dict):  # Annotated, a union with None
            schema = get_args(schema)[0]
    return schema, description


def _fields(schema: Any) -> dict[int | str, FieldInfo]:
    """Return the fields of a model, dataclass or named tuple, by their keys in files."""
    fields = getattr(schema, "model_fields", None)
    if fields is None:
        if not (is_dataclass(schema) or hasattr(schema, "_fields")):
            return {}
        hints = get_type_hints(schema, include_extras=True).items()
        own = {name: hint.type if isinstance(hint, InitVar) else hint for name, hint in hints}
        fields = {name: FieldInfo.from_annotation(hint) for name, hint in own.items()}
    return {field.alias or name: field for name, field in fields.items()}


def short(value: Any) -> str:
    """Return a value as text for errors, in one line of at most 80 characters."""
    try:
        text = repr(value)
    except ValueError:  # an integer with too many digits for Python
        text = f"a number of type {type(value).__name__}"
    if "\n" in text:  # an array
        text = " ".join(text.split())
    return text if len(text) <= 80 else text[:77] + "..."


def one_of(
    name: str, allowed: Iterable[str], what: str, context: str = "", listing: str = ""
) -> str:
    """Return ``name`` if it is allowed.

    Args:
        name: as the user wrote it.
        allowed: all allowed names.
        what: kind of the named object, for the error.
        context: follows the name in the error, such as `` in my.yaml``.
        listing: the option or command that lists all names, see `choices`.

    Raises:
        InputError: unknown name; lists the allowed ones.
    """
    names = list(allowed)
    if not isinstance(name, str) or name not in names:
        advice = choices(str(name), names, listing=listing)
        raise InputError(f"unknown {what} {short(name)}{context}: {advice}")
    return name


def full_namespace(text: str) -> str:
    """Return a namespace in ROS's form: ``/sat1`` for ``sat1`` or ``/sat1/``, ``/`` if empty."""
    if not (name := text.strip("/")):
        return ROOT
    namespace = f"/{name}"
    if not _NAMESPACE.fullmatch(namespace) or "__" in namespace:
        raise InputError(
            f"{short(text)} is not a namespace: letters, digits and _ were expected, not starting "
            "with a digit, such as sat1 or fleet/sat1"
        )
    return namespace


def relative(name: str, namespace: str) -> str:
    """Return a name relative to a namespace; empty if it is in another or a nested one."""
    prefix, _, last = name.rpartition("/")
    return last if (prefix or ROOT) == namespace else ""
