"""Where things are in the checkout."""

from pathlib import Path

TESTS = Path(__file__).resolve().parent
ROOT = TESTS.parent
CONFIG = ROOT / "config"
DOCS = ROOT / "docs"
DATA = TESTS / "data"
