"""The browser of tests that look at pages: Debian's chromium without the part that draws windows, where it is installed, for it
opens a page in a quarter of the processor's time; else chromium itself."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

BROWSER: Final = next(filter(None, map(shutil.which, ("chromium-headless-shell", "chromium", "google-chrome"))), None)
FLAGS: Final = ("--no-sandbox", "--disable-gpu")

NO_BROWSER: Final = "no browser here (apt-get install chromium-headless-shell): PAGES ARE NOT TRIED IN A BROWSER"
"""Why such a test is skipped where BROWSER is None."""


@contextmanager
def started_browser() -> Iterator[Any]:
    """A browser of Playwright's, without a window."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=FLAGS)
        try:
            yield browser
        finally:
            browser.close()
