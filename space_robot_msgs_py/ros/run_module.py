"""``python .../run_module.py MODULE ARGUMENT...``: ``python -m`` without the current folder.

``python -m`` looks for every import in the current folder first, so a ``queue.py`` of the user's
there would run in our processes. Here only PYTHONPATH and what is installed are searched. (From
Python 3.11 on, ``-P`` does the same.) As a module: the command line that does so.
"""

from __future__ import annotations

import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))


def module_command(module: str, *arguments: str) -> list[str]:
    """The command line that runs ``module`` as a program under this Python."""
    return [sys.executable, os.path.join(HERE, "run_module.py"), module, *arguments]


def clean_environment() -> dict[str, str]:
    """This process' environment; an empty entry of PYTHONPATH would be the current folder."""
    environment = dict(os.environ)
    if "PYTHONPATH" in environment:
        entries = environment["PYTHONPATH"].split(os.pathsep)
        environment["PYTHONPATH"] = os.pathsep.join(entry for entry in entries if entry)
    return environment


def _main() -> None:
    root = os.path.dirname(os.path.dirname(HERE))
    # a script's own folder is put first, and ours holds modules that are no top-level ones
    sys.path[:] = [path for path in sys.path if os.path.abspath(path) != HERE]
    if root not in sys.path:  # an uninstalled tree in the parent's current folder
        sys.path.insert(0, root)
    import runpy

    sys.argv = sys.argv[1:]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    _main()
