"""What the tests in a browser share: one browser for all files of this folder, and a page that hears of no gateway, of
a test's own or of a file. To open a page takes two tenths of a second of processor, to ask one something a hundredth."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from tests.browser import BROWSER, NO_BROWSER, started_browser
from tests.web.tabs.in_chromium.test_tabs_in_chromium import open_tab
from tests.web.tabs.served_tabs import ServedPage, serve

HERE = Path(__file__).parent
begun = ExitStack()
browsers: list[Any] = []


@pytest.fixture(scope="module")
def started_chromium() -> Any:
    """A browser without a window, once for this folder, or another one where it has died; skipped where there is none."""
    if BROWSER is None:
        pytest.skip(NO_BROWSER)
    if not (browsers and browsers[0].is_connected()):
        end_browser()
        browsers.append(begun.enter_context(started_browser()))
    return browsers[0]


def end_browser() -> None:
    browsers.clear()
    begun.close()


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(nextitem: Any) -> None:
    """Behind the last test of this folder: as long as there is a browser no other loop of asyncio can run in its thread."""
    path = getattr(nextitem, "path", None)
    if path is None or not path.is_relative_to(HERE):
        end_browser()


@pytest.fixture
def chromium(started_chromium: Any) -> Iterator[Any]:
    """The browser, of which no window, cookie or stored word of this test is left to the next one."""
    before = started_chromium.contexts
    yield started_chromium
    for context in started_chromium.contexts:
        if context not in before:
            context.close()


def open_quiet(browser: Any, address: str) -> Any:
    context = browser.new_context()
    context.route("**/events?*", lambda route: route.abort())
    return open_tab(context, address, "wiring")


@pytest.fixture(scope="module")
def shared_window(started_chromium: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Any, ServedPage]]:
    with serve(tmp_path_factory.mktemp("quiet")) as page:
        window = open_quiet(started_chromium, page.address)
        window.wait_for_load_state("networkidle")  # what it asks for behind its load no test of it need wait for
        yield window, page
        window.context.close()


@pytest.fixture
def quiet(shared_window: tuple[Any, ServedPage]) -> Iterator[Any]:
    """One window for all tests of a file that make a part of the page for themselves, and change nothing of what it has."""
    window, page = shared_window
    window.set_viewport_size({"width": 1280, "height": 720})
    yield window
    page.hang_up()


@pytest.fixture
def window(page: Any, chromium: Any) -> Iterator[Any]:
    """A page to which nothing comes but what a test tells it."""
    window = open_quiet(chromium, page.address)
    yield window
    window.context.close()
