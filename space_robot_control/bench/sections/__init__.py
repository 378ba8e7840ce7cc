"""The sections of ``space-robot bench``, one file each.

A new one: a file here with a function from `Options` to a list of `Result`, and its line below.
What is heavy to import, or need not be installed (ROS), it imports itself when it runs.
"""

from __future__ import annotations

from collections.abc import Callable

from ..measure import Options
from ..result import Result
from .laws import laws
from .plant import plant
from .reproduce import reproduce
from .simulate import simulate

Section = Callable[[Options], list[Result]]

SECTIONS: dict[str, Section] = {
    "plant": plant,
    "laws": laws,
    "simulate": simulate,
    "reproduce": reproduce,
}
"""By name, in the order they run."""
