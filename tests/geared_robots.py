"""Old name of `robots` and `strategies`."""

from robots import *  # noqa: F403
from strategies import *  # noqa: F403
