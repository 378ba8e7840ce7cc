"""Makes the picture of docs/manual/ground.md: a flight in Open MCT, as Chromium shows it.

Needs the extras `ground` and `view`, Open MCT (`make ground`), and Chromium of the system.
"""

from __future__ import annotations

import io
import re
import subprocess
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from devtools import Browser
from PIL import Image

from space_robot import Scenario

FILE = Path(__file__).parent / "manual" / "ground.png"
SIZE = (1300, 820)
DRAWN_S = 8.0
COLOURS = 128


def main() -> None:
    """Fly, serve the bag, and take the picture."""
    faults, events = ["drive_scale@12-14:all=0.9"], ["capture@7:small_satellite"]
    with TemporaryDirectory() as folder:
        bag = Path(folder) / "flight"
        Scenario(actuators="wheels", faults=faults, events=events, swaps=["20:tde_tsmc"]).fly(
            bag=bag
        )
        command = ["space-robot", "ground", str(bag), "--no-open", "--port", "0"]
        server = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        assert server.stderr
        try:
            address = re.search(r"http://\S+/", server.stderr.readline())
            assert address
            with Browser() as browser:
                tab = browser.tab(*SIZE)
                tab.open(address[0])
                tab.wait("document.body.innerText.includes('law in force: tde_tsmc')")
                time.sleep(DRAWN_S)
                image = Image.open(io.BytesIO(tab.picture()))
        finally:
            server.terminate()
            server.wait()
    image.convert("RGB").quantize(COLOURS).save(FILE, optimize=True)


if __name__ == "__main__":
    main()
