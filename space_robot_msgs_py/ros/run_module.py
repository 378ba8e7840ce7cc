"""``python .../run_module.py MODULE ARGUMENT...``: ``python -m`` without the current folder.

``python -m`` searches every import in the current folder first, so a user's ``queue.py`` there
would run in our processes. Here only PYTHONPATH and installed packages are searched. (From Python
3.11 on, ``-P`` does the same.) Imported as a module, it builds the command line.
"""

from __future__ import annotations

import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))


def module_command(module: str, *arguments: str) -> list[str]:
    """Return the command line that runs ``module`` as a program with this Python."""
    return [sys.executable, os.path.join(HERE, "run_module.py"), module, *arguments]


def clean_environment() -> dict[str, str]:
    """Return this process' environment without the current folder (empty entries) in PYTHONPATH."""
    environment = dict(os.environ)
    if "PYTHONPATH" in environment:
        entries = environment["PYTHONPATH"].split(os.pathsep)
        environment["PYTHONPATH"] = os.pathsep.join(entry for entry in entries if entry)
    return environment


def _main() -> None:
    root = os.path.dirname(os.path.dirname(HERE))
    # Python adds the script's folder, whose modules are not top-level ones
    sys.path[:] = [path for path in sys.path if os.path.abspath(path) != HERE]
    if root not in sys.path:  # a source tree in the parent's current folder
        sys.path.insert(0, root)
    import runpy

    sys.argv = sys.argv[1:]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    _main()
