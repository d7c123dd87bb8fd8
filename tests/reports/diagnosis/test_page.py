"""The report of a diagnosis: one file that works anywhere, tells the same story as the answer, and survives odd data."""

import re
from dataclasses import replace
from html import escape
from html.parser import HTMLParser
from math import nan

import numpy as np
import pytest

from gateway.diagnosis.result import Diagnosis, Extended, Leftover, NotIdentifiable, Verdict
from gateway.reports.diagnosis import headline
from gateway.reports.diagnosis import wording as words
from gateway.reports.diagnosis.page import ReportContext, diagnosis_page
from gateway.twin.plant import with_value
from tests.reports.fake_diagnosis import FRICTION, WARMTH, diagnosis, trace

REACHED = Extended(0.121, True)
ABOUT = {"load-dependent-friction": "friction in proportion to the thrust"}


def page(answer: Diagnosis) -> str:
    circumstances = ReportContext(
        rig="demo", plant="paper-slide", made_utc="2026-11-21 15:50 UTC", runtime_s=2.3, about=ABOUT
    )
    return diagnosis_page(answer, circumstances).replace("\N{NO-BREAK SPACE}", " ")


class Balance(HTMLParser):
    """Every tag that is opened is closed, in order."""

    EMPTY = frozenset(("meta", "br"))

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: object) -> None:
        if tag not in self.EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_startendtag(self, tag: str, attrs: object) -> None:
        pass


def balanced(html: str) -> bool:
    balance = Balance()
    balance.feed(html)
    return not balance.open


def test_the_report_loads_nothing_is_small_and_serves_dark_and_paper() -> None:
    html = page(diagnosis())
    assert not re.search(r"https?:|<script|<link|@import|url\(|src=", html)
    assert "prefers-color-scheme: dark" in html and "@media print" in html
    assert 60_000 < len(html) < 160_000
    assert balanced(html)


def test_it_shows_all_that_the_contract_asks_for() -> None:
    html = page(diagnosis())
    titles = re.findall(r"<h[23]>(.*?)</h", html)
    for title in (
        "Before: the base model, refitted", "After: with the causes", "Residual over time", "By direction, before",
        "By direction, after", "Against command (V)", "Against temperature (°C)", "Loop, before", "Loop, after",
        "Spectrum of the residual", "What to record next", "Alternatives, ranked", "What no effect explains",
    ):  # fmt: skip
        assert title in titles
    for text in ("1.186 → 0.257 N", "[0.871, 0.986]", "0.0497 N/N [0.0482, 0.0511]", ABOUT["load-dependent-friction"]):
        assert text in html


@pytest.mark.sampled
@pytest.mark.parametrize("changed", [True, False])
@pytest.mark.parametrize("columns", range(4))
def test_no_place_of_a_grid_is_empty(columns: int, changed: bool) -> None:
    """Two figures to a row; where one is left it reaches across, as wide as it is drawn."""
    one = trace(rows=3000, **{f"column_{k}": np.linspace(0.0, 1.0, 3000) ** (k + 2) for k in range(columns)})
    html = page(diagnosis(traces=(one,), **({} if changed else {"causes": ()})))
    grids = re.findall(r"<section class='pair'>(.*?)</section>", html, re.DOTALL)
    assert len(grids) == 5, "with what is left over its temperature"
    for grid in grids:
        styles = re.findall(r"<figure class='(.*?)'>", grid)
        assert styles == [""] * (len(styles) // 2 * 2) + ["across"] * (len(styles) % 2)
        widths = re.findall(r'viewBox="0 0 (\d+) ', grid)
        assert [int(width) > 1000 for width in widths] == [style == "across" for style in styles]


def test_a_group_is_named_as_a_group() -> None:
    html = page(diagnosis(causes=(FRICTION, WARMTH)))
    assert "or warm-up, or linear-drift: not told apart here" in html
    assert (
        "<h1>Load-dependent-friction and thermal-zero-drift (or warm-up, or linear-drift) explain part of the difference: "
        "1.186 N before, 0.257 N after, the noise is 0.120 N</h1>"
    ) in html


@pytest.mark.parametrize("verdict", [Verdict.NOTHING_FOUND, Verdict.UNKNOWN])
def test_without_causes_there_is_no_after(verdict: Verdict) -> None:
    html = page(diagnosis(causes=(), verdict=verdict))
    assert "After: with the causes" not in html and "With the causes" not in html
    answer = diagnosis(causes=(), verdict=verdict)
    assert f"<h1>{headline.answer_sentence(answer)}</h1>" in html


def test_text_from_recordings_cannot_become_markup() -> None:
    evil = "<img src=x onerror=alert(1)>&"
    one = trace(name=evil, rows=2000, **{evil: np.linspace(0, 1, 2000)})
    one = replace(one, measurement=replace(one.measurement, notes=(evil,)))
    html = page(diagnosis(traces=(one, trace(name="b", rows=500)), notes=(evil,), experiments=(evil,)))
    assert "<img" not in html and "&lt;img" in html
    assert balanced(html)


def test_a_thousand_columns_and_many_rows_stay_a_small_report() -> None:
    rng = np.random.default_rng(1)
    columns = {f"column_{k}": rng.normal(size=3000) for k in range(1000)}
    html = page(diagnosis(traces=(trace(rows=3000, **columns),)))
    assert len(html) < 250_000 and "more columns carry less than these" in html
    assert len(page(diagnosis(traces=(trace(rows=300_000),)))) < 200_000


def odd_traces() -> dict[str, object]:
    one = trace(rows=60)
    measurement, odd = one.measurement, np.arange(60) % 2
    return {
        "constant force and command": replace(
            one, measurement=replace(measurement, force_n=np.full(60, 5.0), command_v=np.full(60, 1.0)),
            before_n=np.full(60, 5.0), after_n=np.full(60, 5.0),
        ),
        "pressure only": replace(
            one, measurement=replace(measurement, command_v=None, pressure_pa=np.linspace(0, 3e5, 60))
        ),
        "NaN in a column": replace(
            one, measurement=replace(measurement, covariates={"t": np.full(60, nan), "u": np.where(odd, nan, 1.0)})
        ),
        "three rows judged": replace(one, measurement=replace(measurement, usable=np.arange(60) < 3)),
        "one row judged": replace(one, measurement=replace(measurement, usable=np.arange(60) == 3)),
        "no row judged": replace(one, measurement=replace(measurement, usable=np.zeros(60, dtype=bool))),
    }  # fmt: skip


@pytest.mark.parametrize("name", list(odd_traces()))
def test_odd_data_give_a_page_all_the_same(name: str) -> None:
    html = page(diagnosis(traces=(odd_traces()[name],)))
    assert balanced(html)
    assert not re.search(r"\bnan\b", re.sub(r"<style>.*?</style>", "", html, flags=re.S))


def test_many_effects_that_cannot_be_seen_are_folded_away() -> None:
    unseen = tuple(NotIdentifiable(f"effect-{k}", "not excited", "move") for k in range(30))
    html = page(diagnosis(not_identifiable=unseen))
    assert "<details><summary>30 effects" in html
    assert html.count("<li>move") == 1


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"), (0.0312, "0.0312"), (-12.44, "−12.4"), (1250.4, "1 250"), (4.1e-6, "4.10e-06"), (-4.1e-6, "−4.10e-06"),
        (nan, "–"), (999.6, "1 000"), (85000000.0, "8.50e+07"),
    ],
)  # fmt: skip
def test_numbers_have_three_digits_that_count(value: float, text: str) -> None:
    assert words.number(value) == text


def test_a_narrow_interval_keeps_its_ends_apart() -> None:
    assert words.interval((0.0719981, 0.0720013)) == "[0.0719981, 0.0720013]"
    assert words.interval((1.0, 1.0)) == "[1.00, 1.00]"


@pytest.mark.parametrize(
    ("share", "text"), [(0.995, "> 99 %"), (1.0, "100 %"), (0.004, "< 1 %"), (0.0, "0 %"), (nan, "–")]
)
def test_a_share_is_never_called_all_or_nothing_when_it_is_not(share: float, text: str) -> None:
    assert words.percent(share) == text


CHANGED = (
    ({}, "Load-dependent-friction explains part of the difference", "What is left depends on temperature_c."),
    (
        {"leftover": ()}, "Load-dependent-friction explains part of the difference",
        "What is left is more than the noise, and depends on nothing that was recorded.",
    ),
    (
        {"leftover": (), "extended": REACHED}, "Load-dependent-friction explains the difference, as far as the noise is known",
        "To confirm it, record rests, repeat a cycle or give the noise floor (--noise-floor-n).",
    ),
    (
        {"leftover": (), "extended": REACHED, "causes": (WARMTH,)},
        "Thermal-zero-drift (or warm-up, or linear-drift) explains the difference, but not told apart from what looks alike",
        "They look alike in this recording; what to record next tells them apart.",
    ),
    (
        {"leftover": (), "extended": REACHED, "verdict": Verdict.CONFIRMED},
        "Load-dependent-friction explains the whole difference", "Nothing is left above the noise floor.",
    ),
    (
        {"causes": (FRICTION, FRICTION), "leftover": (), "extended": REACHED, "verdict": Verdict.CONFIRMED},
        "Load-dependent-friction and load-dependent-friction explain the whole difference",
        "Nothing is left above the noise floor.",
    ),
)  # fmt: skip


@pytest.mark.sampled
@pytest.mark.parametrize(("changes", "answer", "lack"), CHANGED)
def test_the_answer_says_how_much_is_explained_and_what_is_lacking(
    changes: dict[str, object], answer: str, lack: str
) -> None:
    found = diagnosis(**changes)
    after = found.extended.held_out_rms_n
    assert headline.answer_sentence(found) == f"{answer}: 1.186 N before, {after:.3f} N after, the noise is 0.120 N"
    assert headline.lack_sentence(found) == lack
    assert f"<p class='verdict'>{escape(lack)}</p>" in page(found)


@pytest.mark.parametrize(
    ("verdict", "answer"),
    [
        (Verdict.NOTHING_FOUND, "No effect is missing that this recording could show"),
        (Verdict.UNKNOWN, "No effect of the catalogue explains the difference"),
    ],
)
def test_without_a_cause_the_answer_says_how_far_the_simulation_is_off(verdict: Verdict, answer: str) -> None:
    found = diagnosis(causes=(), verdict=verdict)
    assert headline.answer_sentence(found) == f"{answer}: the simulation is off by 1.186 N, the noise is 0.120 N"


def test_a_confidence_is_the_number_of_the_json_and_never_one_when_it_is_not() -> None:
    assert [words.confidence(value) for value in (0.985, 0.71, 0.9951, 1.0, nan)] == [
        "0.98",
        "0.71",
        "> 0.99",
        "1.00",
        "–",
    ]


def test_where_the_residual_is_largest_is_said_beside_it_and_below() -> None:
    one = trace(rows=3000)
    spike = one.measurement.force_n.copy()
    spike[1234] += 40.0
    html = page(diagnosis(traces=(replace(one, measurement=replace(one.measurement, force_n=spike)),)))
    assert re.search(r">before: \+(38|39)\.\d\d N</text>", html)
    assert re.search(r"Largest before: \+(38|39)\.\d\d N at 6\.17 s, (while|with|within)[^;<]*; after: ", html)
    unchanged = page(diagnosis(traces=(one,), causes=(), verdict=Verdict.NOTHING_FOUND, leftover=()))
    assert re.search(r"Largest before: [^;<]*\.<", unchanged), "without a cause there is no after"


def test_a_size_that_the_plant_had_already_is_told_beside_the_new_one() -> None:
    result = FRICTION.parameters["load_dependent_n_per_n"]
    had = replace(diagnosis(), base=with_value(diagnosis().base, "friction", "load_dependent_n_per_n", 0.08))
    assert words.previous_value(had, "load_dependent_n_per_n", result) == " (0.0800 before)"
    assert "(0.0800 before)" in page(had)
    lacked = replace(had, base=with_value(had.base, "friction", "load_dependent_n_per_n", 0.0))
    assert words.previous_value(lacked, "load_dependent_n_per_n", result) == ""


LEFT = (
    Leftover(
        "time", "a line at 12.5 Hz, 0.12 N", 0.2, frequency_hz=12.5, amplitude_n=0.12, experiment="switch the pump off"
    ),
    Leftover("time", "a jump at 3 s, 0.3 N to either side", 0.1),
    Leftover("column_0 x column_1", "in proportion to their product, 0.1 N", 0.1, ("column_0", "column_1")),
)


@pytest.mark.parametrize(
    ("left", "drawn"), list(zip(LEFT, ("Spectrum", "Residual over time", "column_0 x column_1"), strict=True))
)
def test_each_leftover_is_told_and_drawn(left: Leftover, drawn: str) -> None:
    one = trace(rows=3000, **{f"column_{k}": np.linspace(0.0, 1.0, 3000) ** (k + 2) for k in range(2)})
    section = page(diagnosis(traces=(one,), leftover=(left,))).partition("What no effect explains")[2]
    section = section.partition("<h2>")[0]
    assert left.shape in section and left.experiment in section
    assert "<svg" in section and drawn in section


def test_nothing_is_told_of_a_force_that_is_the_same_in_every_row() -> None:
    """What the base model left of a frozen cell, 0.0001 N, was told as an unknown effect that depends on time."""
    alive = trace()
    frozen = replace(
        alive, measurement=replace(alive.measurement, force_n=np.full(alive.measurement.force_n.size, 5.0))
    )
    found = diagnosis(verdict=Verdict.UNKNOWN, causes=(), traces=(frozen,))
    told = "Nothing can be told: press-07.csv: the force stands at 5 N while command_v moves by"
    assert headline.answer_sentence(found).startswith(told) and headline.lack_sentence(found) == ""
    assert not headline.answer_sentence(diagnosis(traces=(frozen, alive))).startswith("Nothing")
