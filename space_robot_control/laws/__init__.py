"""The control laws, one file each.

A new law is a class derived from `ControlLaw` and a YAML file of its gains. The law of a file in
this folder is selected by its ``name``, a class in any other file as ``path/file.py:Class``, one
on PYTHONPATH as ``module:Class``.
"""

from __future__ import annotations

from .base import CompiledLaw, ControlLaw, LawMemory, Signals
from .gains import GainRange, LawGains, per_axis
from .names import find_law, importable_name, laws

__all__ = [
    "CompiledLaw",
    "ControlLaw",
    "GainRange",
    "LawGains",
    "LawMemory",
    "Signals",
    "find_law",
    "importable_name",
    "laws",
    "per_axis",
]
