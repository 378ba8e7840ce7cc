"""Old name of `oracles`."""

from oracles import *  # noqa: F403
