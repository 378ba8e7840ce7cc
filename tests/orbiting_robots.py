"""Old name of `robots` and `oracles.orbit`."""

from oracles.orbit import *  # noqa: F403
from robots import *  # noqa: F403
