"""The force of a law with mistakes: one line that names the law, the tick and the place."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest

from space_robot.processes.interruption import Interrupted
from space_robot_control.laws import ControlLaw, LawGains
from space_robot_control.laws.checked import LawError, force_of
from space_robot_msgs_py.errors import InputError


class Law(ControlLaw):
    name: ClassVar[str] = "mine"
    gains_type: ClassVar[type[LawGains]] = LawGains
    what: Callable[[], Any]

    def force(self, signals: Any) -> Any:
        return self.what()


def raise_it(error: BaseException) -> Any:
    raise error


def outcome(what: Callable[[], Any]) -> str:
    law = Law({}, 0.001, 9)
    law.what = what
    with pytest.raises(LawError) as raised:
        force_of(law, None, 7)  # type: ignore[arg-type]
    text = str(raised.value)
    assert text.startswith("controller mine failed at tick 7: ")
    assert "\n" not in text
    return text


@pytest.mark.parametrize(
    ("what", "said"),
    [
        (lambda: 1 / 0, "ZeroDivisionError: division by zero (test_checked.py, line "),
        (lambda: sys.exit("no\nfuel"), "SystemExit: no fuel (test_checked.py, line "),
        (lambda: raise_it(MemoryError()), "MemoryError (test_checked.py, line "),
        (lambda: raise_it(GeneratorExit()), "GeneratorExit (test_checked.py, line "),
        (lambda: "abc", "an array of float64, got 'abc'"),
        (lambda: None, "got None"),
        (lambda: np.zeros(4), "force() must return 9 numbers, an array of float64, got shape (4,)"),
        (lambda: np.zeros((9, 1)), "got shape (9, 1)"),
        (lambda: np.zeros(9, np.float32), "got shape (9,), float32"),
    ],
)
def test_a_mistake_is_one_line(what: Callable[[], Any], said: str) -> None:
    assert said in outcome(what)


def test_endless_recursion_is_one_line() -> None:
    def again() -> Any:
        return again()

    assert "RecursionError" in outcome(again)


def test_ctrl_c_is_the_users_and_no_mistake_of_the_law() -> None:
    law = Law({}, 0.001, 9)
    law.what = lambda: raise_it(KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):  # by Python's own handler
        force_of(law, None, 7)  # type: ignore[arg-type]
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # as in workers and commands
    try:
        assert "KeyboardInterrupt" in outcome(law.what)
        law.what = lambda: raise_it(Interrupted(signal.SIGTERM))
        with pytest.raises(Interrupted):
            force_of(law, None, 7)  # type: ignore[arg-type]
    finally:
        signal.signal(signal.SIGINT, before)


def test_clear_errors_and_forces_pass_as_they_are() -> None:
    law = Law({}, 0.001, 9)
    law.what = lambda: raise_it(InputError("clear"))
    with pytest.raises(InputError, match=r"^clear$"):
        force_of(law, None, 7)  # type: ignore[arg-type]
    force = np.arange(9.0)
    law.what = lambda: force
    assert force_of(law, None, 7) is force  # type: ignore[arg-type]
