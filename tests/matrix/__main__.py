"""``python tests/matrix [NAME ...] [--write]``: fly scenarios again and compare their digests.

With ``--write`` those of all scenarios are stored anew.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import yaml

sys.path.insert(0, str(Path(__file__).parents[1]))

from matrix.scenarios import ADVICE, DIGESTS, PLANS, digests, fly, stored_digests, what_changed

HEADER = """\
# Digests of the flights of the matrix in this process, written by `python tests/matrix --write`:
# of all signals together, of groups of them, and of ten parts of the flight, one after the other.
"""


def main(words: list[str]) -> int:
    """Fly, say what has changed, and write the file if that is asked; return the exit code."""
    is_written = "--write" in words
    chosen = [PLANS[word] for word in words if word != "--write"]
    now, changed = {}, 0
    with tempfile.TemporaryDirectory() as folder:
        for plan in PLANS.values() if is_written or not chosen else chosen:
            now[plan.name] = digests(fly(plan, Path(folder) / plan.name))
            before = stored_digests().get(plan.name)
            is_same = now[plan.name] == before
            changed += not is_same
            said = what_changed(now[plan.name], before) if before and not is_same else "new"
            print(f"{plan.name}: {'as stored' if is_same else said}")
    if is_written:
        text = yaml.safe_dump(now, sort_keys=False, default_flow_style=None, width=1000)
        DIGESTS.write_text(HEADER + text, "utf-8")
    elif changed:
        print(ADVICE)
    return 1 if changed and not is_written else 0


sys.exit(main(sys.argv[1:]))
