"""A robot as a tree of bodies: as in its file, and flattened for the algorithms."""

from .arrays import TreeArrays
from .bodies import (
    MANY_TURNS,
    Body,
    Encoder,
    Gear,
    Joint,
    JointFriction,
    JointKind,
    JointLimits,
    Plate,
    Spring,
    Tool,
    Visual,
)
from .flatten import axes_with_z, first_repeated, flatten, other_meaning, parallel_axes

__all__ = [
    "MANY_TURNS",
    "Body",
    "Encoder",
    "Gear",
    "Joint",
    "JointFriction",
    "JointKind",
    "JointLimits",
    "Plate",
    "Spring",
    "Tool",
    "TreeArrays",
    "Visual",
    "axes_with_z",
    "first_repeated",
    "flatten",
    "other_meaning",
    "parallel_axes",
]
