"""Standard output and error that cannot be written: a full disk, a reader that has gone."""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, suppress
from typing import IO, Any

_WRITING = {errno.ENOSPC, errno.EPIPE, errno.EIO, errno.EBADF, errno.EFBIG, errno.EDQUOT}


@contextmanager
def standard_streams() -> Iterator[None]:
    """Take any letters; let go what standard error does not take: a flight does not end for it."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    with redirect_stderr(_Forgiving(sys.stderr)):
        yield


def is_of_output(error: OSError) -> bool:
    """Return True if standard output could not be written; what it has not taken is then dropped.

    Errors of files name them.
    """
    if error.filename is not None or error.errno not in _WRITING:
        return False
    _drop(sys.stdout)
    return True


class _Forgiving:
    """A stream whose words may be lost."""

    def __init__(self, stream: IO[str]) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        try:
            return self._stream.write(text)
        except OSError:
            _drop(self._stream)
            return len(text)

    def flush(self) -> None:
        try:
            self._stream.flush()
        except OSError:
            _drop(self._stream)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def _drop(stream: IO[str]) -> None:
    """Have what the stream still holds, and all to come, go nowhere: the interpreter flushes it."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
