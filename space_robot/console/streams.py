"""Handling of standard streams that cannot be written: full disk, closed pipe."""

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
    """Accept all characters, and ignore write errors of standard error: flights continue."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    with redirect_stderr(_Forgiving(sys.stderr)):
        yield


def is_of_output(error: OSError) -> bool:
    """Return True if standard output could not be written; its remaining output is then dropped.

    Errors of files have a file name, errors of standard output have none.
    """
    if error.filename is not None or error.errno not in _WRITING:
        return False
    _drop(sys.stdout)
    return True


class _Forgiving:
    """A stream that ignores write errors."""

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
    """Redirect the stream to the null device: the interpreter flushes it at its end."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
