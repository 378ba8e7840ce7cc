"""Gains: reading, validation, and the laws built from them."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot.find import remake_advice
from space_robot_msgs_py.config.files import Tree, nest, node_parameters
from space_robot_msgs_py.config.text import one_line_of
from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.errors import InputError, SpaceRobotError

from ..laws import ControlLaw, find_law, laws
from .settings import DEFAULT, ControllerNodeSettings, gain_files

Array = NDArray[np.float64]

STRICTLY_POSITIVE = ("h_bar", "inertia", "delta")
"""Gains used as divisors; other gains may be zero."""
FRACTIONS = ("spread",)
"""Gains that must be below 1."""
NOMINAL_H_BAR = "nominal"
"""``h_bar`` for a time-delay estimate with the inertia of the nominal model; as numbers: zeros."""
PARAMETERS = "controller parameters"


def read_gains(path: Path, law: type[ControlLaw], axes: int) -> dict[str, Array]:
    """Read a law's gains from its section in a ROS parameter file of the controller."""
    tree = node_parameters(path, ControllerNodeSettings.node)
    if not isinstance(tree.get(law.name), dict):
        raise InputError(f"{path}: {law.name}: missing (the gains of this law)")
    return check_gains(tree[law.name], law, axes, str(path), path)


def check_gains(
    content: Tree, law: type[ControlLaw], axes: int, where: str, file: Path | None = None
) -> dict[str, Array]:
    """Return gains as (axes,) arrays; a list of one value applies to all axes.

    ``where`` names the source in errors, ``file`` is that of the gains, if they are from one.
    Optional gains that are not in ``content`` are not in the result.

    Raises:
        InputError: a gain is missing, unknown, of the wrong length or out of its range.
    """
    descriptions, optional = law.gain_descriptions(), law.optional_gains()
    for name in content:
        one_of(name, descriptions, f"gain of {law.name}", f" in {where}")
    gains = {}
    for name, description in descriptions.items():
        key = f"{where}: {law.name}.{name}"
        if name not in content:
            if name in optional:
                continue
            raise InputError(f"{key}: missing ({description})")
        values = _numbers(name, content[name])
        if values is None:
            raise InputError(f"{key}: numbers were expected, got {short(content[name])}")
        if values.shape not in ((axes,), (1,)):
            listed = ", ".join(f"{value:g}" for value in np.ravel(values)[:3])
            got = f"[{listed}]" if values.size <= 3 else f"{values.size}: [{listed}, ...]"
            advice = remake_advice(file) if file else ""
            raise InputError(f"{key}: {gain_lengths(axes)} were expected, got {got}{advice}")
        fits = values > 0.0 if name in STRICTLY_POSITIVE else values >= 0.0
        if name in FRACTIONS:
            fits &= values < 1.0
        if name == "h_bar" and not values.any():
            fits = values == 0.0
        if not np.all(fits & np.isfinite(values)):
            raise InputError(f"{key}: {gain_range(name)} were expected, got {short(content[name])}")
        gains[name] = np.ascontiguousarray(np.broadcast_to(values, axes))
    return gains


def gain_range(name: str) -> str:
    """Return the allowed values of a gain, in words."""
    text = f"finite values {'above 0' if name in STRICTLY_POSITIVE else '0 or more'}"
    if name in FRACTIONS:
        return f"{text} and below 1"
    return f"{text} (or {NOMINAL_H_BAR}: as numbers all 0)" if name == "h_bar" else text


def gain_lengths(axes: int) -> str:
    """Return the allowed number of values of a gain, in words."""
    return f"{axes} values (base x, y, z and the joints) or 1"


def _numbers(name: str, value: Any) -> Array | None:
    """Return the numbers of a gain; None for other values, booleans and texts included."""
    if isinstance(value, np.ndarray):
        return value
    if name == "h_bar" and (value == NOMINAL_H_BAR or value in ([NOMINAL_H_BAR], (NOMINAL_H_BAR,))):
        return np.zeros(1)
    if not isinstance(value, (list, tuple)):
        return None
    if not all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in value):
        return None
    with suppress(OverflowError):
        return np.array(value, dtype=np.float64)
    return None


def build_law(
    law: str | type[ControlLaw] | ControlLaw,
    settings: ControllerNodeSettings,
    axes: int,
    overrides: Mapping[str, Any] | None = None,
) -> ControlLaw:
    """Build a law with the gains of the settings, and ``overrides`` over these.

    ``law`` is a name as `find_law` takes it, a class, or an object, which brings its gains and is
    copied.
    """
    if isinstance(law, str):
        law = find_law(law)
    if isinstance(law, ControlLaw):
        if len(law.memory.s) != axes or law.period != settings.period:
            raise InputError(
                f"controller {law.name!r} is for {len(law.memory.s)} axes and ticks of "
                f"{law.period:g} s, the flight has {axes} and {settings.period:g} s"
            )
        copied = copy.deepcopy(law)
        if overrides:
            values = {**law.gain_values, **overrides}
            copied.gain_values = check_gains(values, type(law), axes, PARAMETERS)
        return copied
    may_lack = settings.gains == DEFAULT and (bool(overrides) or not law.required_gains())
    files = _law_files(settings, may_lack)
    if law.name in files:
        gains = read_gains(files[law.name], law, axes)
    elif may_lack:
        gains = {}
    else:
        raise InputError(
            f"gains {settings.gains!r} have no file for controller {law.name!r}, "
            f"only for {', '.join(sorted(files))}"
        )
    if overrides:
        gains = check_gains({**gains, **overrides}, law, axes, PARAMETERS)
    try:
        return law(gains, settings.period) if gains else law(gains, settings.period, axes)
    except SpaceRobotError:
        raise
    except (Exception, SystemExit) as error:  # the law may be the user's
        raise InputError(
            f"controller {law.name!r} cannot be made ({one_line_of(error)})"
        ) from error


class Laws(Mapping[str, ControlLaw]):
    """All laws of a controller by name: the law in force first, then the gain set's.

    A law is built when it is first asked for; most flights need one.
    """

    def __init__(
        self,
        settings: ControllerNodeSettings,
        axes: int,
        overrides: Mapping[str, Tree] | None = None,
        own: str | type[ControlLaw] | ControlLaw = "",
    ) -> None:
        """Build the law in force, and those with ``overrides``: gains that come over the files'.

        ``own`` is the law in force as a class or an object, see `build_law`.
        """
        self._settings, self._axes, self._overrides = settings, axes, overrides or {}
        first = own if not isinstance(own, str) else find_law(settings.controller)
        self._built = {first.name: self._build(first)}
        brings_gains = isinstance(first, ControlLaw) or not first.required_gains()
        may_lack = settings.gains == DEFAULT and (brings_gains or first.name in self._overrides)
        self._files = _law_files(settings, may_lack)
        for name in self._overrides:
            _ = self[one_of(name, self, "law", f" in {PARAMETERS} (gains are <law>.<gain>)")]

    def _build(self, law: type[ControlLaw] | ControlLaw) -> ControlLaw:
        return build_law(law, self._settings, self._axes, self._overrides.get(law.name))

    def __getitem__(self, name: str) -> ControlLaw:
        if name not in self._built:
            if name not in [*self]:
                raise KeyError(name)
            self._built[name] = self._build(find_law(name))
        return self._built[name]

    def __iter__(self) -> Iterator[str]:
        yield (first := next(iter(self._built)))
        # without a gain set, the gains given are all there are
        names = sorted(self._files.keys() & laws().keys()) or self._overrides
        yield from (name for name in names if name != first)

    def __len__(self) -> int:
        return sum(1 for _ in self)


def _law_files(settings: ControllerNodeSettings, may_lack: bool) -> dict[str, Path]:
    try:
        return gain_files(settings.robot, settings.gains)
    except InputError:
        if not may_lack:
            raise
        return {}


def split_gains(parameters: Mapping[str, Any]) -> tuple[Tree, dict[str, Tree]]:
    """Split the parameters into the controller's own and gains ``<law>.<gain>`` by law."""
    own, gains = Tree(), {}
    for name, value in nest(parameters).items():
        if isinstance(value, dict) and name not in ControllerNodeSettings.model_fields:
            gains[name] = value
        else:
            own[name] = value
    return own, gains


def available_laws(settings: ControllerNodeSettings) -> list[str]:
    """Return the names of this project's laws covered by the gains."""
    return sorted(gain_files(settings.robot, settings.gains).keys() & laws().keys())
