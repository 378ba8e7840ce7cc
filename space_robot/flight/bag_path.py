"""The folder of a flight's bag."""

from __future__ import annotations

from datetime import datetime, timezone
from pathlib import Path
from tempfile import TemporaryDirectory

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from .plan import Flight


def default_bag(flight: Flight) -> Path:
    """Return ``flights/<controller>_case<case>_<time>`` below the current folder.

    In a namespace its name comes first: two robots may start in the same second.
    """
    stamp = datetime.now(timezone.utc).strftime("%Y%m%d-%H%M%S")
    case = Path(flight.plant_settings.case).stem
    where = flight.scenario.options.namespace.lstrip("/").replace("/", "_")
    return Path("flights") / "_".join(
        filter(None, (where, flight.controller_name, f"case{case}", stamp))
    )


def check_bag_path(path: Path) -> None:
    """Check that a bag can be made at a path, without creating it.

    Raises:
        InputError: the path exists, or its nearest existing folder cannot be written.
    """
    if _is_taken(path):
        raise InputError(f"{path}: exists already; a bag is never overwritten")
    parent = path
    try:
        parent = next(p for p in path.absolute().parents if p.exists())
        with TemporaryDirectory(dir=parent):
            pass
    except OSError as error:
        raise InputError(
            f"{path}: no bag can be written there ({parent}: {error.strerror})"
        ) from None


def _is_taken(path: Path) -> bool:
    """Return whether the path exists.

    Raises:
        InputError: the name is not valid, which `Path.exists` does not report.
    """
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError as error:
        raise InputError(f"{path}: no bag can be written there ({error.strerror})") from None
    except ValueError as error:
        raise InputError(f"{short(str(path))}: no name of a folder ({error})") from None
    return True
