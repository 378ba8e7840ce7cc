"""The counts of each topic that our recorder noted in the bag, read back with care."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated

from pydantic import BaseModel, Field, TypeAdapter, ValidationError

ACCOUNTS_KEY = "space_robot.accounting"

Count = Annotated[int, Field(ge=0, strict=True)]


class Account(BaseModel):
    """Messages of one topic."""

    received: Count
    """Distinct ones, whose stamp can be right."""
    missing: Count
    """Sent, but neither received nor left out on purpose."""
    repeated: Count = 0
    """Left out, since they had come before."""
    invalid_stamps: Count = 0
    """In the bag, too, but their stamp cannot be right."""
    foreign: Count = 0
    """Left out, since a foreign publisher sent them."""
    foreign_publishers: list[str] = []
    while_inactive: Count = 0
    """Left out, since the recorder was inactive when they were sent."""


_ACCOUNTS = TypeAdapter(dict[str, Account])


def noted_accounts(noted: Mapping[str, str]) -> dict[str, Account]:
    """Read the accounts in a bag's custom data, by topic; empty if none make sense."""
    try:
        return _ACCOUNTS.validate_python(json.loads(noted.get(ACCOUNTS_KEY, "{}")))
    except (ValueError, RecursionError, ValidationError):
        return {}


def foreign(accounts: Mapping[str, Account]) -> list[str]:
    """Tell whose messages were left out, since they are not of the flight, a sentence each."""
    return [
        f"{account.foreign} messages on {name} were left out: they are from "
        f"{', '.join(account.foreign_publishers) or 'a foreign publisher'}"
        for name, account in accounts.items()
        if account.foreign
    ]


def paused(accounts: Mapping[str, Account]) -> list[str]:
    """Tell what the recorder left out since it was inactive, in at most one sentence."""
    inactive = {name: a.while_inactive for name, a in accounts.items() if a.while_inactive}
    each = ", ".join(f"{name} {count}" for name, count in inactive.items())
    return [f"messages were sent while the recorder was inactive: {each}"] if inactive else []
