"""A robot with prismatic and with passive joints, its mission and gains, for flights in tests."""

from __future__ import annotations

from paths import DATA

PASSIVE_ROBOT = str(DATA / "passive_robot")
"""Of its six joints with motors ``boom`` slides; of its three without ``slosh`` does."""
