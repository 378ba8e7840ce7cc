"""Progress where no line can be redrawn."""

from __future__ import annotations

import threading

import pytest

from space_robot.console import progress
from space_robot.console.progress import WATCHER


def test_what_is_watched_is_a_line_now_and_then_and_complete_at_the_end(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress, "WATCH_S", 0.001)
    monkeypatch.setattr(progress, "WATCHED_LINE_S", 0.0)
    counts = iter(range(4))
    seen = threading.Event()

    def count() -> int:
        done = next(counts, 4)
        if done == 4:
            seen.set()
        return done

    with progress.watching_progress("kernels", 4, count):
        assert seen.wait(10.0)
    said = capsys.readouterr().err.splitlines()
    assert [f"kernels {k}/4" for k in range(1, 5)] == list(dict.fromkeys(said[1:-1]))[-4:]
    assert "4/4" in said[-1]
    assert WATCHER not in {thread.name for thread in threading.enumerate()}


def test_an_error_ends_the_watch() -> None:
    with pytest.raises(KeyError), progress.watching_progress("kernels", 1, lambda: 0):
        raise KeyError
    assert WATCHER not in {thread.name for thread in threading.enumerate()}
