"""The sections of ``space-robot bench``, one file each.

A new one: a file here with a function from `Options` to a list of `Result`, and its line below.
What is heavy to import, or need not be installed (ROS), it imports itself when it runs.
"""

from __future__ import annotations

from collections.abc import Callable

from ..measure import Options
from ..result import Result
from .clock import clock
from .graph import graph
from .laws import laws
from .plant import plant
from .recorder import recorder
from .reproduce import reproduce
from .simulate import simulate
from .start_up import start_up

Section = Callable[[Options], list[Result]]

SECTIONS: dict[str, Section] = {
    "plant": plant,
    "laws": laws,
    "simulate": simulate,
    "reproduce": reproduce,
    "graph": graph,
    "clock": clock,
    "recorder": recorder,
    "start-up": start_up,
}
"""By name, in the order they run."""
