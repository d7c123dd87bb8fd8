"""The page in a real browser on a whole running gateway: what it draws moves, and Stop stops."""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.browser import BROWSER, NO_BROWSER, started_browser
from tests.end_to_end.conftest import OWNER_IP, RunningGateway, start, stop

pytestmark = pytest.mark.skipif(BROWSER is None, reason=NO_BROWSER)
OFF, HOLDING, BUSY = 0, 3, 503
SERIOUS = ("serious", "critical")


@pytest.fixture(scope="module")
def gateway(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningGateway]:
    running = start(tmp_path_factory.mktemp("page") / "state", "--web", "127.0.0.1:0")
    yield running
    stop(running)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with started_browser() as browser:
        yield browser


@pytest.fixture(scope="module")
def page(gateway: RunningGateway, browser: Any) -> Iterator[Any]:
    page = browser.new_page(viewport={"width": 1280, "height": 900}, reduced_motion="reduce")
    page.complaints = []
    page.on("console", lambda message: page.complaints.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.goto(url_of(gateway))
    shows(page, "#state", "off")
    yield page
    page.close()


def url_of(gateway: RunningGateway) -> str:
    host, port = gateway.ready["web"]
    return f"http://{host}:{port}/"


def shows(page: Any, selector: str, text: str) -> None:
    until(page, lambda: page.text_content(selector) == text)


def until(page: Any, condition: Callable[[], bool], within_s: float = 20.0) -> None:
    """Wait in the test, not in the page: its own policy forbids it to evaluate texts. A busy machine lets a browser wait."""
    deadline_s = time.monotonic() + within_s
    while not condition():
        assert time.monotonic() < deadline_s, f"not within {within_s} s; the page says {page.text_content('#said')!r}"
        page.wait_for_timeout(20)


def in_state(number: int) -> Callable[[dict[str, int]], bool]:
    return lambda status: status["state"] == number


def enable(page: Any, force: str) -> None:
    """As a person would: where its process stood still meanwhile, as on a busy machine, the page wants to be asked again."""
    page.fill("#setpoint", force)
    for _ in range(20):
        with page.expect_response(lambda response: "/api/v1/command/" in response.url) as answered:
            page.click(".steering button[type=submit]")
        if answered.value.status != BUSY:
            return


def test_a_force_is_commanded_seen_and_stopped_by_one_key_out_of_an_input(gateway: RunningGateway, page: Any) -> None:
    canvas = page.locator(".trend canvas")
    canvas.wait_for()
    before = canvas.evaluate("canvas => canvas.toDataURL()")
    enable(page, "12")
    gateway.wait_until(in_state(HOLDING))
    shows(page, "#state", "holding")
    shows(page, "#owner", "you")
    until(page, lambda: canvas.evaluate("canvas => canvas.toDataURL()") != before)
    until(page, lambda: abs(float(page.text_content(".figures dd")) - 12.0) < 1.5)
    page.focus("#setpoint")
    page.keyboard.press("Escape")
    gateway.wait_until(in_state(OFF))
    assert [text for text in page.complaints if f"status of {BUSY}" not in text] == []


def test_stop_ends_what_another_master_holds(gateway: RunningGateway, page: Any) -> None:
    gateway.rest()
    gateway.write(0, 1, 1000)
    gateway.wait_until(in_state(HOLDING))
    shows(page, "#owner", "127.0.0.1")
    page.click("#stop")
    gateway.wait_until(in_state(OFF))
    until(page, lambda: "safe voltage is out" in page.text_content("#said"))
    assert gateway.words(OWNER_IP, 2) == [0, 0]


def test_a_reload_loses_neither_the_force_nor_the_minute(gateway: RunningGateway, page: Any) -> None:
    gateway.rest()
    enable(page, "9")
    gateway.wait_until(in_state(HOLDING))
    page.reload()
    shows(page, "#owner", "you")
    assert (
        page.evaluate("import('/static/live/samples.js').then(({samples}) => samples.time.at(-1) - samples.time[0])")
        > 1.0
    )
    assert gateway.status()["state"] == HOLDING
    page.keyboard.press("Escape")
    gateway.wait_until(in_state(OFF))


def drawn_of_the_model(page: Any) -> int:
    """Count the pixels of the loop's chart that have the colour of a branch."""
    count: int = (
        page.locator("canvas")
        .nth(1)
        .evaluate(
            """canvas => {
            const hex = getComputedStyle(document.documentElement).getPropertyValue("--falling").trim();
            const [red, green, blue] = [1, 3, 5].map((place) => parseInt(hex.slice(place, place + 2), 16));
            const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
            let count = 0;
            for (let k = 0; k < data.length; k += 4) {
                count += data[k] === red && data[k + 1] === green && data[k + 2] === blue && data[k + 3] === 255;
            }
            return count;
        }"""
        )
    )
    return count


def test_a_model_that_has_not_come_is_not_drawn_as_one_of_no_force(gateway: RunningGateway, browser: Any) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.route("**/api/v1/model", lambda route: route.abort())
    page.goto(url_of(gateway))
    shows(page, "#state", "off")
    page.wait_for_selector("canvas >> nth=1")
    page.wait_for_timeout(500)
    assert drawn_of_the_model(page) == 0
    page.unroute("**/api/v1/model")
    until(page, lambda: drawn_of_the_model(page) > 0)
    page.close()


@pytest.mark.long
def test_a_refusal_is_told_in_the_gateway_s_words(gateway: RunningGateway, page: Any) -> None:
    gateway.rest()
    enable(page, "70")
    until(page, lambda: "force_setpoint = 70.00 N, allowed 0 .. 60 N" in page.text_content("#said"))
    assert gateway.status()["state"] == OFF
    page.complaints.clear()  # the browser itself says that 409 came


def serious_violations(page: Any) -> list[str]:
    from axe_playwright_python.sync_playwright import Axe

    found = Axe().run(page).response["violations"]
    return [
        f"{one['id']}: {[node['html'][:120] for node in one['nodes']][:3]}" for one in found if one["impact"] in SERIOUS
    ]


def test_who_cannot_see_or_point_can_use_the_live_view(page: Any) -> None:
    assert serious_violations(page) == []


def test_a_telephone_shows_each_register_s_value_whole(gateway: RunningGateway, browser: Any) -> None:
    """Beside its name, without a finger that pushes the table aside."""
    gateway.rest()
    gateway.write(0, 1, 1000)
    gateway.wait_until(in_state(HOLDING))
    with browser.new_context(viewport={"width": 360, "height": 800}) as context:
        narrow = context.new_page()
        narrow.goto(url_of(gateway))
        value = narrow.locator(".registers tbody tr", has_text="status_word").locator("td:nth-child(5)")
        until(narrow, lambda: "in_band" in (value.text_content() or ""))
        edges = "cell => [cell.getBoundingClientRect().right, cell.closest('.wide').getBoundingClientRect().right]"
        ends, seen = value.evaluate(edges)
        assert ends <= seen


@pytest.mark.long
@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize(
    "tab", ["live", "calibrate", "recordings", "calibrations", "diagnosis", "wiring", "configuration"]
)
def test_every_tab_in_both_themes(gateway: RunningGateway, browser: Any, tab: str, theme: str) -> None:
    with browser.new_context(viewport={"width": 400, "height": 860}, color_scheme=theme) as context:
        narrow = context.new_page()
        narrow.goto(f"{url_of(gateway)}#{tab}")
        until(narrow, lambda: narrow.locator(f"#tab-{tab} > *").count() > 0)
        assert serious_violations(narrow) == []
        assert narrow.evaluate("document.documentElement.scrollWidth") <= 400


@pytest.mark.long
def test_twenty_viewers_leave_no_trace_in_the_loop() -> None:
    """Nor does a broker that dies beside them, where there is one. On a machine that is busy with something else ticks are
    missed without them, too: those do not count."""
    bench = Path(__file__).parents[2] / "tools" / "bench" / "missed_ticks.py"
    told = subprocess.run([sys.executable, bench], capture_output=True, text=True, check=True).stdout.splitlines()
    alone, *watched = (float(line.partition("missed_percent ")[2].split()[0]) for line in told if "missed" in line)
    assert watched and max(watched) < max(0.1, alone), told
