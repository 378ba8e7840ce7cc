"""Old name of `benches`."""

from benches import *  # noqa: F403
