"""How fast it all is: measurements side by side, as ``space-robot bench`` shows them.

A section is a function from `Options` to a list of `Result`; `sections.SECTIONS` names them all.
"""

from .measure import Options, interleave, repeated
from .result import Beside, Result, Target

__all__ = ["Beside", "Options", "Result", "Target", "interleave", "repeated"]
