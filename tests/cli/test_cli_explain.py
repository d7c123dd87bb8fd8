"""Every code that a user can meet can be explained, offline."""

import ast
import json
import re
from pathlib import Path

import pytest

import gateway
from gateway.cli.codes import CATALOGUE, FAULT_CODES, REFUSAL_CODES, WARNING_CODES
from gateway.control import messages
from gateway.registers.words import FaultCode, RefusalReason, WarningBit

CODE = re.compile(r"\b[EWA]\d{3}\b")


def test_every_fault_warning_and_refusal_has_a_code() -> None:
    assert set(FAULT_CODES) == set(FaultCode) - {FaultCode.NONE}
    assert set(WARNING_CODES) == set(WarningBit)
    assert set(REFUSAL_CODES) == set(RefusalReason) - {RefusalReason.NONE}
    for code in (*FAULT_CODES.values(), *WARNING_CODES.values(), *REFUSAL_CODES.values()):
        assert code in CATALOGUE


def test_faults_have_the_codes_that_control_says() -> None:
    assert messages.FAULT_CODES == FAULT_CODES


def strings_of(path: Path) -> list[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)]


def test_every_code_in_a_message_of_ours_can_be_explained() -> None:
    root = Path(gateway.__file__).parent
    used = {
        (code, str(path.relative_to(root)))
        for path in root.rglob("*.py")
        for text in strings_of(path)
        for code in CODE.findall(text)
    }
    assert {code for code, _ in used} >= {"E104", "E402", "A302"}  # the search does find them
    assert [use for use in sorted(used) if use[0] not in CATALOGUE] == []


@pytest.mark.parametrize("code", "E101 E102 E103 E110 E111 E120 W201 W202 W203 W204 A301 A302 A303 A310 E401".split())
def test_the_codes_of_the_first_hour_are_there(code: str, call) -> None:
    answer = call("explain", code)
    assert answer.exit_code == 0
    assert answer.output.startswith(code)
    for heading in ("seen", "probably", "do"):
        assert f"\n  {heading} " in answer.output


@pytest.mark.parametrize(("word", "code"), [("e110", "E110"), ("over-force", "A313"), ("CELL_LOST", "A318")])
def test_codes_are_found_by_name_and_in_any_case(word: str, code: str, call) -> None:
    assert call("explain", word).output.startswith(code)


def test_without_a_code_all_are_listed(call) -> None:
    lines = call("explain").output.splitlines()
    assert len(lines) == len(CATALOGUE)
    assert lines[0].startswith("E101")


def test_an_unknown_code_gets_a_proposal(call) -> None:
    answer = call("explain", "E112")
    assert answer.exit_code == 2
    assert "did you mean E1" in answer.stderr
    assert call("explain", "nonsense").exit_code == 2


def test_json_has_the_same_fields(call) -> None:
    assert set(json.loads(call("explain", "A301", "--json").output)[0]) == {
        "code",
        "title",
        "seen",
        "probably",
        "do",
        "name",
    }


def test_every_entry_is_whole_and_short() -> None:
    for entry in CATALOGUE.values():
        assert entry.title
        for text in (entry.seen, entry.probably, entry.do):
            assert text.endswith(".")
            assert 10 < len(text) < 160, entry.code
