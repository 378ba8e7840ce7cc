"""Old name of `oracles.second_moments`."""

from oracles.second_moments import *  # noqa: F403
