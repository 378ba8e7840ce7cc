"""What commands print, and what their figures and pages hold, is what is kept here.

Whatever changes is seen in `<chain>.txt`, and is to be wanted: `python tests/outputs` writes them.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from shown import differences

from outputs.printed import CHAINS, HERE, printed


@pytest.mark.parametrize("chain", CHAINS)
def test_what_is_printed_is_what_is_kept(chain: str, tmp_path: Path) -> None:
    kept = (HERE / f"{chain}.txt").read_text("utf-8").splitlines()
    found = list(differences(kept, printed(chain, tmp_path)))
    assert not found, (
        "\n".join(found[:20]) + f"\n({len(found)} lines): python tests/outputs {chain}"
    )
