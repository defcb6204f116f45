"""Pictures of the pages of a rehearsed day: `python -m tests.studies.day.pictures build/day docs/figures`.

Needs Chromium and `pip install playwright pillow`.
"""

import io
import sys
from pathlib import Path

from slipbench.protocol.errors import InputError
from slipbench.studies.day.rehearsal import Day
from tests.bench.view.conftest import CHROMIUM

SIZE = {"width": 1000, "height": 1150}
COLOURS = 64  # of the palette: text and lines stay clear, a picture takes some 50 kB


def main(folder: Path, figures: Path) -> None:
    """Save the top of each page as figures/NAME.png. Raises InputError where a page is missing."""
    from PIL import Image
    from playwright.sync_api import sync_playwright

    pages = Day(folder.absolute(), print).pages
    for page in pages.values():
        if not page.exists():
            raise InputError("no page of the day", where=str(page), remedy="make day")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        tab = browser.new_page(viewport=SIZE)
        for name, page in pages.items():
            tab.goto(page.as_uri())
            picture = Image.open(io.BytesIO(tab.screenshot()))
            path = figures / f"{name}.png"
            picture.convert("RGB").quantize(COLOURS).save(path, optimize=True)
            print(path)
        browser.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
