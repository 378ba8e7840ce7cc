"""Colours of the pages, on dark and on light ones."""

from __future__ import annotations

ON_DARK = ("#56B4E9", "#E98FC0", "#2CC295", "#E69F00", "#F0E442", "#FF7F41")
ON_WHITE = ("#0072B2", "#CC79A7", "#009E73", "#E69F00", "#8A7F00", "#D55E00")
"""Colours of Okabe and Ito, adapted to dark and light pages."""
NADIR, VELOCITY, SUN = 2, 5, 4
"""Places of the arrows' colours in them; flights have the first ones."""


def palette(dark: bool) -> tuple[str, ...]:
    """Return the colours of a page that is light on dark, or dark on light."""
    return ON_DARK if dark else ON_WHITE
