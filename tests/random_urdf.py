"""Old name of `strategies`."""

from strategies import *  # noqa: F403
