"""Fly what the pages show and write it into them: `python docs/flown [--all] [PAGE ...]`.

A PAGE is the name of its definition in this folder; without one all are made. Only stale flights
are flown again, see `flown_tables`; with ``--all`` all are.
"""

from __future__ import annotations

import argparse

from flown_tables import DOCS, pages


def main() -> None:
    """Run the command."""
    known = pages()
    parser = argparse.ArgumentParser(prog="python docs/flown", description=__doc__)
    parser.add_argument("--all", action="store_true", help="fly all flights again")
    parser.add_argument("pages", nargs="*", metavar="PAGE", help=f"of {', '.join(known)}")
    arguments = parser.parse_args()
    for name in arguments.pages or known:
        page = known[name]
        flights = list(page.flights()) if arguments.all else page.stale(lambda _: True)
        print(f"{page.path}: {len(flights)} of {len(page.flights())} flights")
        page.fly(flights)
        (DOCS / page.path).write_text(page.written(page.text()), "utf-8")


if __name__ == "__main__":
    main()
