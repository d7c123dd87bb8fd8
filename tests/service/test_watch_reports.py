"""What the residual watch tells control: checked, shown in one bit and one register, said once, and never acted upon."""

import pytest

from gateway.codes.warning_bits import WarningBit
from gateway.registers.residual_cause import ResidualCause
from gateway.registers.words import State
from gateway.service.watch_reports import WatchReports
from tests.service.wired import Wired


@pytest.fixture
def wired() -> Wired:
    return Wired().pressing(12)


@pytest.fixture
def reports(wired: Wired) -> WatchReports:
    return WatchReports(
        wired.loop, lambda: wired.now_s, lambda cause, sentence: wired.log.append((wired.now_s, sentence))
    )


def told(cause: int, sentence: str = "friction has doubled", **counters: object) -> dict[str, object]:
    return {"do": "residual", "cause": int(cause), "sentence": sentence, "counters": counters}


def test_a_cause_raises_the_warning_and_names_itself_in_all_three_faces(wired, reports):
    reports.answer(told(ResidualCause.COULOMB_FRICTION))
    assert wired.warnings & WarningBit.MODEL_DIFFERS
    assert wired.word("residual_cause") == 12
    assert wired.floats(232 + 2 * 29, 1) == (12.0,)
    assert wired.said("A345") == ["A345 friction has doubled"]


def test_it_changes_nothing_else(wired, reports):
    before = (wired.state, wired.value("output_voltage"), wired.word("fault_code"))
    reports.answer(told(ResidualCause.UNKNOWN))
    assert (wired.state, wired.value("output_voltage"), wired.word("fault_code")) == before
    wired.run(0.5)
    assert wired.state is State.HOLDING


def test_repeated_words_are_logged_once_and_agreement_clears_it(wired, reports):
    for _ in range(5):
        reports.answer(told(ResidualCause.LINEAR_DRIFT))
    assert len(wired.said("A345")) == 1
    assert reports.figures()["warnings"] == 1
    reports.answer(told(ResidualCause.NONE, ""))
    assert not wired.warnings & WarningBit.MODEL_DIFFERS
    assert wired.word("residual_cause") == 0
    assert wired.said("the model agrees")


def test_why_nothing_was_judged_is_told_and_raises_and_logs_nothing(wired, reports):
    before = (wired.warnings, list(wired.log))
    reports.answer({"cause": 0, "why_skipped": "nothing was commanded" + "!" * 600})
    told_why = reports.answer({})["why_skipped"]
    assert told_why.startswith("nothing was commanded!") and len(told_why) == 500
    assert (wired.warnings, wired.log) == before
    reports.answer({"cause": 0})
    assert reports.answer({})["why_skipped"] == ""


def test_counters_and_age_can_be_read(wired, reports):
    assert reports.figures()["age_s"] is None
    reports.answer(told(0, "", looks=7, cpu_s=1.5, nonsense=3, rms_n=float("nan")))
    wired.run(2.0)
    figures = reports.answer({"do": "residual"})
    assert (figures["looks"], figures["cpu_s"], figures["name"]) == (7, 1.5, "none")
    assert figures["age_s"] == pytest.approx(2.0)
    assert not {"nonsense", "rms_n"} & set(figures)


@pytest.mark.sampled
@pytest.mark.parametrize(
    "request_",
    [
        {"cause": 98},
        {"cause": 98, "counters": {"looks": 7}},
        {"cause": "friction"},
        {"cause": True},
        {"cause": -1},
        {"cause": 12, "sentence": 5},
        {"cause": 12, "sentence": "", "why_skipped": 5},
        {"cause": None},
        {"cause": 12, "counters": [1, 2]},
        {"cause": 12, "caus": 12},
    ],
)
def test_nonsense_is_refused_and_leaves_no_trace(wired, reports, request_):
    with pytest.raises(ValueError, match=r"cause|sentence|why_skipped|counters"):
        reports.answer(request_)
    assert wired.word("residual_cause") == 0
    assert reports.figures()["age_s"] is None
    assert "looks" not in reports.figures()


def test_strange_counters_and_long_sentences_do_no_harm(wired, reports):
    reports.answer(
        {
            "cause": 12,
            "sentence": "x" * 10000,
            "worse": "y" * 10000,
            "counters": {"looks": 10**400, "cpu_s": "much", "judged": [1]},
        }
    )
    assert not {"looks", "cpu_s", "judged"} & set(reports.figures())
    assert len(wired.said("A345")[0]) < 600
    assert len(wired.said("A347")[0]) < 600


def test_what_a_plant_makes_worse_is_told_once_shown_at_once_and_over_with_the_plant(wired, reports):
    worse = {"do": "residual", "cause": 0, "worse": "the force is worse by 20 %"}
    for _ in range(3):
        reports.answer(worse)
    assert wired.warnings & WarningBit.COMPENSATION_WORSE
    assert len(wired.said("A347")) == 1
    reports.follow_plant(3, 0.0)
    assert not wired.warnings & WarningBit.COMPENSATION_WORSE
    assert reports.answer({"do": "residual"})["plant"] == 3
    reports.answer(worse)
    reports.answer(told(0, ""))
    assert not wired.warnings & WarningBit.COMPENSATION_WORSE
    assert len(wired.said("the force is no worse")) == 2


def test_another_cause_of_the_same_trouble_is_no_second_warning(wired, reports):
    for cause in (
        ResidualCause.COULOMB_FRICTION,
        ResidualCause.LINEAR_DRIFT,
        ResidualCause.NONE,
        ResidualCause.UNKNOWN,
    ):
        reports.answer(told(cause))
    assert reports.figures()["warnings"] == 2


def test_a_truth_is_no_number(reports):
    reports.answer(told(0, "", looks=True))
    assert "looks" not in reports.figures()


def test_what_the_watch_says_of_an_end_is_what_is_told(wired, reports):
    reports.answer(told(ResidualCause.LINEAR_DRIFT))
    reports.answer(told(ResidualCause.NONE, "it has gone by itself"))
    assert wired.said("it has gone by itself")
