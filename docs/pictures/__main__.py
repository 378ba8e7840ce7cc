"""Makes the pictures of the pages: `python docs/pictures [NAME ...]`, all without a name.

Each is a function with `@picture` in a file of this folder, which draws what the product computes.
With compiled kernels this takes a few minutes at most.
"""

from __future__ import annotations

import sys
from importlib import import_module

from theme import FOLDER, PICTURES, write

from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError

for path in sorted(FOLDER.glob("[!_]*.py")):
    import_module(path.stem)
try:
    names = [one_of(name, PICTURES, "picture") for name in sys.argv[1:]]
except InputError as error:
    sys.exit(str(error))
for name in names or sorted(PICTURES):
    print(f"{write(name).stat().st_size / 1000:.0f} kB {name}.svg", flush=True)
