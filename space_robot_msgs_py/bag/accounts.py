"""Message counts of each topic that the recorder has written into a bag."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

from pydantic import BaseModel, Field, TypeAdapter, ValidationError

from ..config.text import parse_json

ACCOUNTS_KEY = "space_robot.accounting"

Count = Annotated[int, Field(ge=0, strict=True)]


class Account(BaseModel):
    """Counts of messages of one topic."""

    received: Count
    """Distinct messages with a plausible stamp."""
    missing: Count
    """Messages sent, but neither received nor excluded on purpose."""
    repeated: Count = 0
    """Messages excluded because they had arrived before."""
    invalid_stamps: Count = 0
    """Messages in the bag whose stamp is not plausible."""
    while_inactive: Count = 0
    """Messages excluded because the recorder was inactive when they were sent."""


_ACCOUNTS = TypeAdapter(dict[str, Account])


def noted_accounts(noted: Mapping[str, str]) -> dict[str, Account]:
    """Read the accounts in a bag's custom data, by topic; empty if none is valid."""
    try:
        return _ACCOUNTS.validate_python(parse_json(noted.get(ACCOUNTS_KEY, "{}")))
    except (ValueError, ValidationError):
        return {}


def paused(accounts: Mapping[str, Account]) -> list[str]:
    """Describe what the inactive recorder excluded, in at most one sentence."""
    inactive = {name: a.while_inactive for name, a in accounts.items() if a.while_inactive}
    each = ", ".join(f"{name} {count}" for name, count in inactive.items())
    return [f"messages were sent while the recorder was inactive: {each}"] if inactive else []
