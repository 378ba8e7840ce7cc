"""Files of a bag in a folder or a single file."""

from __future__ import annotations

from pathlib import Path

from mcap.writer import MCAP0_MAGIC

from ..errors import InputError
from .contents import Bag, Storage
from .findings import some_of
from .mcap_storage import McapStorage
from .metadata import METADATA, BagInformation, read_information
from .rosbags_storage import RosbagsStorage

_SQLITE_MAGIC = b"SQLite format 3\0"
_STORAGES = (".mcap", ".db3")


def open_bag(path: Path) -> Bag:
    """Open the bag in a folder, or a single file of a bag, finished or not.

    Raises:
        InputError: no bag is there.
        OSError: it cannot be read.
    """
    if path.name == METADATA:
        path = path.parent
    if not path.exists():
        raise InputError(f"{path}: no such bag")
    if not path.is_dir():
        return _open_files([path], None, [], closed=True)
    information, damage = None, []
    if closed := (path / METADATA).exists():
        try:
            information = read_information(path)
        except InputError as error:
            damage = [str(error)]
        else:
            damage = information.doubts
    if information and information.compressed:
        for name in information.relative_file_paths:
            _check_regular(path / Path(name).name)
        return Bag([RosbagsStorage(path)], information, [], closed)
    there = [file for suffix in _STORAGES for file in path.glob(f"*{suffix}")]
    there.sort(key=lambda file: (len(file.name), file.name))
    if information:
        there = _listed(path, information, there, damage)
    if not there:
        hint = damage[-1] if damage else f"not a bag folder (no {METADATA}, no .mcap)"
        raise InputError(hint if damage else f"{path}: {hint}")
    return _open_files(there, information, damage, closed)


def _listed(
    path: Path, information: BagInformation, there: list[Path], damage: list[str]
) -> list[Path]:
    """Return the existing files that metadata.yaml names, in its order."""
    names = [Path(name).name for name in information.relative_file_paths]
    files = [path / name for name in names if (path / name).exists()]
    missing = [name for name in names if not (path / name).exists()]
    others = [file for file in there if file.name not in names]
    if missing:
        damage.append(f"{path / METADATA} names {some_of(missing)}, not there")
    if others:
        what = "left out" if files else "read instead"
        damage.append(f"{METADATA} does not name {some_of(f.name for f in others)}: {what}")
    return files or others


def _open_files(
    files: list[Path], information: BagInformation | None, damage: list[str], closed: bool
) -> Bag:
    for file in files:
        _check_regular(file)
    is_database = all(_kind(file) == ".db3" for file in files)
    opened: list[Storage] = []
    for file in files:
        try:
            opened.append(RosbagsStorage(file) if is_database else McapStorage(file))
        except OSError as error:
            if len(files) == 1:
                raise
            damage.append(f"{file.name}: cannot be read ({error.strerror})")
    lacks_files = information is not None and len(opened) < len(information.relative_file_paths)
    return Bag(opened, information, damage, closed, lacks_files)


def _check_regular(file: Path) -> None:
    """Check for a regular file: reading a pipe or a device may never end.

    Raises:
        InputError: it is neither a file, nor a folder, nor absent.
    """
    if file.exists() and not (file.is_file() or file.is_dir()):
        raise InputError(f"{file}: cannot be read (a pipe, socket or device, not a file)")


def _kind(file: Path) -> str:
    if file.suffix in _STORAGES:
        return file.suffix
    with file.open("rb") as stream:
        start = stream.read(len(_SQLITE_MAGIC))
    if start.startswith(MCAP0_MAGIC):
        return ".mcap"
    raise InputError(f"{file}: not a bag: neither .mcap nor .db3, nor a folder of them")
