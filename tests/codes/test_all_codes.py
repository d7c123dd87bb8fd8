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


FROZEN = {
    FaultCode: "1:A310 2:A311 3:A312 4:A313 5:A302 6:A303 7:A314 8:A315 9:A316 10:A317 11:A318 12:A319 13:A320 14:A499 "
    "15:A321 16:A403 17:A355 18:A356 20:A332 21:A333 22:A334",
    WarningBit: "1:A401 2:A301 4:A340 8:A341 16:A342 32:A343 64:A344 128:A310 256:A345 512:A347 1024:W361",
    RefusalReason: "1:W202 2:W205 3:W206 4:W207 5:W204 6:W201 7:W208 8:W209 9:W210 10:W211 11:W212 12:W213 13:W214 14:W215 "
    "15:W216 16:W217 17:W218 18:W219 19:W220 20:W221 21:E401 22:W302 23:W312 24:W303 25:W305 26:W310 27:W311 28:W313 "
    "29:W315 30:W331 31:W306 32:W307 33:W308 34:W309 40:W222",
}
"""What the numbers in the registers are called: masters' programs, alarm lists and people know them so. Only new ones come."""


@pytest.mark.parametrize("kind", FROZEN, ids=lambda kind: kind.__name__)
def test_a_number_keeps_its_code(kind: type[FaultCode] | type[WarningBit] | type[RefusalReason]) -> None:
    codes = {f"{int(member)}:{member.explanation.code}" for member in kind if member.explanation.code}
    assert set(FROZEN[kind].split()) <= codes


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


@pytest.mark.parametrize("fault", [fault for fault in FaultCode if fault is not FaultCode.NONE])
def test_what_to_do_about_a_fault_ends_with_the_reset(fault: FaultCode) -> None:
    """Faults latch: of eleven of them it was said what to mend, and not how work goes on."""
    assert "reset" in CATALOGUE[fault.code].do


def test_numbers_survive_a_way_through_their_enumerations() -> None:
    for number in NUMBERED:
        assert type(number)(int(number)) is number
    both = WarningBit.RESTARTED | WarningBit.MASTER_LOST
    assert int(both) == 0x81
    assert [bit.code for bit in WarningBit if bit & both] == ["A401", "A310"]


@pytest.mark.parametrize("ended", [*WarningBit, WarningBit.RESTARTED | WarningBit.MASTER_LOST])
def test_what_ends_takes_no_other_warning_with_it(ended: WarningBit) -> None:
    """By Python 3.11.2's own `~` the end of noise took each warning above it out of the registers."""
    everything = WarningBit(sum(WarningBit))
    assert [bit for bit in WarningBit if bit not in everything & ~ended] == [bit for bit in WarningBit if bit in ended]


def test_a_name_can_mean_a_fault_and_a_refusal() -> None:
    assert [entry.code for entry in find_codes("not-finite")] == ["W207", "A320"]


def test_every_entry_is_whole_and_short() -> None:
    for entry in CATALOGUE.values():
        assert entry.title
        for text in (entry.seen, entry.probably, entry.do):
            assert text.endswith(".")
            assert 10 < len(text) < 160, entry.code
