"""``python tests/outputs [CHAIN ...]``: run the commands and keep what they print."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from outputs.printed import CHAINS, HERE, printed

for chain in sys.argv[1:] or CHAINS:
    with tempfile.TemporaryDirectory() as folder:
        lines = printed(chain, Path(folder).resolve())
    (HERE / f"{chain}.txt").write_text("\n".join(lines), "utf-8")
    print(f"{chain}: {len(lines)} lines")
