"""Old name of `oracles.rotors`."""

from oracles.rotors import *  # noqa: F403
