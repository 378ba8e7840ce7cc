"""Gain sets: files, validation, and the laws built from them."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot.find import new_command, remake_advice, robot_files
from space_robot_msgs_py.config.files import GIVEN, Tree, nest, node_parameters
from space_robot_msgs_py.config.text import one_line_of
from space_robot_msgs_py.config.validation import one_of, read_yaml, short
from space_robot_msgs_py.config.yaml_text import check_readable, is_folder
from space_robot_msgs_py.errors import InputError, SpaceRobotError

from ..laws import ControlLaw, find_law, laws
from .settings import DEFAULT, DEFAULT_SETS, OF_THE_SET, OTHERS, ControllerNodeSettings

Array = NDArray[np.float64]

STRICTLY_POSITIVE = ("h_bar", "inertia", "delta")
"""Gains used as divisors; other gains may be zero."""
FRACTIONS = ("spread",)
"""Gains that must be below 1."""
NOMINAL = "nominal"
"""``h_bar`` for a time-delay estimate with the inertia of the nominal model; as numbers: zeros."""
PARAMETERS = "controller parameters"


def gain_files(robot: str, gain_set: str) -> dict[str, Path]:
    """Return the gain file of each law, by name, for a robot (name or path) and a set.

    ``gain_set`` is ``default``, a folder's name among the robot's gains (``config/gains/<robot>``,
    or ``gains`` in its own folder), or a path to a folder of ``<law>.yaml`` or to one such file.

    Raises:
        InputError: the set does not exist; the message lists the available sets.
    """
    path = Path(gain_set)
    if gain_set.endswith((".yaml", ".yml")):
        check_readable(path)
        return {path.stem: path}
    if "/" in gain_set:
        return _files(path)
    files = robot_files(robot)
    if robot == GIVEN:
        raise InputError("a robot that no file tells has no gains of its own: give some")
    if (folder := files.gains) is None:
        raise InputError(
            f"robot {short(robot)} has no gains of its own: `{new_command(robot)}` makes "
            "gains and a mission for it; or name a folder of <law>.yaml files as gains"
        )
    if gain_set == DEFAULT:
        if not (folder / DEFAULT_SETS).is_file():
            return _files(folder)
        chosen = {law: str(name) for law, name in read_yaml(folder / DEFAULT_SETS).items()}
        others = _files(folder / chosen.pop(OTHERS)) if OTHERS in chosen else {}
        return {**others, **{law: folder / s / f"{law}.yaml" for law, s in chosen.items()}}
    one_of(gain_set, [DEFAULT, *_sets(folder)], "gain set", f" of robot {short(files.name)}")
    return _files(folder / gain_set)


def _sets(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir() if entry.is_dir())


def _files(folder: Path) -> dict[str, Path]:
    files = sorted(folder.glob("*.yaml")) if is_folder(folder) else []
    gains = {file.stem: file for file in files if file.name != OF_THE_SET}
    if not gains:
        raise InputError(f"{short(str(folder))}: no folder with gain files (<law>.yaml)")
    return gains


def gains_as_path(gain_set: str, robot: str) -> str:
    """Resolve a user's gain set: ``g`` is the folder ``g/`` if no set has that name.

    Not for names out of bags: these open no folder of the user's.
    """
    if "/" in gain_set or gain_set == DEFAULT:
        return gain_set
    with suppress(InputError):  # of a bag: a robot that is not here
        if (own := robot_files(robot).gains) and gain_set in _sets(own):
            return gain_set
    return f"{gain_set}/" if gain_set and is_folder(Path(gain_set)) else gain_set


def read_gains(path: Path, law: type[ControlLaw], axes: int) -> dict[str, Array]:
    """Read a law's gains from its section in a ROS parameter file of the controller.

    Raises:
        InputError: naming file, key, value given and values allowed.
    """
    tree = node_parameters(path, ControllerNodeSettings.node)
    if not isinstance(tree.get(law.name), dict):
        raise InputError(f"{path}: {law.name}: missing (the gains of this law)")
    return check_gains(tree[law.name], law, axes, str(path), remake_advice(path))


def check_gains(
    content: Tree, law: type[ControlLaw], axes: int, where: str, advice: str = ""
) -> dict[str, Array]:
    """Return gains as (axes,) arrays; a list of one value applies to all axes.

    Args:
        content: numbers by name.
        law: whose gains they are.
        axes: m = n+3.
        where: name of the source, for errors.
        advice: what to do where they are for another number of axes.

    Raises:
        InputError: a gain is missing, unknown, of the wrong length or out of its range.
    """
    descriptions = law.gain_descriptions()
    for name in content:
        one_of(name, descriptions, f"gain of {law.name}", f" in {where}")
    gains = {}
    for name, description in descriptions.items():
        key = f"{where}: {law.name}.{name}"
        if name not in content:
            raise InputError(f"{key}: missing ({description})")
        values = _numbers(name, content[name])
        if values is None:
            raise InputError(f"{key}: numbers were expected, got {short(content[name])}")
        if values.shape not in ((axes,), (1,)):
            listed = ", ".join(f"{value:g}" for value in np.ravel(values)[:3])
            got = f"[{listed}]" if values.size <= 3 else f"{values.size}: [{listed}, ...]"
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
    return f"{text} (or {NOMINAL}: as numbers all 0)" if name == "h_bar" else text


def gain_lengths(axes: int) -> str:
    """Return the allowed number of values of a gain, in words."""
    return f"{axes} values (base x, y, z and the joints) or 1"


def _numbers(name: str, value: Any) -> Array | None:
    """Return the numbers of a gain; None for other values, booleans and texts included."""
    if isinstance(value, np.ndarray):
        return value
    if name == "h_bar" and (value == NOMINAL or value in ([NOMINAL], (NOMINAL,))):
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
    """Build a law with the gains of the settings.

    Args:
        law: its name (as `find_law` takes it) or class; or an object, which brings its gains and is
            copied.
        settings: they choose its gains.
        axes: m = n+3.
        overrides: gains that come over those.

    Raises:
        InputError: unknown law, gain set without it, gains that do not fit, or an object that is
            for another robot or period.
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
    may_lack = settings.gains == DEFAULT and (bool(overrides) or not law.gain_descriptions())
    files = _files_of(settings, may_lack)
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


def build_laws(
    settings: ControllerNodeSettings,
    axes: int,
    overrides: Mapping[str, Tree] | None = None,
    own: str | type[ControlLaw] | ControlLaw = "",
) -> dict[str, ControlLaw]:
    """Build all laws of a controller, by name: the law in force first, then the gain set's.

    Args:
        settings: they choose the law in force and the gains.
        axes: m = n+3.
        overrides: gains by law that come over those of the files.
        own: the law in force as a class or an object, which brings its gains; it is copied.

    Raises:
        InputError: a law does not exist, or its gains do not fit.
    """
    overrides = overrides or {}
    first = own if not isinstance(own, str) else find_law(settings.controller)
    wanted: dict[str, str | type[ControlLaw] | ControlLaw] = {first.name: first}
    brings_gains = isinstance(first, ControlLaw) or not first.gain_descriptions()
    available = available_laws(settings, brings_gains or first.name in overrides)
    for name in available or overrides:  # without a gain set, the gains given are all there are
        wanted.setdefault(name, name)
    for name in overrides:
        one_of(name, wanted, "law", f" in {PARAMETERS} (gains are <law>.<gain>)")
    return {
        name: build_law(law, settings, axes, overrides.get(name)) for name, law in wanted.items()
    }


def _files_of(settings: ControllerNodeSettings, may_lack: bool) -> dict[str, Path]:
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


def available_laws(settings: ControllerNodeSettings, may_lack: bool = False) -> list[str]:
    """Return the names of this project's laws covered by the gains, which ``may_lack``."""
    files = _files_of(settings, may_lack and settings.gains == DEFAULT)
    return sorted(set(files) & set(laws()))
