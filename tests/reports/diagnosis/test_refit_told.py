"""What the rig's plant gets wrong as it stands is told where refitting it takes away more than the noise, by what makes it."""

from dataclasses import replace
from html import escape

import pytest

from gateway.diagnosis.result import Refit, RefittedNumber, Verdict
from gateway.reports.diagnosis import headline
from tests.reports.diagnosis.test_page import page
from tests.reports.fake_diagnosis import diagnosis

NOISE_N = diagnosis().baseline.noise_floor_n
STIFF = RefittedNumber("friction", "coulomb_n", "N", 1.0, 3.0209, 1.45)
SLOWER = RefittedNumber("regulator", "lag_s", "s", 0.072, 0.0711, 0.02)
LARGER = RefittedNumber("cylinder", "area_m2", "m2", 9.5e-5, 1.2e-4, 1.1)
STIFF_TOLD = "friction.coulomb_n is 3.02 N here, 1.00 N in the plant"
LARGER_TOLD = "cylinder.area_m2 is 0.000120 m2 here, 9.50e-05 m2 in the plant"


@pytest.mark.parametrize(("gain_n", "is_told"), [(NOISE_N, False), (1.01 * NOISE_N, True)])
def test_it_is_told_from_the_noise_on(gain_n: float, is_told: bool) -> None:
    found = diagnosis(refit=Refit(1.2 * NOISE_N, gain_n, (STIFF,)))
    assert bool(headline.refit_sentence(found)) is is_told
    assert not headline.refit_sentence(diagnosis())
    assert not headline.refit_sentence(diagnosis(refit=replace(found.refit, is_own=False))), "of nobody's plant"
    clean = diagnosis(causes=(), verdict=Verdict.NOTHING_FOUND, refit=found.refit)
    assert headline.badge(clean) == (("no effect, other numbers", "warn") if is_told else ("nothing found", "good"))
    assert ("the simulation, refitted, is off" in headline.answer_sentence(clean)) is is_told


@pytest.mark.parametrize(
    ("numbers", "told"),
    [
        ((STIFF, SLOWER), STIFF_TOLD),
        ((LARGER, SLOWER, STIFF), f"{LARGER_TOLD} and {STIFF_TOLD}"),
        ((SLOWER,), "regulator.lag_s is 0.0711 s here, 0.0720 s in the plant"),
    ],
)
def test_the_numbers_that_make_the_error_are_named_and_how_to_keep_them(
    numbers: tuple[RefittedNumber, ...], told: str
) -> None:
    found = diagnosis(refit=Refit(1.4487, 1.44, numbers))
    sentence = headline.refit_sentence(found)
    assert sentence == f"As it stands, the rig's plant is off by 1.449 N RMS: {told}. {headline._KEEP_REFIT}"
    assert f"<p class='verdict'>{escape(sentence)}</p>" in page(found)
