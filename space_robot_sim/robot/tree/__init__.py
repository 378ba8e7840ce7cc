"""A robot as a tree of bodies: as its file tells it, and flattened for the algorithms."""

from .bodies import Body, Joint, JointFriction, JointKind, JointLimits, Spring, Tool, Visual
from .flatten import Moved, axes_with_z, flatten

__all__ = [
    "Body",
    "Joint",
    "JointFriction",
    "JointKind",
    "JointLimits",
    "Moved",
    "Spring",
    "Tool",
    "Visual",
    "axes_with_z",
    "flatten",
]
