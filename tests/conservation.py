"""Old name of `oracles.momenta`."""

from oracles.momenta import *  # noqa: F403
