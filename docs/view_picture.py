"""Makes pictures of pages of `space-robot view`, as Chromium shows them.

    python docs/view_picture.py PAGE PICTURE [SECONDS]
    python docs/view_picture.py --gallery
    python docs/view_picture.py --film

The second form flies what docs/gallery.md shows and makes its pictures, the third one makes the
film with which README begins. Needs `websockets`, which comes with the extra `view`, and Chromium
of the system.
"""

from __future__ import annotations

import io
import sys
import tempfile
import time
from pathlib import Path

from devtools import Browser, Tab
from PIL import Image

from space_robot import Scenario

DOCS = Path(__file__).resolve().parent
SIZE = (1300, 720)
OF_GALLERY = (650, 360)
SHARE = 0.6
"""Part of a flight after which it is shown, unless another time is asked for."""
LIGHT_S = 5.0
"""Until the light is right without a graphics card."""
QUALITY = 80
FILM, OF_FILM, CUT = DOCS / "in_orbit.webp", (870, 476), (115, 36, 755, 396)
"""File of the film, size of its pages, and what of them it shows, without the player."""
POSTURE = [-55, -50, 75]
FLIGHT = Scenario(
    robot="flexible_panels",
    mission={
        "start": {
            "joints_deg": POSTURE,  # panels and arm towards the Sun, on the side of the camera
            "base": {
                "point": "sun",
                "axis": [0, 0, -1],
                "offset_deg": [0, 45, 0],
                "about": "nadir",
                "about_axis": [-1, 0, 0],
            },
        },
        "segments": [
            {"joints_deg": [45, -25, 45], "duration": 10},
            {"joints_deg": POSTURE, "duration": 10},
        ],
    },
    orbit="iss",
    actuators="wheels",
    parameters={"plant": {"sunlight.beta_angle_deg": -44.0, "sunlight.noon_deg": 38.0}},
    duration=20.0,
)
FRAMES, FRAME_S = 80, 0.09
"""Frames of the film, and how long each is shown: a flight of 20 s takes 7.2 s."""
DRAWN_S = 0.5
"""Until a frame is drawn."""
TIMES = "JSON.parse(document.getElementById('data').textContent).time"
NOTICES = "document.getElementById('scene').contentDocument.querySelectorAll('{}')"


def prepare(tab: Tab) -> tuple[float, float]:
    """Wait until a page of flights plays and return their first and last time, s."""
    tab.wait("window.spaceRobot && spaceRobot.time() > 0")
    close = NOTICES.format(".mantine-CloseButton-root")  # that there is no graphics card
    tab.value(f"{close}.forEach(button => button.click())")
    first, last = tab.value(f"(t => [t[0], t[t.length - 1]])({TIMES})")
    return first, last


def film() -> None:
    """Fly and write the film."""
    with tempfile.TemporaryDirectory() as folder, Browser() as browser:
        page = Path(folder) / "page.html"
        FLIGHT.fly().view(path=page, opens=False)
        tab = browser.tab(*OF_FILM)
        tab.open(page.as_uri())
        first, last = prepare(tab)
        tab.value(
            "document.querySelectorAll('#side, #now').forEach(x => (x.style.display = 'none'))"
        )
        images = []
        for k in range(FRAMES):
            tab.value(f"spaceRobot.seek({first + k / FRAMES * (last - first)})")
            time.sleep(DRAWN_S if k else 3.0 * LIGHT_S)  # labels are late, too
            images.append(Image.open(io.BytesIO(tab.picture())).convert("RGB").crop(CUT))
    images[0].save(
        FILM,
        save_all=True,
        append_images=images[1:],
        duration=round(1e3 * FRAME_S),
        loop=0,
        quality=QUALITY,
    )


def picture(
    page: Path, file: Path, seconds: float | None = None, size: tuple[int, int] = SIZE
) -> None:
    """Write the picture of a page at so many seconds of its flight; of another page, as it is."""
    with Browser() as browser:
        tab = browser.tab(*SIZE)
        tab.open(page.absolute().as_uri())
        if tab.value("document.getElementById('scene') !== null"):
            first, last = prepare(tab)
            if seconds is None:
                seconds = first + SHARE * (last - first)
            tab.value(f"spaceRobot.seek({seconds})")
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
    elif sys.argv[1:] == ["--film"]:
        film()
    else:
        seconds = float(sys.argv[3]) if len(sys.argv) > 3 else None
        picture(Path(sys.argv[1]), Path(sys.argv[2]), seconds)
