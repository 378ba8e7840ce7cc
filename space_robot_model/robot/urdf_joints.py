"""Joints of a URDF: types, frames, axes, limits and friction."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from space_robot_msgs_py.config.text import nearest
from space_robot_msgs_py.config.validation import short

from ..elementary.matrices import Array, norm
from .parts import JointFriction, JointLimits
from .urdf_links import UrdfLink, read_name
from .urdf_xml import Element, Fields, Report, UrdfFrame

KINDS = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "fixed": "fixed",
    "floating": "floating",
    "planar": "planar",
}
"""Joint types of URDF, and their types here."""
ELEMENTS = ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic")
EXTENSIONS = ("calibration", "safety_controller", "hardwareInterface")
LIMITS = ("lower", "upper", "effort", "velocity", "acceleration", "deceleration", "jerk")
NEARLY_ONE = 1e-3
"""Tolerance of the norm of an axis, sufficient for numbers of four digits."""


@dataclass
class UrdfJoint:
    """A joint as in the file."""

    fields: Fields
    """Report of its defects."""
    name: str
    line: int
    kind: str
    """A value of `KINDS`."""
    parent: str
    child: str
    frame: UrdfFrame
    """The child's frame at joint position zero, relative to the parent."""
    axis: Array
    """(3,) unit vector in the child's axes."""
    limits: JointLimits
    friction: JointFriction | None


def read_joints(
    robot: Element, links: Mapping[str, UrdfLink], report: Report
) -> dict[str, UrdfJoint]:
    """Return all joints by name, in the order of the file."""
    joints: dict[str, UrdfJoint] = {}
    for element in robot.all("joint"):
        name = read_name(element, report)
        fields = Fields(report, f"joint {short(name)}")
        if name in joints:
            taken = f"the name is taken by the joint in line {joints[name].line}"
            raise fields.error(element, taken)
        joints[name] = _joint(element, name, links, fields)
    return joints


def _joint(element: Element, name: str, links: Mapping[str, UrdfLink], fields: Fields) -> UrdfJoint:
    fields.check_content(element, ELEMENTS + EXTENSIONS, ("name", "type"))
    written = element.attributes.get("type", "")
    if written not in KINDS:
        raise fields.error(element, f"type must be one of {', '.join(KINDS)}", written)
    parent, child = (_end(element, tag, links, fields) for tag in ("parent", "child"))
    if parent == child:
        raise fields.error(element, "parent and child must be different links", parent)
    joint = UrdfJoint(
        fields,
        name,
        element.line,
        KINDS[written],
        parent,
        child,
        fields.frame(fields.only(element, "origin")),
        np.array([1.0, 0.0, 0.0]),
        JointLimits(),
        None,
    )
    if joint.kind in ("revolute", "prismatic"):
        joint.axis = _axis(fields.only(element, "axis"), fields)
        limit = fields.only(element, "limit")
        joint.limits = _limits(element, limit, written == "continuous", fields)
        joint.friction = _friction(fields.only(element, "dynamics"), fields)
        mimic = fields.only(element, "mimic")
        if mimic is not None:
            other = mimic.attributes.get("joint", "")
            what = "<mimic>: joints cannot be coupled"
            fields.repaired(mimic, what, other, "made independent")
    return joint


def _end(element: Element, tag: str, links: Mapping[str, UrdfLink], fields: Fields) -> str:
    end = fields.only(element, tag)
    name = end.attributes.get("link", "") if end is not None else ""
    if end is None or not name:
        raise fields.error(element, f'<{tag} link="..."/> is missing')
    if name not in links:
        near = " or ".join(nearest(name, list(links)))
        advice = f" (did you mean {near}?)" if near else ""
        what = f"the {tag} is not a known link{advice}"
        raise fields.error(end, what, name)
    return name


def _axis(element: Element | None, fields: Fields) -> Array:
    if element is None:
        return np.array([1.0, 0.0, 0.0])  # as URDF says
    fields.check_content(element, (), ("xyz",))
    axis = fields.vector(element, "xyz", None)
    length = norm(axis)
    text = element.attributes.get("xyz", "")
    if length < NEARLY_ONE:
        raise fields.error(element, "the axis has no direction", text)
    if abs(length - 1.0) > NEARLY_ONE:
        fields.repaired(element, "the axis must have length 1", text, "normalised")
    return axis / length


def _limits(
    joint: Element, element: Element | None, continuous: bool, fields: Fields
) -> JointLimits:
    if element is None:
        if not continuous:
            kind = joint.attributes["type"]
            fields.repaired(joint, f"a {kind} joint needs a <limit>", "", "no limits")
        return JointLimits()
    fields.check_content(element, (), LIMITS)
    lower, upper = (-math.inf, math.inf) if continuous else _range(element, fields)
    return JointLimits(
        lower, upper, _most(element, "velocity", fields), _most(element, "effort", fields)
    )


def _range(element: Element, fields: Fields) -> tuple[float, float]:
    # a missing limit is 0, as defined by URDF
    lower, upper = (fields.limit(element, name) or 0.0 for name in ("lower", "upper"))
    interval = f"{lower:g} to {upper:g}"
    if lower > upper:
        fields.repaired(element, "lower is above upper", interval, "exchanged")
        return upper, lower
    if lower == upper:
        what = "lower and upper are equal"
        fields.repaired(element, what, interval, "no limits of position")
        return -math.inf, math.inf
    return lower, upper


def _most(element: Element, name: str, fields: Fields) -> float:
    limit = fields.limit(element, name)
    if limit is not None and limit > 0.0:
        return limit
    repair = "made positive" if limit else f"no limit of {name}"
    what = f"limit.{name} must be present and above 0"
    fields.repaired(element, what, element.attributes.get(name, ""), repair)
    return abs(limit) if limit else math.inf


def _friction(element: Element | None, fields: Fields) -> JointFriction | None:
    # a part missing in <dynamics> is 0, as defined by URDF; without the element both are unknown
    if element is None:
        return None
    fields.check_content(element, (), ("damping", "friction"))
    coefficients = {}
    for name in ("friction", "damping"):
        value = fields.number(element, name, 0.0)
        if value < 0.0:
            what = f"dynamics.{name} must be at least 0"
            fields.repaired(element, what, element.attributes[name], "read as 0")
        coefficients[name] = max(value, 0.0)
    return JointFriction(coulomb=coefficients["friction"], viscous=coefficients["damping"])
