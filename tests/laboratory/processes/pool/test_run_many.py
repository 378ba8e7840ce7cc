"""Many items: the same comes of them here and in processes, whatever happens to those."""

from __future__ import annotations

import faulthandler
import itertools
import os
import pickle
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot.processes.pool import OutOfTimeError, WorkerDiedError, processes, run_many
from space_robot_msgs_py.errors import DivergedError, InputError

WORKERS = pytest.mark.parametrize("workers", [0, 1, 3])


def reciprocal(number: float) -> float:
    return 1.0 / number


@settings(max_examples=10, deadline=None)
@given(st.lists(st.integers(-3, 3), max_size=20), st.integers(0, 3))
def test_every_item_is_done_once(numbers: list[int], workers: int) -> None:
    done = list(run_many(reciprocal, numbers, workers=workers))
    assert sorted(d.item for d in done) == sorted(numbers)
    for one in done:
        if one.item:
            assert one.result == 1.0 / one.item
            assert one.error is None
        else:
            assert one.result is None
            assert isinstance(one.error, ZeroDivisionError)


@WORKERS
def test_items_are_taken_as_they_are_needed(workers: int) -> None:
    """Of infinitely many, two a worker; and results come while items are taken."""
    taken = itertools.count()
    running = run_many(reciprocal, (next(taken) for _ in itertools.count()), workers=workers)
    for _ in range(20):
        next(running)
    running.close()
    assert next(taken) <= 20 + 2 * max(workers, 1)


@WORKERS
def test_an_iterator_that_fails_ends_it(workers: int) -> None:
    def items() -> Iterator[int]:
        yield 1
        raise OSError("no more")

    with pytest.raises(OSError, match="no more"):
        list(run_many(reciprocal, items(), workers=workers))


def diverge(tick: int) -> None:
    raise DivergedError(tick, 0.1, "too fast")


class SilentError(Exception):
    def __init__(self, one: int, other: int) -> None:
        super().__init__(f"{one} and {other}")
        self.lock = threading.Lock()


def raise_silent(_: int) -> None:
    raise SilentError(1, 2)


def test_errors_come_as_they_are_with_their_traceback() -> None:
    (done,) = run_many(diverge, [7])
    assert isinstance(done.error, DivergedError)
    assert done.error.tick == 7
    assert "in diverge" in str(done.error.__cause__)


def test_an_error_that_cannot_be_pickled_comes_as_its_text() -> None:
    with pytest.raises(TypeError):
        pickle.dumps(SilentError(1, 2))
    (done,) = run_many(raise_silent, [7])
    assert str(done.error) == "SilentError: 1 and 2"


def test_what_cannot_be_pickled_is_an_error_of_its_item() -> None:
    done = list(run_many(lambda text: open(text), ["/dev/null"]))  # noqa: SIM115
    done += run_many(reciprocal, [threading.Lock(), 2.0])  # type: ignore[list-item]
    assert [type(d.error) for d in done] == [TypeError, TypeError, type(None)]


def test_large_items_and_results_pass() -> None:
    """Larger than what a pipe holds, in both directions at once."""
    items = [bytes([n]) * 3_000_000 for n in range(4)]
    assert sorted(d.result or b"" for d in run_many(bytes.upper, items, workers=2)) == items


def end_somehow(how: str) -> str:
    match how:
        case "exit":
            os._exit(0)
        case "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        case "segfault":
            faulthandler.disable()  # pytest's, which would print all stacks
            os.kill(os.getpid(), signal.SIGSEGV)
        case "system exit":
            raise SystemExit(3)
        case "interrupt":
            raise KeyboardInterrupt
        case "sleep":
            time.sleep(60.0)
        case "kill server":
            os.kill(os.getppid(), signal.SIGKILL)
            time.sleep(60.0)
    return how


def with_a_circle(_: int) -> int:
    """Leave a megabyte that only the collector of cycles frees; return the process's pages."""
    circle: list[object] = [bytearray(b"1" * 2**20)]
    circle.append(circle)
    return int(Path("/proc/self/statm").read_text().split()[1])


def test_the_memory_of_workers_does_not_grow_with_items() -> None:
    pages = [done.value() for done in run_many(with_a_circle, range(60), workers=1)]
    grown = (max(pages) - pages[5]) * os.sysconf("SC_PAGESIZE")
    assert grown < 5 * 2**20


def test_workers_that_die_are_replaced() -> None:
    items = ["a", "exit", "b", "kill", "segfault", "c", *"defg"]
    done = {d.item: d for d in run_many(end_somehow, items, workers=2, attempts=2)}
    assert done.keys() == set(items)
    before = "its process died in each of 2 attempts, the last time "
    assert {item: str(d.error) for item, d in done.items() if d.error} == {
        "exit": before + "with exit code 0",
        "kill": before + "by SIGKILL",
        "segfault": before + "by SIGSEGV",
    }
    assert all(d.result == item for item, d in done.items() if not d.error)
    assert all(isinstance(d.error, (WorkerDiedError, type(None))) for d in done.values())


@WORKERS
def test_what_would_end_a_process_is_an_error_of_its_item(
    workers: int, capfd: pytest.CaptureFixture[str]
) -> None:
    expected = {"system exit": "SystemExit: 3", "interrupt": "KeyboardInterrupt"}
    if not workers:  # here Ctrl-C is the user's
        del expected["interrupt"]
    done = run_many(end_somehow, list(expected), workers=workers)
    assert {d.item: str(d.error) for d in done} == expected
    assert capfd.readouterr().err == ""


def test_the_clock_of_a_timeout_begins_anew_with_every_item(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By a clock that stands while an item runs, and then goes on by 0.7 of the timeout."""
    now = [0.0]
    monkeypatch.setattr(processes, "time", SimpleNamespace(monotonic=lambda: now[0]))
    done = []
    for one in run_many(sleep_shortly, range(6), workers=1, timeout_s=10.0):
        done.append((one.item, one.error))
        now[0] += 7.0
    assert done == [(item, None) for item in range(6)]


def sleep_shortly(item: int) -> int:
    time.sleep(0.05)
    return item


def test_a_server_that_dies_is_replaced() -> None:
    done = list(run_many(end_somehow, ["a", "kill server", "b"], attempts=2))
    assert [d.item for d in done] == ["a", "kill server", "b"]
    assert [type(d.error) for d in done if d.error] == [WorkerDiedError]


def die_twice(folder: Path) -> int:
    attempt = len(list(folder.iterdir()))
    (folder / str(attempt)).touch()
    if attempt < 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return attempt


def test_an_item_is_tried_again(tmp_path: Path) -> None:
    (done,) = run_many(die_twice, [tmp_path], attempts=3)
    assert done.result == 2


def test_a_worker_that_dies_idle_is_replaced() -> None:
    def items() -> Iterator[int]:
        yield 0
        while not pids:
            yield 0
        os.kill(pids[0], signal.SIGKILL)
        yield from range(5)

    pids: list[int] = []
    for done in run_many(lambda _: os.getpid(), items()):
        assert done.error is None
        pids.append(done.result or 0)
    assert len(set(pids)) == 2


def test_an_item_is_out_of_time_by_itself() -> None:
    """What its worker was to go on with is done all the same."""
    started = time.monotonic()
    done = list(run_many(end_somehow, ["a", "sleep", "b", "c"], timeout_s=0.4))
    assert time.monotonic() - started < 30.0
    assert [d.item for d in done] == ["a", "sleep", "b", "c"]
    assert [type(d.error) for d in done if d.error] == [OutOfTimeError]
    assert str(done[1].error) == "not over after 0.4 s"


def test_workers_are_replaced_while_threads_hold_locks() -> None:
    """A worker forked from this process now would wait for the lock for good."""
    lock = threading.Lock()

    def use(number: int) -> int:
        with lock:
            if number == 2:
                os._exit(1)
            return number

    running = run_many(use, range(5), attempts=1, timeout_s=20.0)
    with lock:
        done = list(running)
    assert [type(d.error) for d in done if d.error] == [WorkerDiedError]


@pytest.mark.parametrize(
    "options",
    [
        {"workers": -1},
        {"attempts": 0},
        {"timeout_s": 0.0},
        {"timeout_s": float("nan")},
        {"workers": 0, "timeout_s": 1.0},
    ],
)
def test_arguments_that_cannot_be(options: dict[str, int]) -> None:
    with pytest.raises(InputError):
        run_many(reciprocal, [1], **options)  # type: ignore[arg-type]
