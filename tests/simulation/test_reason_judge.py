"""Who judges the causes of faults sees each that blames somebody who did nothing."""

import struct

import pytest

from tests.simulation.judges.observer import FAULT, STATUS_WORDS, Bounds, Observer
from tests.simulation.judges.reason_judge import EVER_S, REASONS, REFUSED, WARNED, ReasonJudge

BOUNDS = Bounds(8.5, 40.0, 0.125, 0.1, 0.2, 0.05)
SETTINGS = {"load_cell": "cell.silent", "output": "output.refuse", "valve": "valve.stuck", "force": "air.off"}


def look(judge: ReasonJudge, fault: int, at_s: float, *, refusal: int = 0, warnings: int = 0) -> None:
    words = [0] * STATUS_WORDS
    words[1], words[10], words[11], words[19] = FAULT if fault else 0, fault, warnings, refusal
    judge.judge(struct.pack(f">{STATUS_WORDS}H", *words), at_s)


@pytest.mark.parametrize("fault", [1, 13, 14, 15, *REASONS])
@pytest.mark.parametrize("disturbed", [None, *SETTINGS, "machine"])
def test_a_fault_without_its_reason_is_seen(fault: int, disturbed: str | None) -> None:
    observer = Observer(BOUNDS)
    judge = ReasonJudge(observer)
    if disturbed in SETTINGS:
        judge.note_settings((SETTINGS[disturbed],), 9.0)
    elif disturbed:
        judge.note(disturbed, 9.0)
    touched = {disturbed} | ({"force"} if disturbed in ("load_cell", "output", "valve") else set())
    has_reason = fault == 1 or bool(touched & set(REASONS.get(fault, ())))
    look(judge, fault, 10.0)
    look(judge, fault, 10.1)
    assert len(observer.broken) == (not has_reason), "and told once"


@pytest.mark.parametrize("fault", REASONS)
def test_a_payload_explains_too_much_force_and_nothing_else(fault: int) -> None:
    observer = Observer(BOUNDS)
    judge = ReasonJudge(observer)
    judge.has_payload = True
    look(judge, fault, 10.0)
    assert len(observer.broken) == (fault != 4)


@pytest.mark.parametrize(("fault", "whom", "after_s"), [(7, "output", 1.5), (6, "load_cell", 3.0)])
def test_a_reason_of_long_ago_is_none(fault: int, whom: str, after_s: float) -> None:
    observer = Observer(BOUNDS)
    judge = ReasonJudge(observer)
    judge.note(whom, 9.0)
    look(judge, fault, 8.9 + after_s)
    look(judge, 0, 9.0 + after_s)
    assert not observer.broken
    look(judge, fault, 9.1 + after_s)
    assert [line.partition(" at ")[0] for line in observer.broken] == ["reason"]


@pytest.mark.parametrize("refusal", [5, *REFUSED])
@pytest.mark.parametrize("disturbed", [None, "load_cell", "output", "valve", "machine", "force"])
def test_a_refusal_that_blames_somebody_who_did_nothing_is_seen(refusal: int, disturbed: str | None) -> None:
    observer = Observer(BOUNDS)
    judge = ReasonJudge(observer)
    if disturbed:
        judge.note(disturbed, 9.0)
    look(judge, 0, 10.0, refusal=refusal)
    look(judge, 0, 10.1, refusal=refusal)
    after_s, reasons = REFUSED.get(refusal, (EVER_S, ()))
    is_lie = refusal in REFUSED and disturbed not in reasons
    assert len(observer.broken) == is_lie, "and told once"
    look(judge, 0, 12.1)
    look(judge, 0, 12.2, refusal=refusal)
    assert len(observer.broken) == is_lie + (is_lie or after_s < EVER_S), "long ago"


@pytest.mark.parametrize("bit", [5, *WARNED])
@pytest.mark.parametrize("disturbed", [None, "load_cell", "output", "valve", "machine", "force"])
def test_a_warning_without_its_reason_is_seen_once(bit: int, disturbed: str | None) -> None:
    observer = Observer(BOUNDS)
    judge = ReasonJudge(observer)
    if disturbed:
        judge.note(disturbed, 9.0)
    for number in range(3):
        look(judge, 0, 10.0 + 0.1 * number, warnings=1 << bit | 1 << 5)
    after_s, reasons = WARNED.get(bit, (0.0, ()))
    assert len(observer.broken) == (bit in WARNED and disturbed not in reasons)
    look(judge, 0, 10.5)
    look(judge, 0, 9.1 + after_s, warnings=1 << bit)
    assert len(observer.broken) == 2 * (bit in WARNED and disturbed not in reasons) + (disturbed in reasons)
