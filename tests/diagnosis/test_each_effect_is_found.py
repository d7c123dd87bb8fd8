"""Each effect of the catalogue, strong and excited, is named with its size; without it the same recording shows nothing.

The twin makes these recordings: the least that a search must do. The push gate asks six effects of different families and
two recordings without any; --long asks all 45, with and without. Load-dependent friction and a quantised command are asked in
each push too, by search/test_laws_of_the_search.py.
"""

import pytest

from gateway.diagnosis import Diagnosis, Options, Verdict, diagnose
from gateway.diagnosis.result import Cause
from tests.diagnosis.hidden import BY_NAME, EXAMPLES, OTHER_FORMS, Hidden
from tests.diagnosis.machine import NOISE_N

GATE = (
    "transport-delay",
    "presliding",
    "tilt-gravity",
    "creep",
    "thermal-span-drift",
    "outliers",
)
GATE_WITHOUT = ("supply-saturation", "side-load")
ALL = [each.name for each in EXAMPLES]


def diagnosed(example: Hidden, *, hidden: bool) -> Diagnosis:
    return diagnose([example.recording(hidden=hidden)], None, Options(without=example.without))


def cause_of(found: Diagnosis, name: str) -> Cause:
    """The cause that is it, or whose group holds it."""
    causes = [cause for cause in found.causes if name in (cause.name, *cause.group)]
    assert causes, f"{name} is not among {[(cause.name, cause.group) for cause in found.causes]}, {found.leftover}"
    return causes[0]


def assert_sizes(example: Hidden, cause: Cause) -> None:
    """Only where the name is right do its parameters mean the same."""
    for name, value in example.expected.items():
        estimate = cause.parameters[name]
        assert 1.0 / example.factor < estimate.value / value < example.factor, (example.name, name, estimate)
        assert estimate.ci95[0] <= estimate.value <= estimate.ci95[1]


def assert_found(example: Hidden) -> None:
    name = example.name
    found = diagnosed(example, hidden=True)
    cause = cause_of(found, name)
    assert found.verdict not in (Verdict.NOTHING_FOUND, Verdict.UNKNOWN)
    assert cause.name in cause.group
    assert 0.0 <= cause.confidence <= 1.0
    if cause.name == name:
        assert_sizes(example, cause)
    if example.changes:
        assert found.baseline.rms_n > 1.5 * NOISE_N
        assert found.extended.held_out_rms_n < 0.75 * found.baseline.rms_n
        assert cause.gain.ci95[0] > 0.0


def assert_nothing_found(name: str) -> None:
    found = diagnosed(BY_NAME[name], hidden=False)
    assert found.causes == ()
    assert found.verdict == Verdict.NOTHING_FOUND, found.leftover
    assert found.baseline.rms_n == pytest.approx(NOISE_N, rel=0.05)
    assert found.baseline.noise_floor_n == pytest.approx(NOISE_N, rel=0.05)


@pytest.mark.sampled
@pytest.mark.parametrize("name", GATE)
def test_an_effect_is_named_with_its_size(name: str) -> None:
    assert_found(BY_NAME[name])


@pytest.mark.parametrize("name", GATE_WITHOUT)
def test_without_the_effect_nothing_is_found(name: str) -> None:
    assert_nothing_found(name)


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in ALL if name not in GATE])
def test_every_other_effect_is_named_with_its_size(name: str) -> None:
    assert_found(BY_NAME[name])


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in ALL if name not in GATE_WITHOUT])
def test_without_any_other_effect_nothing_is_found(name: str) -> None:
    assert_nothing_found(name)


@pytest.mark.parametrize("example", OTHER_FORMS[:1], ids=lambda each: each.name)
def test_an_effect_is_named_in_another_form(example: Hidden) -> None:
    assert_found(example)


@pytest.mark.long
@pytest.mark.parametrize("example", OTHER_FORMS[1:], ids=lambda each: each.name)
def test_every_other_form_is_named(example: Hidden) -> None:
    assert_found(example)
