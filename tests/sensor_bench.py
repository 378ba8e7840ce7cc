"""Old name of `benches`."""

from benches import *  # noqa: F403
from benches import SensorBench as Bench  # noqa: F401
