"""What the fork server of workers imports: all that flies rows, with its kernels loaded."""

from __future__ import annotations

from contextlib import suppress

from ...flight.compilation import load_lanes
from . import fly as fly

with suppress(Exception):  # whatever is wrong is told by the worker that needs it
    load_lanes()
