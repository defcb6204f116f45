"""Picture of the page for the how-to: `python -m tests.bench.view.picture RUN docs/figures/live_view.png`."""

import sys
from pathlib import Path

from tests.bench.view.conftest import CHROMIUM, serving

SIZE = {"width": 1280, "height": 960}
MOMENT = 12  # s since the first frame


def main(run: Path, picture: Path) -> None:
    """Save a picture of the replay of a run folder, paused at `MOMENT`."""
    from playwright.sync_api import sync_playwright

    arguments = ("view", str(run.absolute()), "--view-address", "127.0.0.1:0")
    with serving(Path.cwd() / "build", *arguments) as view, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport=SIZE)
        page.goto(view.url)
        page.wait_for_function("() => window.updates > 3")
        page.evaluate(f"wish({{play: false, seek: {MOMENT}}})")
        page.wait_for_function(f"() => state.position === {MOMENT} && state.frames > 0")
        page.evaluate("() => new Promise((drawn) => setTimeout(drawn, 500))")
        page.screenshot(path=str(picture))
        browser.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
