"""A bag: the files in a folder or a single file, with the metadata.yaml of rosbag2."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mcap.writer import MCAP0_MAGIC
from pydantic import BaseModel, Field

from ..config.text import MOST_COMPARED, MOST_NEAR, nearest, printable
from ..config.validation import read_yaml, validate
from ..errors import InputError
from .batch import Batch
from .mcap_storage import McapStorage
from .writer import DESCRIPTION, METADATA

if TYPE_CHECKING:
    from rosbags.rosbag2 import Reader

_SQLITE_MAGIC = b"SQLite format 3\0"
_STORAGES = (".mcap", ".db3")
_BATCH = 1000


class _Topic(BaseModel):
    name: str


class _Count(BaseModel):
    topic_metadata: _Topic
    message_count: int


class BagInformation(BaseModel):
    """Metadata of rosbag2 about a bag, of any version, as needed by a reader."""

    relative_file_paths: list[str] = Field(default_factory=list)
    topics_with_message_count: list[_Count]
    compression_mode: str = ""
    custom_data: dict[str, Any] | None = None

    @property
    def noted(self) -> dict[str, str]:
        """Custom data, as texts."""
        return {key: str(value) for key, value in (self.custom_data or {}).items()}

    @property
    def counts(self) -> dict[str, int]:
        """Number of messages per topic."""
        return {t.topic_metadata.name: t.message_count for t in self.topics_with_message_count}


def read_information(path: Path) -> BagInformation:
    """Read the metadata in a bag's folder."""
    file = path / METADATA
    content = read_yaml(file).get("rosbag2_bagfile_information")
    if not isinstance(content, dict):
        raise InputError(f"{file}: not the metadata of a rosbag2 bag")
    return validate(BagInformation, content, str(file))


class Bag:
    """Files of a bag, with the metadata of rosbag2."""

    def __init__(
        self,
        files: Sequence[Storage],
        information: BagInformation | None,
        damage: list[str],
        closed: bool,
        lacks_files: bool = False,
    ) -> None:
        """Build from the contents of a folder.

        Args:
            files: in the order of their writing.
            information: metadata.yaml's (None: there is none that can be read).
            damage: what is wrong with the folder, a sentence each.
            closed: False if the bag is unfinished for lack of a metadata.yaml.
            lacks_files: True if files that metadata.yaml names are missing.
        """
        self._files, self._damage = files, damage
        self.finished = closed and all(file.has_end for file in files)
        """True if its recorder closed it."""
        self._information, self._lacks_files = information, lacks_files

    def topics(self) -> dict[str, str]:
        """Return the type by topic."""
        return {name: kind for file in self._files for name, kind in file.topics().items()}

    def batches(self) -> Iterator[Batch]:
        """Yield all messages, as they were written, file by file."""
        for file in self._files:
            yield from file.batches()

    def recorded(self) -> dict[str, int] | None:
        """Return the number of messages per topic that the bag should hold; None: unknown.

        By the files' own statistics; by metadata.yaml, if they have none.
        """
        if self._lacks_files or any(file.counts is None for file in self._files):
            return self._information.counts if self._information else None
        return dict(sum((file.counts or Counter() for file in self._files), Counter[str]()))

    def custom_data(self) -> dict[str, str]:
        """Return the custom data of this project's recorder; empty for other recorders.

        From metadata.yaml, or what was noted when recording began and ended.
        """
        if self._information and self._information.custom_data:
            return self._information.noted
        return next((m for f in self._files[::-1] if (m := f.metadata.get(DESCRIPTION))), {})

    @property
    def incomplete(self) -> bool:
        """True if a part of a file was skipped, or a file is missing."""
        return self._lacks_files or any(file.incomplete for file in self._files)

    @property
    def damage(self) -> list[str]:
        """What is wrong with the folder and its files, a sentence each."""
        return self._damage + [text for file in self._files for text in file.damage]

    def counts(self) -> dict[str, int]:
        """Count the messages of each topic that can be read."""
        counts: Counter[str] = Counter()
        for batch in self.batches():
            counts[batch.topic] += len(batch)
        return counts


def some_of(names: Sequence[str]) -> str:
    """Return the first of some names, and how many there are more; a bag may have thousands."""
    shown = 12
    more = f", and {len(names) - shown:,} more" if len(names) > shown else ""
    return ", ".join(names[:shown]) + more


class RosbagsStorage:
    """A db3 file, or the folder of a bag that rosbag2 compressed; has what `McapStorage` has."""

    def __init__(self, path: Path) -> None:
        """Read the topics."""
        self._path = path
        self.counts: Counter[str] | None = None
        self.metadata: dict[str, dict[str, str]] = {}
        self.damage: list[str] = []
        self.has_end, self.incomplete = True, False
        try:
            with _reader(path) as reader:
                self._types = {str(c.topic): str(c.msgtype) for c in reader.connections}
        except Exception as error:  # sqlite and zstd have errors of their own
            raise InputError(f"{path}: cannot be read ({_line(error)})") from None

    def topics(self) -> dict[str, str]:
        """Return the type by topic."""
        return self._types

    def batches(self) -> Iterator[Batch]:
        """Yield all messages by log time; they end where they can no longer be read."""
        self.damage, self.incomplete = [], False
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
            self.damage = [f"{self._path.name}: cannot be read to its end ({_line(error)})"]
            self.incomplete = True
        for name, messages in waiting.items():
            if messages:
                yield Batch.of(name, self._types[name], messages)


Storage = McapStorage | RosbagsStorage


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
    # by rosbag2 itself, rather than chunks by MCAP
    if information and information.compression_mode.lower() in ("file", "message"):
        for name in information.relative_file_paths:
            _check_regular(path / Path(name).name)
        return Bag([RosbagsStorage(path)], information, [], closed)
    files = [file for suffix in _STORAGES for file in path.glob(f"*{suffix}")]
    files.sort(key=lambda file: (len(file.name), file.name))  # _10 behind _9
    if information:
        files = _listed(path, information, files, damage)
    if not files and damage:
        raise InputError(damage[-1])
    if not files:
        hint = f"{path}: not a bag folder (no {METADATA}, no .mcap)"
        raise InputError(f"{hint}{_suggestion(path)}")
    return _open_files(files, information, damage, closed)


def _suggestion(folder: Path, name: str = "") -> str:
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
