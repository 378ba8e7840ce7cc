"""A server of viser for browsers on this machine only, without output."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from viser import ViserServer


@contextmanager
def local_server(port: int = 0) -> Iterator[ViserServer]:
    """Serve scenes on 127.0.0.1.

    Args:
        port: to listen on; the next free one if it is in use. 0: any.
    """
    from rich import get_console
    from viser import ViserServer

    # an unused connection of a browser is not an error
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
    console = get_console()
    was_quiet, console.quiet = console.quiet, True
    try:
        server = ViserServer(host="127.0.0.1", port=port, verbose=False)
        try:
            yield server
        finally:
            server.stop()
    finally:
        console.quiet = was_quiet
