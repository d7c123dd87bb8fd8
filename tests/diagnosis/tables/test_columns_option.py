"""What corrects a column does so in one go: it stands beside what was said of the table already, by an option or a header."""

import pytest

from gateway.diagnosis.columns_option import columns_option, name_options
from gateway.diagnosis.input_checks import SWAPPED, TURNED, UNIT, Suspect

IN_KGF = Suspect(UNIT, "a.csv", "force_n", 0.102, "kgf")
TURNED_SIGN = Suspect(TURNED, "a.csv", "force_n", -1.0, "-n")
EXCHANGED = Suspect(SWAPPED, "a.csv", "command_v", 0.1, other="force_n")


def test_the_option_keeps_the_sources_that_were_given() -> None:
    assert columns_option(IN_KGF) == "--columns force_n=force_n:kgf"
    assert columns_option(IN_KGF, "time_s=1:ms,force_n=7:n") == "--columns time_s=1:ms,force_n=7:kgf"
    assert columns_option(IN_KGF, "sheet=Press,force_n=7") == "--columns sheet=Press,force_n=7:kgf"
    assert columns_option(EXCHANGED) == "--columns command_v=force_n,force_n=command_v"
    assert columns_option(EXCHANGED, "command_v=2,force_n=3:n") == "--columns command_v=3:v,force_n=2"


@pytest.mark.parametrize(
    ("suspect", "given", "factor", "option"),
    [
        (TURNED_SIGN, "", 9.80665, "force_n=force_n:-kgf"),
        (TURNED_SIGN, "force_n=3:kgf", 9.80665, "force_n=3:-kgf"),
        (TURNED_SIGN, "force_n=3:-n", -1.0, "force_n=3:n"),
        (IN_KGF, "force_n=3:-n", -1.0, "force_n=3:-kgf"),
        (Suspect(UNIT, "a.csv", "force_n", 1e-3, "kn"), "force_n=3:gf", 9.80665e-3, "force_n=3:kgf"),
        (Suspect(UNIT, "a.csv", "time_s", 1.0, "ms"), "time_s=1:ms", 1.0e-3, "time_s=1:us"),
        (IN_KGF, "force_n=3:4..20=0..500n", 31.25, "force_n=3:4..20=0..500kgf"),
        (TURNED_SIGN, "force_n=3:4..20=0..500", 31.25, "force_n=3:4..20=0..-500n"),
        (TURNED_SIGN, "force_n=3:4..20=-5..50kgf", 33.7, "force_n=3:4..20=5..-50kgf"),
        (EXCHANGED, "", 1.0e-3, "command_v=force_n:mv,force_n=command_v"),
    ],
)
def test_what_was_converted_already_stays_so(suspect: Suspect, given: str, factor: float, option: str) -> None:
    found = columns_option(suspect, given, {"force_n": factor, "time_s": factor})
    assert found == f"--columns {option}"


def test_where_no_unit_corrects_it_none_is_told() -> None:
    assert columns_option(IN_KGF, "force_n=3:kgf", {"force_n": 9.80665}) == ""
    (named,) = name_options([IN_KGF], None)
    assert "corrects it" not in named.sentence
