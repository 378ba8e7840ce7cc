"""Files of a bag in a folder or a single file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from mcap.writer import MCAP0_MAGIC

from ..config.text import MOST_COMPARED, MOST_NEAR, nearest, printable
from ..errors import InputError
from .batch import Batch
from .contents import Bag, BagInformation, Storage, read_information, some_of
from .mcap_storage import McapStorage
from .writer import METADATA

if TYPE_CHECKING:
    from rosbags.rosbag2 import Reader

_SQLITE_MAGIC = b"SQLite format 3\0"
_STORAGES = (".mcap", ".db3")
_BATCH = 1000


class RosbagsStorage:
    """A db3 file, or the folder of a bag that rosbag2 compressed."""

    def __init__(self, path: Path) -> None:
        """Look at it.

        Raises:
            InputError: it cannot be read.
        """
        self._path, self._fault = path, ""
        self.counts: Counter[str] | None = None
        self.metadata: dict[str, dict[str, str]] = {}
        self.has_end = True
        try:
            with _reader(path) as reader:
                self._types = {str(c.topic): str(c.msgtype) for c in reader.connections}
        except Exception as error:  # sqlite and zstd have errors of their own
            raise InputError(f"{path}: cannot be read ({_line(error)})") from None

    def topics(self) -> dict[str, str]:
        """Return the type by topic."""
        return self._types

    @property
    def incomplete(self) -> bool:
        """True if the messages could not be read to their end."""
        return bool(self._fault)

    @property
    def damage(self) -> list[str]:
        """The sentence that says so."""
        return [self._fault] if self._fault else []

    def batches(self) -> Iterator[Batch]:
        """Yield all messages by log time; they end where they can no longer be read."""
        self._fault = ""
        waiting: dict[str, list[tuple[int, bytes]]] = {name: [] for name in self._types}
        try:
            with _reader(self._path) as reader:
                for connection, log_ns, data in reader.messages():
                    name = str(connection.topic)
                    waiting[name].append((int(log_ns), bytes(memoryview(data))))
                    if len(waiting[name]) == _BATCH:
                        yield Batch.of(name, self._types[name], waiting[name])
                        waiting[name] = []
        except Exception as error:  # likewise
            self._fault = f"{self._path.name}: cannot be read to its end ({_line(error)})"
        for name, messages in waiting.items():
            if messages:
                yield Batch.of(name, self._types[name], messages)


def _reader(path: Path) -> Reader:
    from rosbags.rosbag2 import Reader  # few bags need it, with its YAML and SQLite

    return Reader(path)


def _line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def open_bag(path: Path) -> Bag:
    """Open the bag in a folder, or a single file of a bag, finished or not.

    Raises:
        InputError: no bag is there.
        OSError: it cannot be read.
    """
    if path.name == METADATA:
        path = path.parent
    if not path.exists():
        raise InputError(f"{path}: no such bag{_suggestion(path.parent, path.name)}")
    if not path.is_dir():
        return _open_files([path], None, [], closed=True)
    information, damage = None, []
    if closed := (path / METADATA).exists():
        try:
            information = read_information(path)
        except InputError as error:
            damage = [str(error)]
    if information and information.compressed:
        for name in information.relative_file_paths:
            _check_regular(path / Path(name).name)
        return Bag([RosbagsStorage(path)], information, [], closed)
    files = [file for suffix in _STORAGES for file in path.glob(f"*{suffix}")]
    files.sort(key=lambda file: (len(file.name), file.name))
    if information:
        files = _listed(path, information, files, damage)
    if not files and damage:
        raise InputError(damage[-1])
    if not files:
        hint = f"{path}: not a bag folder (no {METADATA}, no .mcap)"
        raise InputError(f"{hint}{_suggestion(path)}")
    return _open_files(files, information, damage, closed)


def _suggestion(folder: Path, name: str = "") -> str:
    """Return the bags in a folder as a suggestion: those with a similar name, or any of them."""
    try:
        entries = sorted(islice(folder.iterdir(), MOST_COMPARED))
        bags = {file.name: file for file in entries if (file / METADATA).is_file()}
    except OSError:
        return ""
    names = nearest(name, list(bags)) if name else list(bags)[:MOST_NEAR]
    near = " or ".join(printable(str(bags[key])) for key in names)
    return f" (did you mean {near}?)" if near else ""


def _listed(
    path: Path, information: BagInformation, existing: list[Path], damage: list[str]
) -> list[Path]:
    """Return the existing files that metadata.yaml names, in its order."""
    names = [Path(name).name for name in information.relative_file_paths]
    files = [path / name for name in names if (path / name).exists()]
    missing = [name for name in names if not (path / name).exists()]
    others = [file for file in existing if file.name not in names]
    if missing:
        damage.append(f"{path / METADATA} names {some_of(missing)}, not there")
    if others:
        what = "left out" if files else "read instead"
        damage.append(f"{METADATA} does not name {some_of([f.name for f in others])}: {what}")
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
    # Reading a pipe or a device may never end.
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
