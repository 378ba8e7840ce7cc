"""A user's own metric: a Python function that returns a number for the log of a flight.

    def overshoot(log):
        return float(np.degrees(np.abs(log.joint_positions - log.reference_joints[:, 0]).max()))

Files and commands name it as ``path/file.py:overshoot`` or ``module:overshoot``, as they name laws.
"""

from __future__ import annotations

import math
import os
import sys
import traceback
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from inspect import isclass
from pathlib import Path
from typing import Any, NamedTuple, cast

from space_robot_control.laws.names import ENDING, import_named, importable_name
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.text import one_line_of
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

MetricFunction = Callable[[FlightLog], float]
ADVICE = "a metric is named as file.py:FUNCTION or module:FUNCTION"
SESSION = "session:"
"""Beginning of the name of a function that no other process can import, such as a notebook's."""
_SESSION: dict[str, MetricFunction] = {}
"""Such functions by name."""


class MetricError(InputError):
    """A metric's function raised an error, or returned no number."""


class OwnMetric(NamedTuple):
    """A metric and its function."""

    name: str
    text: str
    """Name of the function, see `importable_text`."""

    def value(self, log: FlightLog) -> float:
        """Return the metric of a flight, which need not be finite, or raise InputError."""
        return call(metric_function(self.text), log, f"metric {self.name}")

    def finite_value(self, log: FlightLog) -> float:
        """Return the metric of a flight as `value` does; MetricError: it is not finite."""
        return finite_value(metric_function(self.text), log, f"metric {self.name}")


def call(function: MetricFunction, log: FlightLog, what: str) -> float:
    """Return the number of a function for a flight, or raise MetricError, which names ``what``."""
    folder = os.getcwd()
    try:
        value: Any = function(log)
        shape = getattr(value, "shape", ())
        if shape == () and not isinstance(value, (str, bytes, complex)):
            with suppress(TypeError, ValueError, OverflowError):
                return float(value)
    except (Exception, SystemExit) as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        raise MetricError(
            f"{what} failed: {one_line_of(error)} ({Path(place.filename).name}, "
            f"line {place.lineno})"
        ) from error
    finally:
        os.chdir(folder)  # a function may have changed it; paths of a campaign are relative
    got = f"an array of shape {shape}" if shape else short(value)
    raise MetricError(f"{what}: the function must return one number, got {got}")


def finite_value(function: MetricFunction | str, log: FlightLog, what: str = "") -> float:
    """Return the finite metric of a flight, by a function or its name; else raise InputError."""
    if isinstance(function, str):
        return OwnMetric(function_name(function), function).finite_value(log)
    if not callable(function):
        raise InputError(f"a function or file.py:FUNCTION was expected, got {short(function)}")
    what = what or f"metric {getattr(function, '__name__', type(function).__name__)}"
    if not math.isfinite(value := call(function, log, what)):
        raise MetricError(f"{what}: the function must return a finite number, got {value}")
    return value


def metric_function(text: str) -> MetricFunction:
    """Return a metric's function by its name; raise InputError if it cannot be imported."""
    if text.startswith(SESSION):
        if text not in _SESSION:
            raise InputError(f"metric {short(text)}: a function of another Python session")
        return _SESSION[text]
    what = f"metric {short(check_text(text))}"
    function: Any = import_named(text, what, "function", _is_function, ADVICE)
    if not callable(function) or isclass(function):
        raise InputError(f"{what} is no function: {ADVICE}")
    return cast(MetricFunction, function)


def check_text(text: str) -> str:
    """Return a text that has the form of a function's name; raise InputError if it has not."""
    if text.endswith(ENDING):
        raise InputError(f"metric {short(text)}: name the function as well, {text}:FUNCTION")
    module, _, function = text.rpartition(":")
    if not module or not function:
        raise InputError(f"metric {short(text)}: {ADVICE}")
    return text


def importable_text(metric: object) -> str:
    """Return the name of a function, given as the function itself or as its name.

    It is ``module:FUNCTION`` or ``file.py:FUNCTION`` if another process can import the function
    by it, else one that begins with `SESSION`. What is neither raises InputError.
    """
    if isinstance(metric, str):
        return check_text(metric)
    if not callable(metric) or isclass(metric):
        raise InputError(f"a function or file.py:FUNCTION was expected, got {short(metric)}")
    if _is_importable(metric):
        return importable_name(metric)
    for text, known in _SESSION.items():
        if known is metric:
            return text
    name = getattr(metric, "__name__", type(metric).__name__)
    text = f"{SESSION}{name}#{len(_SESSION) + 1}"
    _SESSION[text] = metric
    return text


def function_name(text: str) -> str:
    """Return the last part of a function's name, ``overshoot`` of ``mine.py:overshoot``."""
    return text.rpartition(":")[2].rpartition(".")[2]


def check_names(names: Iterable[str]) -> None:
    """Raise InputError if a name of an own metric is no identifier: others have a point in it."""
    for name in names:
        if not (name.isidentifier() and name.isascii()):
            raise InputError(f"{short(name)} is no name of a metric: letters, digits and _ only")


def parse(text: str) -> OwnMetric:
    """Parse ``file.py:FUNCTION`` or ``NAME=file.py:FUNCTION``, and import it, or InputError."""
    name, sign, function = text.partition("=")
    metric = OwnMetric(name, function) if sign else OwnMetric(function_name(text), text)
    metric_function(metric.text)
    check_names([metric.name])
    return metric


def listed_metrics(metrics: Mapping[str, str]) -> list[OwnMetric]:
    """Return the metrics of a mapping of names to functions' names."""
    return [OwnMetric(name, text) for name, text in metrics.items()]


def _is_function(value: object) -> bool:
    return callable(value) and not isclass(value) and not hasattr(value, "__path__")


def _is_importable(function: Any) -> bool:
    module = sys.modules.get(getattr(function, "__module__", None) or "")
    name = getattr(function, "__qualname__", "")
    if module is None or module.__name__ == "__main__" or not name.isidentifier():
        return False
    return getattr(module, name, None) is function
