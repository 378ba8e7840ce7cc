"""Old name of `robots`."""

from robots import *  # noqa: F403
