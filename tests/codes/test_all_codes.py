"""One table of codes: what is raised is in it, what is in it is raised, and every number in the registers has its entry."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

import gateway
from gateway.codes import alarms, errors, face_errors, machine_errors, notices, page_errors, refusals
from gateway.codes.all_codes import CATALOGUE, find_codes
from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason, SpecialRefusal
from gateway.codes.warning_bits import WarningBit
from gateway.registers import Refusal

ROOT = Path(gateway.__file__).parent
CODE = re.compile(r"\b[EWA]\d{3}\b")
STARTS_WITH_CODE = re.compile(r"\n?([EWA]\d{3})\b")
NUMBERED = (*FaultCode, *RefusalReason, *WarningBit)
SPECIAL = [name for name, value in vars(refusals).items() if isinstance(value, SpecialRefusal)]
NAMED = re.compile(
    "|".join([CODE.pattern, *(table.__name__ for table in (FaultCode, WarningBit, RefusalReason)), *SPECIAL])
)


@cache
def trees() -> tuple[tuple[str, ast.Module], ...]:
    """Every source file outside the table in which a code may stand: the others are not worth parsing."""
    paths = sorted(path for path in ROOT.rglob("*.py") if path.relative_to(ROOT).parts[0] != "codes")
    texts = {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8") for path in paths}
    return tuple((name, ast.parse(text)) for name, text in texts.items() if NAMED.search(text))


@cache
def texts_of(tree: ast.Module) -> tuple[str, ...]:
    """Strings that can reach somebody: no docstrings."""
    nodes = list(ast.walk(tree))
    comments = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    texts = [node for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    return tuple(str(node.value) for node in texts if id(node) not in comments)


def raised_codes() -> set[str]:
    """Codes that a string begins with, of members of the enumerations and of special refusals that are used."""
    used: set[str] = set()
    for _, tree in trees():
        used |= {found[1] for text in texts_of(tree) if (found := STARTS_WITH_CODE.match(text))}
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                for table in (FaultCode, WarningBit, RefusalReason):
                    if node.value.id == table.__name__ and node.attr in table.__members__:
                        used.add(table[node.attr].code)
            if isinstance(node, ast.Name) and isinstance(special := getattr(refusals, node.id, None), SpecialRefusal):
                used.add(special.explanation.code)
    return used - {""}


def test_every_code_in_a_message_is_in_the_table() -> None:
    used = {(code, name) for name, tree in trees() for text in texts_of(tree) for code in CODE.findall(text)}
    assert {code for code, _ in used} >= {"E104", "E402", "A302"}  # the search does find them
    assert [use for use in sorted(used) if use[0] not in CATALOGUE] == []


def test_every_code_of_the_table_is_raised_somewhere() -> None:
    assert set(CATALOGUE) - raised_codes() == set()


def test_a_code_stands_once_in_the_table() -> None:
    """A fault and a warning may share one explanation: the lease's end is either, by the rig's choice."""
    tables = (
        errors.ERRORS,
        machine_errors.MACHINE_ERRORS,
        face_errors.FACE_ERRORS,
        page_errors.PAGE_ERRORS,
        notices.NOTICES,
        alarms.ALARMS,
        [special.explanation for special in refusals.SPECIAL_REFUSALS],
    )
    explanations = [*(each for table in tables for each in table), *(number.explanation for number in NUMBERED)]
    assert len({explanation.code for explanation in explanations if explanation.code}) == len(CATALOGUE)
    by_code: dict[str, object] = {}
    for explanation in explanations:
        assert by_code.setdefault(explanation.code, explanation) is explanation, explanation.code


def test_every_number_in_the_registers_but_none_has_a_code() -> None:
    for number in NUMBERED:
        assert bool(number.code) == (number.name != "NONE"), number
        assert not number.code or CATALOGUE[number.code]


@pytest.mark.parametrize("reason", [reason for reason in RefusalReason if reason is not RefusalReason.NONE])
def test_a_refusal_says_its_code_and_answers_with_the_exception_that_explain_names(reason: RefusalReason) -> None:
    refusal = Refusal(reason, 1, "12 N")
    assert refusal.sentence == f"{reason.code} 12 N"
    assert refusal.code == reason.exception
    if reason.code.startswith("W"):
        assert CATALOGUE[reason.code].seen.endswith(f" Exception {reason.exception:02X}.")


def test_numbers_survive_a_way_through_their_enumerations() -> None:
    for number in NUMBERED:
        assert type(number)(int(number)) is number
    both = WarningBit.RESTARTED | WarningBit.MASTER_LOST
    assert int(both) == 0x81
    assert [bit.code for bit in WarningBit if bit & both] == ["A401", "A310"]


def test_a_name_can_mean_a_fault_and_a_refusal() -> None:
    assert [entry.code for entry in find_codes("not-finite")] == ["W207", "A320"]


def test_every_entry_is_whole_and_short() -> None:
    for entry in CATALOGUE.values():
        assert entry.title
        for text in (entry.seen, entry.probably, entry.do):
            assert text.endswith(".")
            assert 10 < len(text) < 160, entry.code
