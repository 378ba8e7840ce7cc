"""Joints of a URDF: types, frames, axes, limits and friction."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.config.choices import nearest
from space_robot_msgs_py.config.validation import short

from ...elementary.matrices import norm
from ..parts import JointFriction, JointLimits
from .links import UrdfLink, read_name
from .xml import Element, Fields, Report, UrdfFrame

Array = NDArray[np.float64]

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

    @property
    def part(self) -> str:
        """Name of the joint in errors."""
        return f"joint {short(self.name)}"


def read_joints(
    robot: Element, links: Mapping[str, UrdfLink], report: Report
) -> dict[str, UrdfJoint]:
    """Return all joints by name, in the order of the file."""
    joints: dict[str, UrdfJoint] = {}
    for element in robot.all("joint"):
        name = read_name(element, report)
        part = f"joint {short(name)}"
        if name in joints:
            raise report.error(
                element.line, part, f"the name is taken by the joint in line {joints[name].line}"
            )
        joints[name] = _joint(element, name, links, Fields(report, part))
    return joints


def _joint(element: Element, name: str, links: Mapping[str, UrdfLink], fields: Fields) -> UrdfJoint:
    report, part = fields.report, fields.part
    report.check_content(element, part, ELEMENTS + EXTENSIONS, ("name", "type"))
    written = element.attributes.get("type", "")
    if written not in KINDS:
        raise report.error(element.line, part, f"type must be one of {', '.join(KINDS)}", written)
    parent, child = (_end(element, tag, links, fields) for tag in ("parent", "child"))
    if parent == child:
        raise report.error(element.line, part, "parent and child must be different links", parent)
    joint = UrdfJoint(
        name,
        element.line,
        KINDS[written],
        parent,
        child,
        fields.frame(report.only(element, "origin", part)),
        np.array([1.0, 0.0, 0.0]),
        JointLimits(),
        None,
    )
    if joint.kind in ("revolute", "prismatic"):
        joint.axis = _axis(report.only(element, "axis", part), fields)
        limit = report.only(element, "limit", part)
        joint.limits = _limits(element, limit, written == "continuous", fields)
        joint.friction = _friction(report.only(element, "dynamics", part), fields)
        mimic = report.only(element, "mimic", part)
        if mimic is not None:
            report.repaired(
                mimic.line,
                part,
                "<mimic>: joints cannot be coupled",
                mimic.attributes.get("joint", ""),
                "made independent",
            )
    return joint


def _end(element: Element, tag: str, links: Mapping[str, UrdfLink], fields: Fields) -> str:
    """Return the name of the link at one end of a joint."""
    end = fields.report.only(element, tag, fields.part)
    name = end.attributes.get("link", "") if end is not None else ""
    if end is None or not name:
        raise fields.report.error(element.line, fields.part, f'<{tag} link="..."/> is missing')
    if name not in links:
        near = " or ".join(nearest(name, list(links)))
        advice = f" (did you mean {near}?)" if near else ""
        what = f"the {tag} is not a known link{advice}"
        raise fields.report.error(end.line, fields.part, what, name)
    return name


def _axis(element: Element | None, fields: Fields) -> Array:
    if element is None:
        return np.array([1.0, 0.0, 0.0])  # as URDF says
    fields.report.check_content(element, fields.part, (), ("xyz",))
    axis = fields.vector(element, "xyz", None)
    length = norm(axis)
    text = element.attributes.get("xyz", "")
    if length < NEARLY_ONE:
        raise fields.report.error(element.line, fields.part, "the axis has no direction", text)
    if abs(length - 1.0) > NEARLY_ONE:
        fields.report.repaired(
            element.line, fields.part, "the axis must have length 1", text, "normalised"
        )
    return axis / length


def _limits(
    joint: Element, element: Element | None, continuous: bool, fields: Fields
) -> JointLimits:
    report, part = fields.report, fields.part
    if element is None:
        if not continuous:
            kind = joint.attributes["type"]
            report.repaired(joint.line, part, f"a {kind} joint needs a <limit>", "", "no limits")
        return JointLimits()
    report.check_content(element, part, (), LIMITS)
    lower, upper = (-math.inf, math.inf) if continuous else _range(element, fields)
    return JointLimits(
        lower, upper, _most(element, "velocity", fields), _most(element, "effort", fields)
    )


def _range(element: Element, fields: Fields) -> tuple[float, float]:
    """Return lower and upper limit; a missing one is 0, as defined by URDF."""
    lower, upper = (fields.limit(element, name) or 0.0 for name in ("lower", "upper"))
    interval = f"{lower:g} to {upper:g}"
    if lower > upper:
        fields.report.repaired(
            element.line, fields.part, "lower is above upper", interval, "exchanged"
        )
        return upper, lower
    if lower == upper:
        fields.report.repaired(
            element.line,
            fields.part,
            "lower and upper are equal",
            interval,
            "no limits of position",
        )
        return -math.inf, math.inf
    return lower, upper


def _most(element: Element, name: str, fields: Fields) -> float:
    """Return the limit of velocity or effort."""
    limit = fields.limit(element, name)
    if limit is not None and limit > 0.0:
        return limit
    repair = "made positive" if limit else f"no limit of {name}"
    fields.report.repaired(
        element.line,
        fields.part,
        f"limit.{name} must be present and above 0",
        element.attributes.get(name, ""),
        repair,
    )
    return abs(limit) if limit else math.inf


def _friction(element: Element | None, fields: Fields) -> JointFriction | None:
    """Return the friction in the file; 0 for a part that is missing in ``<dynamics>``."""
    if element is None:
        return None
    fields.report.check_content(element, fields.part, (), ("damping", "friction"))
    coefficients = {}
    for name in ("friction", "damping"):
        value = fields.number(element, name, 0.0)
        if value < 0.0:
            fields.report.repaired(
                element.line,
                fields.part,
                f"dynamics.{name} must be at least 0",
                element.attributes[name],
                "read as 0",
            )
        coefficients[name] = max(value, 0.0)
    return JointFriction(coulomb=coefficients["friction"], viscous=coefficients["damping"])
