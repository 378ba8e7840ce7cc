"""Makes a picture of a page of `space-robot view`, as Chromium shows it.

    python docs/view_picture.py PAGE PICTURE [SECONDS]

Needs playwright (`pip install playwright`) and Chromium of the system.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

ARGUMENTS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
PATIENCE_MS = 240_000


def picture(page: Path, file: Path, seconds: float) -> None:
    """Write the picture of a page at so many seconds of its flight."""
    chromium = next(filter(None, map(shutil.which, ("chromium", "google-chrome"))))
    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=chromium, args=ARGUMENTS)
        shown = browser.new_page(viewport={"width": 1300, "height": 720})
        shown.set_default_timeout(PATIENCE_MS)
        shown.goto(page.absolute().as_uri())
        shown.wait_for_function("spaceRobot.time() > 0")
        shown.evaluate(f"spaceRobot.seek({seconds})")
        notice = shown.frame_locator("#scene").locator(".mantine-CloseButton-root")
        for _ in range(notice.count()):  # viser's, that there is no graphics card
            notice.first.evaluate("button => button.click()")
        shown.wait_for_timeout(5000)  # for the light
        shown.screenshot(path=file)
        browser.close()


if __name__ == "__main__":
    picture(Path(sys.argv[1]), Path(sys.argv[2]), float((*sys.argv[3:], "0")[0]))
