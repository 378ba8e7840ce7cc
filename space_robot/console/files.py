"""Atomic writing of files and folders, without overwriting existing ones unless requested."""

from __future__ import annotations

import csv
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from glob import escape
from io import TextIOWrapper
from pathlib import Path
from secrets import token_hex
from tempfile import TemporaryFile
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.errors import InputError

ABANDONED_S = 3600.0
"""Age since the last change above which an unfinished file is that of a killed process, s."""


def check_free(path: Path) -> None:
    """Check that a new file can be created at a path; its folder is created.

    Raises:
        InputError: it exists, or its folder cannot be created or written.
    """
    if path.exists():
        raise InputError(f"{path}: exists already; it is not overwritten")
    make_folder(path.parent)
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise InputError(f"{path}: cannot be written (no permission for its folder)")


def make_folder(path: Path) -> None:
    """Create a folder and its parents if they do not exist.

    Raises:
        InputError: it cannot be created.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: the folder cannot be created ({error.strerror})") from None


def check_writable(path: Path) -> None:
    """Check that a file can be written or replaced.

    Raises:
        InputError: it cannot be written.
    """
    with _written(path):
        if path.exists():
            path.open("r+b", buffering=0).close()  # fails for a folder, or without permission
        with TemporaryFile(dir=path.parent):  # no file remains if the caller fails
            pass


def write_text(text: str, path: Path, replace: bool = False) -> None:
    """Write ``text`` in UTF-8, as an `atomic_file`."""
    with atomic_file(path, replace) as file:
        file.write(text.encode())


@contextmanager
def csv_writer(path: Path, replace: bool = False) -> Iterator[Any]:
    """Open an `atomic_file` for the writer of the module `csv`."""
    with (
        atomic_file(path, replace) as raw,
        TextIOWrapper(raw, encoding="utf-8", newline="") as file,
    ):
        yield csv.writer(file, lineterminator="\n")


def csv_rows(integers: NDArray[np.int64], numbers: NDArray[np.float64]) -> list[list[Any]]:
    """Return the rows of a table for `csv_writer`; NaN becomes an empty cell.

    Args:
        integers: (N,) first column.
        numbers: (N, C) other columns.
    """
    known = np.where(np.isnan(numbers), None, numbers)  # type: ignore[call-overload]
    rows: list[list[Any]] = np.column_stack([integers.astype(object), known]).tolist()
    return rows


@contextmanager
def atomic_file(path: Path, replace: bool = False) -> Iterator[IO[Any]]:
    """Open a file that gets its name only when it is complete.

    Args:
        path: of the file, which must not exist; a pipe or device is written directly.
        replace: whether an existing file is replaced.

    Raises:
        InputError: the file exists, or it cannot be written.
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        with _written(path), path.open("wb") as file:
            yield file
        return
    if not replace:
        check_free(path)
    with _written(path):
        unnamed = unfinished_name(path)
        try:
            with unnamed.open("xb") as file:
                yield file
            if replace:
                unnamed.replace(path)
            else:
                os.link(unnamed, path)  # rename would overwrite a file
        finally:
            unnamed.unlink(missing_ok=True)


@contextmanager
def atomic_folder(folder: Path) -> Iterator[Path]:
    """Yield a temporary folder that replaces ``folder`` if the block ends without error.

    Raises:
        InputError: the folder cannot be written.
    """
    make_folder(folder.parent)
    unnamed = unfinished_name(folder)
    old = unnamed.with_suffix(".old")
    try:
        unnamed.mkdir()
        yield unnamed
        if folder.exists():
            folder.rename(old)
        unnamed.rename(folder)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror})") from None
    finally:
        if old.exists() and not folder.exists():
            old.rename(folder)
        for remains in (unnamed, old):
            shutil.rmtree(remains, ignore_errors=True)


def unfinished_name(path: Path) -> Path:
    """Return a new hidden name beside ``path``; remove what killed processes have left of it."""
    for remains in path.parent.glob(f".{escape(path.name)}.{'[0-9a-f]' * 8}"):
        with suppress(OSError):  # of somebody else, or gone by now
            if time.time() > remains.lstat().st_mtime + ABANDONED_S:
                shutil.rmtree(remains) if remains.is_dir() else remains.unlink()
    return path.with_name(f".{path.name}.{token_hex(4)}")


@contextmanager
def _written(path: Path) -> Iterator[None]:
    try:
        yield
    except FileExistsError:
        raise InputError(f"{path}: exists already; it is not overwritten") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error})") from None
