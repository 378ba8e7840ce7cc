"""Makes pictures of pages of `space-robot view`, as Chromium shows them.

    python docs/view_picture.py PAGE PICTURE [SECONDS]
    python docs/view_picture.py --gallery

The second form flies what docs/gallery.md shows and makes its pictures. Needs `websockets`, which
comes with the extra `view`, and Chromium of the system.
"""

from __future__ import annotations

import io
import sys
import tempfile
import time
from pathlib import Path

from devtools import Browser
from PIL import Image

DOCS = Path(__file__).resolve().parent
SIZE = (1300, 720)
OF_GALLERY = (650, 360)
SHARE = 0.6
"""Part of a flight after which it is shown, unless another time is asked for."""
LIGHT_S = 5.0
"""Until the light is right without a graphics card."""
QUALITY = 80
TIMES = "JSON.parse(document.getElementById('data').textContent).time"
NOTICES = "document.getElementById('scene').contentDocument.querySelectorAll('{}')"


def picture(
    page: Path, file: Path, seconds: float | None = None, size: tuple[int, int] = SIZE
) -> None:
    """Write the picture of a page at so many seconds of its flight; of another page, as it is."""
    with Browser() as browser:
        tab = browser.tab(*SIZE)
        tab.open(page.absolute().as_uri())
        if tab.value("document.getElementById('scene') !== null"):
            tab.wait("window.spaceRobot && spaceRobot.time() > 0")
            if seconds is None:
                first, last = tab.value(f"(t => [t[0], t[t.length - 1]])({TIMES})")
                seconds = first + SHARE * (last - first)
            tab.value(f"spaceRobot.seek({seconds})")
            close = NOTICES.format(".mantine-CloseButton-root")  # that there is no graphics card
            tab.value(f"{close}.forEach(button => button.click())")
            time.sleep(LIGHT_S)
        shown = Image.open(io.BytesIO(tab.picture())).convert("RGB")
    shown.resize(size, Image.Resampling.LANCZOS).save(file, quality=QUALITY)


def gallery() -> None:
    """Write the pictures of the gallery."""
    sys.path.insert(0, str(DOCS / "hooks"))
    from gallery import GALLERY, pages

    for name, content in pages((DOCS / GALLERY).read_text("utf-8")):
        with tempfile.TemporaryDirectory() as folder:
            page = Path(folder) / f"{name}.html"
            page.write_bytes(content)
            picture(page, DOCS / f"gallery/{name}.webp", size=OF_GALLERY)
        print(name)


if __name__ == "__main__":
    if sys.argv[1:] == ["--gallery"]:
        gallery()
    else:
        seconds = float(sys.argv[3]) if len(sys.argv) > 3 else None
        picture(Path(sys.argv[1]), Path(sys.argv[2]), seconds)
