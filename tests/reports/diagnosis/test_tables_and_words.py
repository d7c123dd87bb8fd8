"""Tables and words of a diagnosis' report: a neighbour's number, or an order turned round, looks as right as the true one."""

import re
from dataclasses import replace

import numpy as np

from gateway.diagnosis.input_checks import Suspect
from gateway.diagnosis.result import Estimate, Leftover, NotIdentifiable, Rejected
from gateway.reports.diagnosis import headline, tables
from gateway.reports.diagnosis import wording as words
from gateway.reports.diagnosis.series import FALLING, RISING, ResidualRows
from gateway.twin.plant import Plant
from tests.reports.fake_diagnosis import FRICTION, diagnosis, trace


def cells(html: str) -> list[list[str]]:
    """The texts of a table, row by row, without its head."""
    rows = re.findall(r"<tr>(.*?)</tr>", html, re.S)
    return [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row, re.S) for row in rows if "<td" in row]


def test_a_column_that_may_be_in_another_unit_hides_no_answer() -> None:
    doubt = Suspect("E520", "a.csv", "force_n", 4.4, "lbf", is_sure=False)
    sure = replace(doubt, is_sure=True)
    assert headline.badge(diagnosis(suspects=(doubt,))) == headline.badge(diagnosis())
    assert FRICTION.name.capitalize() in headline.answer_sentence(diagnosis(suspects=(doubt,)))
    assert FRICTION.name.capitalize() not in headline.answer_sentence(diagnosis(suspects=(sure,)))


def test_of_what_lost_the_nearest_comes_first() -> None:
    lost = (Rejected("presliding", 0.094), Rejected("creep", 0.003), Rejected("viscous-friction", 0.212))
    told = [row[0] for row in cells(tables.rejected_table(diagnosis(rejected=lost), {}))]
    assert told == ["viscous-friction", "presliding", "creep"]
    many = diagnosis(rejected=tuple(Rejected(f"effect-{k}", 0.01 * k) for k in range(15)))
    html = tables.rejected_table(many, {})
    assert len(cells(html)) == 12 and "3 more gain less than these" in html


def test_a_limit_that_was_never_met_is_no_size_that_was_there_before() -> None:
    found = Estimate("regulator", 4.0e5, "Pa", (3.9e5, 4.1e5))
    assert words.previous_value(replace(diagnosis(), base=Plant()), "supply_pa", found) == ""


def test_the_bar_of_a_share_is_as_long_as_the_share() -> None:
    html = tables.causes_table(diagnosis(causes=(FRICTION,)), {})
    assert "width:96%" in html and "> 96 %" in html


def test_a_column_s_name_is_no_markup() -> None:
    html = tables.leftover_table(diagnosis(leftover=(Leftover("<b>temp</b>", "rises", 0.5),)))
    assert "<b>temp" not in html and "&lt;b&gt;temp" in html


def test_each_direction_has_its_own_numbers_before_and_after() -> None:
    way = np.array([RISING, RISING, FALLING, 0])
    rows = ResidualRows(np.array([1.0, 3.0, -2.0, 7.0]), np.array([0.5, 0.5, 0.25, 8.0]), {}, way)
    rising, falling, neither = cells(tables.directions_table(rows))
    assert neither == ["not yet moved", "1", "7.000 N", "7.000 N", "8.000 N", "8.000 N"]
    assert rising == ["rising", "2", "2.000 N", "2.236 N", "0.500 N", "0.500 N"]
    assert falling == ["falling", "1", "−2.000 N", "2.000 N", "0.250 N", "0.250 N"]


def test_a_force_keeps_its_sign() -> None:
    assert (words.force(-1.5), words.force(-12.3456)) == ("−1.500", "−12.35")


def test_a_note_of_a_reader_is_told_once_and_with_its_recording() -> None:
    note = "line 812, force_n: '--' is no number"
    several = diagnosis(traces=(trace("a.csv"), trace("b.csv")), notes=("the noise is coloured", note))
    assert words.all_notes(several) == ["the noise is coloured", f"a.csv: {note}", f"b.csv: {note}"]


def test_what_no_recording_would_show_is_no_proposal() -> None:
    unseen = (NotIdentifiable("hum", "too slow", ""), NotIdentifiable("creep", "no dwell", "dwell for a minute"))
    told = words.next_recordings(diagnosis(experiments=(), not_identifiable=unseen))
    assert told == [("dwell for a minute", ("creep",))]
