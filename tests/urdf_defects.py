"""URDFs with one defect each, and what is said of it: the rows of ``data/refusals/urdf.yaml``."""

from __future__ import annotations

import re
from typing import NamedTuple

import yaml
from paths import DATA

GOOD = (DATA / "arm.urdf").read_text()
WORDS = {
    "$GOOD": GOOD,
    "$HULL": re.search(r"    <inertial>.*?</inertial>\n", GOOD, re.DOTALL)[0],  # type: ignore[index]
    "$UPPER": GOOD[GOOD.index('<link name="upper">') :].split("</inertial>")[0].split(">", 1)[1],
    "$DEEP": "<a>" * 200 + "</a>" * 200,
}


class Defect(NamedTuple):
    """What is written in the place of something else, and what is said about it."""

    old: str
    new: str
    part: str
    line: int
    text: str
    repair: str = ""
    """Empty: it has none."""

    @classmethod
    def of(cls, row: list[str | int]) -> Defect:
        texts = list(map(str, row))
        for word, meaning in WORDS.items():
            texts[:2] = [text.replace(word, meaning) for text in texts[:2]]
        return cls(*texts)._replace(line=int(texts[3]))  # type: ignore[arg-type]

    @property
    def urdf(self) -> str:
        """The good URDF with it."""
        assert self.old in GOOD
        return GOOD.replace(self.old, self.new, 1)


ROWS = yaml.safe_load((DATA / "refusals/urdf.yaml").read_text("utf-8"))
DEFECTS = {name: Defect.of(row) for name, row in ROWS.items()}
