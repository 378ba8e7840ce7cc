"""``python tests/matrix --write`` flies all scenarios and stores their digests anew."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import yaml

sys.path.insert(0, str(Path(__file__).parents[1]))

from matrix.scenarios import DIGESTS, PLANS, digests, fly, stored_digests, what_changed

HEADER = """\
# Digests of the flights of the matrix, as this process flies them: `python tests/matrix --write`.
# Each of all columns, of groups of signals, and of ten parts of the flight one after the other.
"""


def main() -> None:
    """Fly, say what has changed, and write the file if that is asked."""
    now = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, plan in PLANS.items():
            now[name] = digests(fly(plan, Path(folder) / name))
            before = stored_digests().get(name)
            if before is None:
                print(f"{name}: new")
            elif now[name] != before:
                print(f"{name}: {what_changed(now[name], before)}")
    if sys.argv[1:] == ["--write"]:
        text = yaml.safe_dump(now, sort_keys=False, default_flow_style=None, width=1000)
        DIGESTS.write_text(HEADER + text, "utf-8")


main()
