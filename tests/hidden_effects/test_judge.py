"""The judge before it judges: what is right, what is honest, and what is a lie."""

import json
from dataclasses import replace

import pytest
from generator.catalogue import NAMES, page_group, physical_group
from generator.recording import Wish, make
from judge.cases import Plan, cases, gate_sample, long_plan, some_together
from judge.engine import Answer, Blamed, of_json
from judge.running import judged, line, run_one, told
from judge.score import Score, score
from judge.table import by_effect, table, wilson


def answer(*causes: Blamed, verdict: str = "partial", leftover: tuple[str, ...] = ()) -> Answer:
    return Answer(verdict, causes, leftover, 1.0)


def sure_of(name: str, *others: str, confidence: float = 0.99) -> Blamed:
    return Blamed(name, (name, *others), confidence)


def word(kind: str, truth: tuple[str, ...], given: Answer) -> str:
    case = next(cases(Plan(("null",))))
    return judged(told(case, NULL, given) | {"kind": kind, **marks(score(kind, truth, given))})


def marks(found: Score) -> dict[str, bool]:
    return {name: getattr(found, name) for name in ("right", "honest", "named", "wrong", "alarm", "described")}


NULL = make(Wish(duration_s=2.0))


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (answer(sure_of("creep"), verdict="confirmed"), "right"),
        (answer(sure_of("warm-up", "creep", "linear-drift")), "right"),
        (answer(sure_of("tilt-gravity", "creep")), "grouped"),
        (answer(sure_of("tilt-gravity")), "WRONG"),
        (answer(sure_of("warm-up")), "WRONG"),
        (answer(sure_of("tilt-gravity", confidence=0.6)), "vague"),
        (answer(sure_of("tilt-gravity", confidence=0.6), verdict="confirmed"), "WRONG"),
        (answer(sure_of("creep"), sure_of("tilt-gravity")), "WRONG"),
        (answer(verdict="unknown"), "missed"),
    ],
)
def test_one_hidden_effect(given: Answer, expected: str) -> None:
    assert word("alone", ("creep",), given) == expected


@pytest.mark.parametrize(
    ("given", "right"),
    [
        (answer(sure_of("creep"), sure_of("tilt-gravity")), True),
        (answer(sure_of("tilt-gravity"), sure_of("warm-up", "creep")), True),
        (answer(sure_of("creep")), False),
        (answer(sure_of("creep"), sure_of("tilt-gravity"), sure_of("leak", confidence=0.5)), False),
        (answer(sure_of("creep", "tilt-gravity")), False),
    ],
)
def test_of_two_effects_the_set_must_be_exact(given: Answer, right: bool) -> None:
    assert score("two", ("creep", "tilt-gravity"), given).right is right


def test_nothing_hidden_and_something_blamed_is_an_alarm() -> None:
    assert word("null", (), answer(sure_of("leak", confidence=0.4))) == "ALARM"
    assert word("null", (), answer(verdict="unknown", leftover=("time",))) == "uneasy"
    assert word("null", (), answer(verdict="nothing-found")) == "quiet"


def test_a_cause_outside_is_described_or_lied_about() -> None:
    assert word("outside", ("gain-jump",), answer(sure_of("leak"), verdict="confirmed")) == "LIED"
    assert word("outside", ("gain-jump",), answer(verdict="unknown")) == "described"
    assert word("outside", ("gain-jump",), answer(verdict="nothing-found")) == "silent"


def test_the_json_of_the_contract_is_the_same_answer() -> None:
    document = {
        "verdict": "partial",
        "causes": [{"name": "creep", "group": ["creep", "warm-up"], "confidence": 0.7}],
        "leftover": [{"depends_on": "time_s", "shape": "slow", "share": 0.2}],
    }
    assert of_json(document, 1.0) == answer(sure_of("creep", "warm-up", confidence=0.7), leftover=("time_s",))


def test_wilson_s_interval_is_the_textbook_s() -> None:
    """Newcombe 1998, table I: 81 of 263 and 0 of 20."""
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=2e-4)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=2e-4)


def test_together_means_not_one_picture() -> None:
    for seed in range(30):
        effects = some_together(seed, 3)
        assert len(set(effects)) == 3 and set(effects) <= set(NAMES)
        assert all(one not in physical_group(other) for one in effects for other in effects if one != other)


def test_cases_come_from_the_seed_alone() -> None:
    assert gate_sample(7) == gate_sample(7) != gate_sample(8)
    assert len(gate_sample(7)) == 9
    asked = long_plan(20, 300, 1)
    assert sum(case.kind == "null" for case in asked) == 300
    assert all(sum(case.wish.effects == (name,) for case in asked) == 20 for name in NAMES)


def test_each_colour_of_noise_is_asked_for_of_the_same_recording() -> None:
    white, slow = cases(Plan(("creep",), sizes=(1.0,), colours=("white", "lorentzian")))
    assert (white.wish.colour, slow.wish.colour) == ("white", "lorentzian")
    assert replace(white.wish, colour=None) == replace(slow.wish, colour=None)


def test_silence_and_a_companion_are_counted() -> None:
    case = next(cases(Plan(("creep",), sizes=(1.0,))))
    answers = (
        answer(verdict="nothing-found"),
        answer(verdict="unknown"),
        answer(sure_of("creep"), sure_of("leak", confidence=0.5), verdict="confirmed"),
    )
    rows = [
        told(case, NULL, each) | {"kind": "alone", "truth": ["creep"], "size": 1.0, "colour": "white"}
        for each in answers
    ]
    printed = table([json.loads(json.dumps(row)) for row in rows])
    assert "no word that something is left |  | 1/3" in printed
    assert "beside the true one |  | 1/3" in printed
    assert "with a wrong name |  | 1/3" in printed
    assert "under white noise |  | 1/3" in printed and "under coloured noise |  | - |" in printed


def test_the_page_s_groups_are_inside_the_physical_ones() -> None:
    assert page_group("creep") == {"linear-drift", "pad-wear", "warm-up", "creep", "thermal-zero-drift"}
    assert page_group("outliers") == physical_group("outliers") == {"outliers"}


def test_the_harness_works_without_an_engine() -> None:
    """Silence: every effect is missed, no lie, no alarm; the table has every bar."""
    rows = [run_one(case, "silent") for case in cases(Plan(("linear-drift", "null", "offset-step"), sizes=(1.0,)))]
    assert [judged(row) for row in rows] == ["missed", "quiet", "silent"]
    assert "linear-drift" in line(rows[0]) and "| false alarms | <= 0.5 % | 0/1" in table(rows)
    assert "| linear-drift | 0/1" in by_effect(rows)


def test_a_crash_of_the_engine_is_a_row_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_recording: object) -> Answer:
        raise ZeroDivisionError("on purpose")

    monkeypatch.setitem(run_one.__globals__["ENGINES"], "silent", broken)
    row = run_one(next(cases(Plan(("null",)))), "silent")
    assert "FAILED: ZeroDivisionError: on purpose" in line(row)
    assert "1 without an answer" in table([row]) and "| false alarms | <= 0.5 % | - |" in table([row])
