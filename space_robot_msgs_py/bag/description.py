"""Validation of the description of a flight in a bag, which is untrusted input.

All descriptions are read here. Unknown keys are accepted unchanged, since newer software
may have written more.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, JsonValue

from ..config.text import parse_json, printable
from ..config.validation import validate
from ..errors import InputError
from .recorder import FLIGHT_KEY

WHERE = "the description of the flight"
LONGEST_PERIOD = 10.0
"""Longest period of a flight, s."""
_DEEPEST = 32
"""Lists and mappings within one another."""
_LARGEST = sys.float_info.max


def _printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError("letters that can be shown were expected")
    return text


Text = Annotated[str, AfterValidator(_printable)]
Count = Annotated[int, Field(ge=0, le=2**63 - 1)]


class _Open(BaseModel):
    """Takes keys it does not know; types are not changed."""

    model_config = ConfigDict(extra="allow", strict=True, frozen=True, allow_inf_nan=False)


class _Description(_Open):
    robot: Text = ""
    mission: Text = ""
    case: Text = ""
    sensors: Text = ""
    navigation: Text = ""
    actuators: Text = ""
    controller: Text = ""
    gains: Text = ""
    swaps: list[Text] = Field(default_factory=list)
    faults: list[Text] = Field(default_factory=list)
    events: list[Text] = Field(default_factory=list)
    period: Annotated[float, Field(ge=1e-9, le=LONGEST_PERIOD)] = 0.0005
    ticks: Count = 0
    command_latency_ticks: Annotated[int, Field(ge=0, le=10**6)] = 0
    friction: bool = True
    realtime: bool = False
    seed: Count = 0
    restart_controller: bool = False
    scenario: dict[Text, JsonValue] = Field(default_factory=dict)
    own_gains: list[Text] = Field(default_factory=list)
    robot_file: dict[Text, JsonValue] = Field(default_factory=dict)
    base_actuators: dict[Text, JsonValue] = Field(default_factory=dict)
    prismatic_joints: list[Text] = Field(default_factory=list)
    controller_robot: Text = ""
    controller_robot_file: dict[Text, JsonValue] = Field(default_factory=dict)


def read_description(noted: Mapping[str, str]) -> dict[str, Any]:
    """Read what was flown from a bag's ``custom_data``; empty for a bag of another recorder."""
    if (text := noted.get(FLIGHT_KEY)) is None:
        return {}
    try:
        content = parse_json(text)
    except ValueError:
        raise InputError(f"{WHERE} cannot be read") from None
    if not isinstance(content, dict):
        raise InputError(f"{WHERE} cannot be read: a mapping was expected")
    if fault := next(_unwritable(content, "", _DEEPEST), ""):
        raise InputError(f"{WHERE} cannot be used: {printable(fault)}")
    validate(_Description, content, f"{WHERE} cannot be used")
    return content


def _unwritable(value: Any, key: str, depth: int) -> Iterator[str]:
    # JSON has no infinity, and deep nesting exhausts the stack of who writes it again
    if depth == 0:
        yield f"{key[:80]}: nested too deeply"
    elif isinstance(value, (dict, list)):
        inside = value.items() if isinstance(value, dict) else enumerate(value)
        for name, inner in inside:
            yield from _unwritable(inner, f"{key}.{name}" if key else str(name), depth - 1)
    elif isinstance(value, (int, float)) and not -_LARGEST <= value <= _LARGEST:
        yield f"{key[:80]}: a finite number was expected"
