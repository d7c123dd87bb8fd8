"""What every report promises: the answer first, its provenance last, nothing loaded, and no place where it breaks a page."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from gateway.bsfm.fit.blend_span import command_error_n
from gateway.reports.fit.document import fit_document, residual_of
from gateway.reports.fit.headline import answer_sentence
from gateway.reports.fit.page import fit_page
from tests.reports.sample_pages import PAGES, fit_evaluation, fit_sample

NO_BREAK = "\N{NO-BREAK SPACE}"
EMPTY = frozenset(("meta", "br", "img"))
SCROLLERS = frozenset(("wide", "picture"))


class Outline(HTMLParser):
    """Tags in order, text by the tag around it, and what a browser would fetch."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[tuple[str, str]] = []
        self.order: list[str] = []
        self.text: dict[str, list[str]] = {}
        self.fetched: list[str] = []
        self.loose_tables = 0
        self.unnamed_charts = 0
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.fetched += [
            value for name, value in given.items() if name in ("src", "href", "srcset") and value[:5] != "data:"
        ]
        self.fetched += [tag] if tag in ("script", "link", "iframe", "object") else []
        self.loose_tables += tag == "table" and not any(style in SCROLLERS for _, style in self.open)
        self.unnamed_charts += tag == "svg" and self.open[-1][1] == "plot" and not given.get("aria-label")
        self.order.append(tag)
        if tag not in EMPTY:
            self.open.append((tag, given.get("class", "")))

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.order.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop()[0] == tag

    def handle_data(self, data: str) -> None:
        if self.open:
            self.text.setdefault(self.open[-1][0], []).append(data)


@pytest.fixture(params=sorted(PAGES))
def html(request: pytest.FixtureRequest) -> str:
    page: str = PAGES[request.param]()
    return page


def test_the_answer_comes_first_and_the_provenance_last(html: str) -> None:
    outline = Outline(html)
    assert not outline.open
    body = outline.order[outline.order.index("main") :]
    assert body[1] == "header" and body.count("h1") == 1 and body.count("footer") == 1
    assert body.index("h1") < body.index("dl") < body.index("figure") < body.index("footer")
    assert re.search(r"\d\.\d+\sN", outline.text["h1"][0]), "an answer without its size is none"
    levels = [int(tag[1]) for tag in body if tag in ("h1", "h2", "h3")]
    assert all(after <= before + 1 for before, after in pairwise(levels)), "a heading is skipped"
    footer = html[html.index("<footer>") :]
    assert "Provenance" in footer and "force-gateway 0" in footer and "<h2>" not in footer.partition("</h2>")[2]


def test_nothing_is_fetched_and_both_themes_are_there(html: str) -> None:
    assert Outline(html).fetched == []
    style = html[html.index("<style>") : html.index("</style>")]
    assert not re.search(r"url\(|@import|https?:", style)
    assert "prefers-color-scheme: dark" in style and 'data-theme="dark"' in style and "@media print" in style


def test_tables_scroll_within_themselves_and_charts_are_read_out(html: str) -> None:
    outline = Outline(html)
    assert outline.loose_tables <= 1, "the provenance's table wraps; all others scroll"
    assert outline.unnamed_charts == 0
    assert html.count('class="plot"') == html.count('preserveAspectRatio="none"') >= 2


def test_every_figure_says_what_stands_out_or_what_it_shows(html: str) -> None:
    figures = re.findall(r"<figure.*?</figure>", html, re.DOTALL)
    assert figures
    words = [figure for figure in figures if 'class="words' in figure]
    assert words, "no peak has its words"
    assert all("<figcaption>" in figure for figure in words)


def test_a_fit_shows_the_raw_ladder_measured_points_and_models_by_their_names() -> None:
    html, document = fit_sample()
    chosen, reversal = document["chosen"], document["reversal"]
    name = f"{chosen['model'].upper()}, order {chosen['order']}"
    titles = re.findall(r"<h3>(.*?)</h3>", html)
    assert {"Force", "Command", "Hysteresis loop", "Residuals", "Order sweep", "Error of the command"} <= set(titles)
    loop = html[html.index("<h3>Hysteresis loop</h3>") :].partition("</figure>")[0]
    for key in ("measured, rising", "measured, falling", f"{name}, rising", f"{name}, falling"):
        assert f">{key}</span>" in loop or f"</i>{key}</span>" in loop
    assert loop.count("dots rising rim") == loop.count("dots falling rim") == 1
    assert reversal[
        "identified"
    ] and f"off by {reversal['rms_n']:.2f} N RMS and {reversal['max_n']:.2f} N" in html.replace(NO_BREAK, " ")
    assert not re.search(r">[^<]*\bbsfm\d", html)


@pytest.mark.parametrize(("groups", "seen"), [(1, "stairs"), (2, "a group")])
def test_a_fit_names_what_it_was_judged_by(groups: int, seen: str) -> None:
    """Each quick calibration has one group, and its page said that another one had been held out."""
    document = fit_sample()[1]
    html = fit_page(fit_evaluation(), document | {"ladder": document["ladder"] | {"groups": groups}}, None)
    assert f"by branch, on {seen} not seen" in html
    assert f"Error on {seen} that the fit has not seen" in html


def test_a_comparison_draws_the_points_and_says_how_far_both_are_off() -> None:
    html = PAGES["comparison"]().replace(NO_BREAK, " ")
    assert re.search(
        r"At the \d+ points that A was made from, A is off by \d+\.\d{3} N RMS and B by \d+\.\d{3} N RMS\.", html
    )
    assert "measured for A" in html and "No measured points of B: it names no data." in html
    assert "<img" not in html and "&lt;img" in html


def test_the_document_of_a_fit_has_each_number_under_its_own_name() -> None:
    """Rising and falling are alike enough that neither the page nor a reader sees them exchanged."""
    found, (_, document) = fit_evaluation(), fit_sample()
    rising = found.checked.ladder.direction > 0
    ladder, reversal, chosen = document["ladder"], document["reversal"], document["chosen"]
    assert (ladder["rising"], ladder["falling"], ladder["voltage_v"]) == (rising.sum(), (~rising).sum(), [0.0, 6.0])
    left_n = residual_of(found)
    assert left_n[0] == found.checked.ladder.force_n[0] - found.chosen.result.branches.rising.handles[0]
    assert chosen["rising_rms_n"] == pytest.approx(np.sqrt(np.mean(left_n[rising] ** 2)))
    assert chosen["falling_rms_n"] == pytest.approx(np.sqrt(np.mean(left_n[~rising] ** 2)))
    for part, model in ((chosen, found.chosen.result.branches), (document["model"], found.model.branches)):
        told = [part[f"{branch}_{what}"] for branch in ("rising", "falling") for what in ("handles_n", "weights")]
        assert told == [list(values) for one in (model.rising, model.falling) for values in (one.handles, one.weights)]
    assert reversal["rms_n"] <= reversal["slip_heldout_n"] < reversal["blend_heldout_n"] == reversal["switched_rms_n"]
    assert answer_sentence(document).endswith(
        f"to {document['measured']['rms_n']:.3f} N RMS, {document['measured']['max_n']:.2f} N at most"
    )


@pytest.mark.parametrize("branch", ["rising_monotone", "falling_monotone"])
def test_a_fit_is_monotone_where_both_of_its_branches_are(branch: str) -> None:
    found = fit_evaluation()
    score = found.scores[0]
    verdicts = replace(score.result.verdicts, **{branch: False})
    broken = replace(score, result=replace(score.result, verdicts=verdicts))
    told = fit_document(replace(found, scores=[score, broken]), Path("ladder.csv"), {})["fits"]
    assert [fit["monotone"] for fit in told] == [True, False]


def test_the_errors_of_a_fit_are_in_newtons_and_the_largest_one_has_no_sign() -> None:
    found, (_, document) = fit_evaluation(), fit_sample()
    for score, told in zip(found.scores, document["fits"], strict=True):
        if told["heldout_rms_n"]:  # of a square's standard error the half over the root is the root's
            assert told["heldout_error_n"] == pytest.approx(score.error_n2 / (2.0 * score.heldout_rms_n))
    error_n = command_error_n(found.model, found.checked.minor_v, found.checked.minor_n)
    assert document["reversal"]["max_n"] == pytest.approx(np.abs(error_n).max())
    for shift_n in (-5.0, 5.0):
        shifted = replace(found, checked=replace(found.checked, minor_n=found.checked.minor_n + shift_n))
        assert fit_document(shifted, Path("ladder.csv"), {})["reversal"]["max_n"] > 4.0
