"""The generated texts are such as their languages allow: names, lines, marks; all that is used is declared."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.codes.warning_bits import WarningBit
from gateway.registers.words import SelfTestResult
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.machine import Machine
from tests.clients.programs.syntax.languages import PATTERNS, parse
from tests.clients.programs.syntax.parser import Unit
from tests.clients.programs.syntax.tokens import tokenize
from tests.clients.scenes import LANGUAGES, MAP, MODEL, TEXTS, cycles

RESERVED = {
    "rapid": "alias and backward case connect const default div do else elseif endfor endfunc endif endmodule endproc "
    "endrecord endtest endtrap endwhile error exit false for from func goto if inout local mod module nostepin not noview or "
    "pers proc "
    "raise readonly record retry return step sysmodule task test then to trap true trynext undo var viewonly while with xor",
    "scl": "and any array at begin block_db bool by byte case char const constant continue counter data_block date dint do "
    "dword "
    "else elsif en end_case end_for end_if end_region end_repeat end_struct end_while eno exit false for function goto if int "
    "label lint lreal mod nil not of ok or organization_block pointer program real region repeat return s5time sint string "
    "struct then time timer title to true type udint uint ulint until usint var variant version void wchar while "
    "word wstring xor "
    # names of the system's own data types: MB_COMM_LOAD's "PORT" has quotes for that reason
    "aom_ident conn_any conn_ouc conn_prg conn_r_id db_any db_dyn db_www event_any event_att hw_any hw_device hw_dpmaster "
    "hw_dpslave hw_hsc hw_ieport hw_interface hw_io hw_iosystem hw_pto hw_pwm hw_submodule hw_subslot ob_any ob_att ob_cyclic "
    "ob_delay ob_diag ob_hwint ob_pcycle ob_startup ob_timeerror ob_tod pip port remote rtm",
    "st": "abs abstract acos action adr and and_then any array asin at atan bitadr bool by byte case concat configuration "
    "constant continue cos date dint do dt dword else elsif end_action end_case end_for end_function end_function_block "
    "end_if end_program end_repeat end_struct end_type end_var end_while exit exp expt extends false final find for from "
    "function function_block goto if implements indexof ini insert int interface internal jmp ldate left len limit lint ln "
    "log lreal lword max method mid min mod move mux not of on or or_else override pointer private program property "
    "protected public real reference repeat replace resource retain return right rol ror sel set shl shr sin sint sizeof "
    "sqrt step string struct super tan task then this time to tod transition true trunc type udint uint ulint union until "
    "usint var var_config var_external var_global var_in_out var_input var_output var_temp while with word wstring xor",
    "urscript": "and break continue def elif else end enter_critical exit_critical false for global halt if join kill local "
    "not or return run sec signal switch sync thread true wait while xor case default length",
}


def names_of(unit: Unit) -> list[str]:
    names = [*unit.variables, *unit.types, *unit.routines, *(member for each in unit.types.values() for member in each)]
    for routine in unit.routines.values():
        names += [*routine.variables, *(parameter[0] for parameter in routine.parameters)]
    return [name.strip('"').lstrip("#") for name in names]


@pytest.mark.parametrize(("language", "longest"), [("rapid", 32), ("scl", 128), ("st", 64), ("urscript", 64)])
def test_names_are_such_as_the_language_allows(language: str, longest: int) -> None:
    names = names_of(parse(TEXTS[language], language))
    assert len(names) > 40
    assert [name for name in names if len(name) > longest] == []
    assert {name for name in names if name.lower() in RESERVED.get(language, "").split()} == set()


def test_scl_marks_its_own_names_and_no_others() -> None:
    """Behind BEGIN a name of the block's own has its #; what has none is a member, an argument or a function."""
    body = TEXTS["scl"].split('FUNCTION_BLOCK "ForceGateway"', 1)[1].split("BEGIN", 1)[1]
    own = parse(TEXTS["scl"], "scl").routines['"ForceGateway"'].variables
    tokens = tokenize(re.sub(r"REGION .*", "", body), PATTERNS["scl"])
    assert {each.text[1:] for each in tokens if each.text.startswith("#")} <= set(own)
    for before, token, after in zip(tokens, tokens[1:], tokens[2:], strict=False):
        if token.kind == "name" and token.text in own:
            assert before.text == "." or after.text in (":=", "=>"), token


def test_rapid_lines_fit_the_editor_and_strings_the_language() -> None:
    assert [line for line in TEXTS["rapid"].splitlines() if len(line) > 80] == []
    assert all(len(text) <= 80 for text in re.findall(r'"([^"]*)"', TEXTS["rapid"]))
    assert TEXTS["rapid"].isascii()


@pytest.mark.parametrize("language", LANGUAGES)
def test_no_text_of_the_shipped_map_is_cut(language: str) -> None:
    """Of 'W302 fault reset, or enable behind a lost master, withou' nobody reads that a new heartbeat is what lacks."""
    titles = [
        f"{each.code} {each.explanation.title}" for each in (*FaultCode, *RefusalReason, *WarningBit) if each.code
    ]
    spelled = TEXTS[language].replace("$'", "'")
    assert len(titles) > 60 and [title for title in titles if title not in spelled] == []


def test_every_rapid_routine_runs_and_declares_what_it_uses() -> None:
    gateway = GatewayAtHand(MAP)
    client = Irc5(TEXTS["rapid"], gateway)
    client.enable(12.0)
    client.set(fgTare=True, fgTake=True)
    cycles(client, 2)
    client.begin_upload(MODEL, 1)
    cycles(client, 12)
    gateway.fail(FaultCode.OVER_FORCE)
    client.cycle()
    client.force(400.0)
    client.cycle()
    client.reset()
    cycles(client, 2)
    client.self_test()
    cycles(client, 2)
    gateway.end_self_test(SelfTestResult.PASSED)
    client.cycle()
    client.machine.start("FgTimerStart")
    client.machine.start("FgTick")
    client.machine.start("FgTimerStop")
    for name in ("FgFaultText", "FgRefusalText", "FgWarningText", "FgFailingText", "FgStateText", "FgVerdictText"):
        client.machine.start(name, 1)
    client.machine.start("FgCrcIsRight")
    gateway.is_cut = True
    client.cycle()
    client.enable(65.0)
    gateway.is_cut = False
    client.cycle(10.0)
    client.serve(2)
    unused = set(client.machine.unit.routines) - client.machine.called
    assert unused <= {"FgExplain"}, unused


@pytest.mark.parametrize(
    ("language", "wrong"),
    [
        ("rapid", "MODULE M\n VAR num a:=1\nENDMODULE"),
        ("rapid", "MODULE M\n PROC p()\n IF a THEN\n ENDPROC\nENDMODULE"),
        ("rapid", "MODULE M\n PROC p()\n a=1;\n ENDPROC\nENDMODULE"),
        ("rapid", "MODULE M\n PROC p()\n IF a AND NOT b RETURN;\n ENDPROC\nENDMODULE"),
        ("scl", 'FUNCTION "F" : Int\nVERSION : 0.1\nBEGIN\n IF TRUE THEN\nEND_FUNCTION'),
        ("st", "FUNCTION F : INT\nVAR\n a : INT;\n A : INT;\nEND_VAR\nEND_FUNCTION"),
        ("urscript", "def f():\n  if True:\n    x = 1\nend\n"),
        ("urscript", "x == 1\n"),
        ("urscript", "x = 5 % 3\n"),
    ],
)
def test_the_parsers_refuse_what_the_languages_do(language: str, wrong: str) -> None:
    with pytest.raises(SyntaxError):
        parse(wrong, language)


@pytest.mark.skipif(not (shutil.which("gcc") and shutil.which("g++")), reason="no gcc or no g++")
@pytest.mark.parametrize("implementation", ["client.c", "client.cpp"])
def test_a_program_of_cpp_uses_the_client_of_c_compiled_as_either(implementation: str, tmp_path: Path) -> None:
    (tmp_path / "force_gateway.h").write_text(TEXTS["c"])
    (tmp_path / implementation).write_text('#define FORCE_GATEWAY_IMPLEMENTATION\n#include "force_gateway.h"\n')
    program = '#include "force_gateway.h"\n#include <cstdio>\nint main() { std::puts(fg_state_text(3)); }\n'
    (tmp_path / "main.cpp").write_text(program)
    compiler = "gcc" if implementation.endswith(".c") else "g++"
    subprocess.run([compiler, "-Wall", "-Werror", "-c", implementation, "-o", "client.o"], cwd=tmp_path, check=True)
    subprocess.run(["g++", "-Wall", "-Werror", "main.cpp", "client.o", "-o", "it"], cwd=tmp_path, check=True)
    said = subprocess.run([tmp_path / "it"], capture_output=True, text=True, check=True)
    assert said.stdout == "holding\n"


def test_the_interpreter_finds_a_name_that_nobody_declared() -> None:
    machine = Machine(parse("MODULE M\n PROC p()\n  nowhere:=1;\n ENDPROC\nENDMODULE", "rapid"), {"first_index": 1})
    machine.begin()
    with pytest.raises(NameError, match="nowhere"):
        machine.start("p")


def test_a_motion_program_beside_the_task_of_an_irc5_is_told_what_it_does_not_see() -> None:
    """Tasks share persistent data alone: of the example for both cases T_ROB1 would know neither FgResultText nor FG_T_LEAK."""
    head, module = TEXTS["rapid"].split("! ---- where the gateway is", 1)
    beside, both = head.split("! Use in T_ROB1, both cases:", 1)
    shared = set(re.findall(r"PERS \w+ (\w+)", module))
    unseen = {name for name in re.findall(r"\b(?:FG_|[fF]g[A-Z])\w+", both) if name not in shared}
    assert {"FgResultText", "FG_T_LEAK"} <= unseen
    assert "T_ROB1 sees none of this module's constants and routines: copy" in " ".join(
        re.sub(r"!", " ", beside).split()
    )
