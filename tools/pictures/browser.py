"""The browser that takes README's pictures."""

import shutil
import sys

_BROWSERS = ("chromium", "chromium-headless-shell", "google-chrome")


def find_browser() -> str:
    """Return the path of a browser; ends the process with a sentence where there is none."""
    found = next(filter(None, map(shutil.which, _BROWSERS)), None)
    return found or sys.exit(f"none of {', '.join(_BROWSERS)} is installed: apt install chromium")
