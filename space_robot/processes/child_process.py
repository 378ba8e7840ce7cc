"""A child process of a command."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from space_robot_msgs_py.ros.process import clean_environment, lifeline


@contextmanager
def child_process(command: Sequence[str], **options: Any) -> Iterator[subprocess.Popen[bytes]]:
    """Start a process that ends with the context or this process; ``options``: of `Popen`.

    It must be one that holds to its standard input, see `hold_to_standard_input`.
    """
    environment = {**clean_environment(), **lifeline(), **options.pop("env", {})}
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, env=environment, start_new_session=True, **options
    ) as process:
        try:
            yield process
        finally:
            process.terminate()
