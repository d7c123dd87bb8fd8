"""What the tests in a browser share: a page that is alone with its test."""

from collections.abc import Iterator
from typing import Any

import pytest

from tests.web.tabs.in_chromium.test_tabs_in_chromium import open_tab


@pytest.fixture
def window(page: Any, chromium: Any) -> Iterator[Any]:
    """A page to which nothing comes but what a test tells it."""
    browser = chromium.new_context()
    browser.route("**/events?*", lambda route: route.abort())
    yield open_tab(browser, page.address, "wiring")
    browser.close()
