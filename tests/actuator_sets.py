"""Old name of `benches`."""

from benches import *  # noqa: F403
from benches import WHEEL_AXES as PYRAMID  # noqa: F401
