"""Plugin of pytest: a test that hangs ends with its process, and another one does the other tests.

pytest-timeout interrupts Python, but neither a wait within C++ nor what a test has to put away
after it failed, for which it has no time left.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import signal
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from xdist.scheduler import LoadFileScheduling

HUNG_S = 720.0
"""Longest time until a test is over, and from then on for its fixtures: more than pytest-timeout's,
which only one test fails by."""
PR_SET_PDEATHSIG = 1
"""Option of prctl(2): signal sent to a process when its parent ends."""
STANDARD_ERROR = pytest.StashKey[int]()


def pytest_configure(config: pytest.Config) -> None:
    """Keep standard error, which is a file in tests; let forked processes end with this one.

    They have the pipe to pytest-xdist open, which takes this process to be there as long.
    """
    config.stash[STANDARD_ERROR] = os.dup(2)
    prctl = ctypes.CDLL(None).prctl
    os.register_at_fork(after_in_child=lambda: prctl(PR_SET_PDEATHSIG, signal.SIGKILL))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Begin the time of a test."""
    faulthandler.dump_traceback_later(HUNG_S, exit=True, file=item.config.stash[STANDARD_ERROR])


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_teardown(item: pytest.Item) -> None:
    """Begin the time of its fixtures: where a test has failed, pytest has ended the test's."""
    pytest_runtest_setup(item)


def pytest_runtest_logfinish() -> None:
    """The test is over."""
    faulthandler.cancel_dump_traceback_later()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadFileScheduling | None:
    """Distribute files so that a process may die.

    When one does, pytest-xdist 3.8 repeats the test in which it died in the next process, up to
    eight times. It also gives the files that were done to the others, which then wait for a test
    to end that never began; as does a process that is given a single test.
    """
    if config.getoption("dist") != "loadfile":
        return None
    from xdist.scheduler import LoadFileScheduling

    class Scheduling(LoadFileScheduling):
        def remove_node(self, node: Any) -> str | None:
            files = self.assigned_work[node]
            results = [test for tests in files.values() for test in tests.items()]
            died_in = next((test for test, is_over in results if not is_over), None)
            for file, tests in list(files.items()):
                if died_in in tests:
                    tests[died_in] = True
                if all(tests.values()):
                    del files[file]
            super().remove_node(node)
            return died_in

        def _reschedule(self, node: Any) -> None:
            while (
                node in self.registered_collections  # else it is still to find its tests
                and not node.shutting_down
                and self._pending_of(self.assigned_work[node]) < 2
            ):
                super()._reschedule(node)

    return Scheduling(config, log)
