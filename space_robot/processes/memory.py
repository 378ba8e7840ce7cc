"""How often Python searches for objects that are not used any more."""

COLLECTED_AT = 100_000
"""New objects after which Python searches for those that can be let go; by default 700."""
