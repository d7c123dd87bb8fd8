"""Rules of the real controllers that a text may break although its grammar is right, and what only the integrator knows."""

from __future__ import annotations

import struct
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from gateway.clients import Endpoint, MissingRegisterError, render_client
from gateway.profiles import load_register_map
from gateway.registers import RegisterMap
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.plc import Plc
from tests.clients.programs.controllers.s7 import S7, MbClient
from tests.clients.programs.controllers.structured_text import Codesys, TwinCat
from tests.clients.programs.controllers.universal_robot import UniversalRobot
from tests.clients.programs.iec_libraries import TwinCatRequest
from tests.clients.programs.machine import Machine, TaskStopped
from tests.clients.programs.syntax.languages import parse
from tests.clients.scenes import MAP, MODEL, TEXTS, WHERE, command, commands, cycles

LANGUAGES = ("rapid", "scl", "st", "urscript", "c", "python")
PROFILES = Path(__file__).parents[3] / "profiles"
FIFTY_DAYS_S = 50 * 86400.0


def test_a_loss_after_fifty_days_does_not_stop_the_task_of_an_irc5() -> None:
    """ClkStop raises ERR_OVERFLOW of a clock that has run for 49 days, and within an ERROR handler nothing catches it."""
    gateway = GatewayAtHand(MAP)
    client = Irc5(TEXTS["rapid"], gateway)
    client.enable(12.0)
    cycles(client)
    client.cycle(FIFTY_DAYS_S)
    gateway.is_cut = True
    cycles(client)
    assert client.ended and "lost" in client.text
    gateway.is_cut = False
    client.cycle(10.0)
    client.machine.start("FgTimerStop")
    client.now_s += FIFTY_DAYS_S
    client.machine.start("FgTimerStart")
    client.enable(5.0)
    cycles(client)
    assert client.enabled


def test_a_task_beside_the_motion_program_keeps_no_force_up_when_that_program_stands() -> None:
    """A SemiStatic task runs on after a stop or an emergency stop of T_ROB1, whose timer interrupt does not."""
    gateway = GatewayAtHand(MAP)
    client = Irc5(TEXTS["rapid"], gateway)
    alive: list[int] = []

    def program() -> None:
        alive.append(len(alive))
        client.set(fgAlive=(client.get("fgAlive") + 1) % 1000)
        if len(alive) == 2:
            client.enable(12.0)

    def program_for_20_pauses() -> None:
        if len(alive) < 20:
            program()
        elif len(alive) == 20:
            alive.append(gateway.bank.command.control_word)

    client.serve(40, program_for_20_pauses)
    assert alive[-1] == 1, "it pressed while the program ran"
    assert commands(gateway) == [command(1, 1200), command(0, 0)]
    assert client.ended and not client.get("fgEnable") and "T_ROB1 does not count fgAlive" in client.text


def test_a_task_beside_a_motion_program_that_shows_no_life_enables_nothing() -> None:
    gateway = GatewayAtHand(MAP)
    client = Irc5(TEXTS["rapid"], gateway)
    client.serve(20, lambda: client.enable(12.0))
    assert gateway.writes == [] and client.ended and "fgAlive" in client.text


@pytest.mark.parametrize("kind", [S7, TwinCat, Codesys])
def test_an_input_that_is_true_when_a_controller_starts_enables_nothing(kind: type[Plc]) -> None:
    gateway = GatewayAtHand(MAP)
    client = kind(TEXTS["scl" if kind is S7 else "st"], gateway)
    names = ("enable", "reset", "tare", "take", "test", "upload")
    client.inputs |= dict.fromkeys([client.NAMES[each] for each in names], True)
    client.inputs[client.NAMES["force"]] = 12.0
    cycles(client)
    assert gateway.requests and gateway.writes == [] and gateway.uploads == []
    client.enable(12.0)
    cycles(client)
    assert client.enabled


@pytest.mark.parametrize("kind", [S7, TwinCat, Codesys])
def test_a_reset_disables_though_its_input_still_asks_for_the_force(kind: type[Plc]) -> None:
    """Else it would be refused, for it needs force 0. OFF goes ahead: it has to stand where the reset is refused."""
    gateway = GatewayAtHand(MAP)
    client = kind(TEXTS["scl" if kind is S7 else "st"], gateway)
    client.enable(12.0)
    cycles(client)
    client.inputs[client.NAMES["reset"]] = True
    cycles(client)
    assert [words[:2] for words in gateway.words if words[0] != 1] == [(0, 0), (2, 0)] and not gateway.exceptions
    assert not client.enabled


def test_an_mb_client_that_stays_busy_is_a_loss_and_shows_nothing_stale(monkeypatch: pytest.MonkeyPatch) -> None:
    """While a connection does not come about MB_CLIENT may be BUSY, and say neither DONE nor ERROR."""
    gateway = GatewayAtHand(MAP)
    client = S7(TEXTS["scl"], gateway)
    client.enable(12.0)
    cycles(client)
    finish = MbClient.finish
    monkeypatch.setattr(MbClient, "finish", lambda self, given: setattr(self, "BUSY", True))
    client.cycle(2.5)
    assert client.ended and not client.enabled and "lost" in client.text
    monkeypatch.setattr(MbClient, "finish", finish)
    client.cycle(5.0)
    assert commands(gateway) == [command(1, 1200), command(0, 0)]


@pytest.mark.parametrize("kind", [S7, TwinCat])
def test_a_request_that_fails_in_its_own_call_is_tried_again_no_sooner(
    kind: type[Plc], monkeypatch: pytest.MonkeyPatch
) -> None:
    tries: list[float] = []

    def fail(block: Any, given: dict[str, Any]) -> None:
        is_asked = given["REQ"] if kind is S7 else given["bExecute"]
        block.ERROR = block.bError = is_asked
        if is_asked:
            tries.append(client.now_s)

    monkeypatch.setattr(MbClient if kind is S7 else TwinCatRequest, "call", fail)
    client = kind(TEXTS["scl" if kind is S7 else "st"], GatewayAtHand(MAP))
    client.WAIT_CYCLE_S = client.CYCLE_S
    client.cycle(8.0)
    gaps = [later - earlier for earlier, later in pairwise(tries)]
    assert [round(gap, 1) for gap in gaps] == [0.3, 0.5, 1.0, 2.0, 4.0]


def test_an_error_within_a_handler_of_rapid_stops_the_task() -> None:
    text = "MODULE M\n PROC p()\n  SocketSend;\n ERROR\n  SocketSend;\n  RETURN;\n ENDPROC\nENDMODULE"
    irc5 = Irc5(TEXTS["rapid"], GatewayAtHand(MAP))
    irc5.is_open = False
    machine = Machine(parse(text, "rapid"), irc5.library())
    machine.begin()
    with pytest.raises(TaskStopped, match="in the ERROR handler of p"):
        machine.start("p")


@pytest.mark.parametrize(("given", "sent"), [(12.5, 13), (-7.0, 65529), (70000, 0), (-32769, 0), (65535, 65535)])
def test_a_word_of_the_command_that_pack_raw_bytes_would_not_take_loses_no_connection(given: float, sent: int) -> None:
    gateway = GatewayAtHand(MAP)
    client = Irc5(TEXTS["rapid"], gateway)
    client.enable(12.0)
    cycles(client)
    client.get("fgCommand")[client.get("FG_C_COMMAND_SEQUENCE") - 1] = given
    cycles(client)
    assert client.enabled and client.get("fgConnected") and not gateway.exceptions
    assert gateway.words[-1][10] == sent
    assert ("allowed -32768 .. 65535" in client.text) is (abs(given) in (70000, 32769))


@pytest.mark.parametrize(
    ("name", "value"), [("fgSlot", 2.5), ("fgSlot", -1), ("fgSet", -1), ("fgSet", 0.5), ("fgSet", 70000)]
)
def test_a_word_of_an_upload_that_pack_raw_bytes_would_not_take_costs_no_force(name: str, value: float) -> None:
    gateway = GatewayAtHand(MAP)
    client = Irc5(TEXTS["rapid"], gateway)
    client.enable(12.0)
    cycles(client)
    client.begin_upload(MODEL, 3)
    if name == "fgSlot":
        client.set(fgSlot=value)
    else:
        client.get("fgSet")[client.get("FG_M_ORDER") - 1] = value
    cycles(client, 10)
    assert client.enabled and not client.ended and gateway.uploads == []
    assert client.text.startswith(name) and "whole" in client.text
    assert not client.get("fgUpload") and not client.uploaded


def test_a_word_of_the_command_of_a_universal_robot_is_whole_and_has_16_bits() -> None:
    gateway = GatewayAtHand(MAP)
    client = UniversalRobot(TEXTS["urscript"], gateway)
    place = client.get("FG_C_COMMAND_SEQUENCE")
    assert client.machine.start("fg_set_command", place, 70000) is False
    assert "-32768 .. 65535" in client.text
    assert client.machine.start("fg_set_command", place, 12.5) is True
    client.enable(12.0)
    cycles(client)
    assert commands(gateway) == [(*command(1, 1200)[:9], 13, 0, 0)]


@pytest.mark.sampled
@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize(
    ("where", "told"),
    [
        (Endpoint("192.168.125.20", 0, 1), "FILL IN the port: the rig's network.port is 0, another at each start."),
        (Endpoint("0.0.0.0", 502, 1), "FILL IN the address: the rig listens on every one of its machine."),
        (Endpoint("::", 502, 1), "FILL IN the address: the rig listens on every one of its machine."),
    ],
)
def test_what_no_rig_can_know_is_left_to_the_integrator_in_so_many_words(
    language: str, where: Endpoint, told: str
) -> None:
    text = render_client(MAP, language, where)
    assert told in text
    if language not in ("c", "python"):
        parse(text, language)
    if language == "rapid":
        assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize("language", LANGUAGES)
def test_this_machine_s_own_address_is_no_address_for_a_controller(language: str) -> None:
    from_elsewhere = language not in ("c", "python")
    told = "FILL IN the address: no other machine reaches 127.0.0.1."
    assert (told in render_client(MAP, language, replace(WHERE, host="127.0.0.1"))) is from_elsewhere
    assert ("knows no IPv6" in render_client(MAP, language, replace(WHERE, host="2001:db8::1"))) is from_elsewhere
    assert "FILL IN" not in render_client(MAP, language, WHERE)


def own_map(folder: Path, old: str, new: str) -> RegisterMap:
    """Return force-v1 with one change."""
    text = (PROFILES / "registers" / "force-v1.yaml").read_text()
    assert text.count(old) == 1
    (folder / "own.yaml").write_text(text.replace(old, new).replace("name: force-v1", "name: own"))
    return load_register_map(str(folder / "own.yaml"))


def test_the_longest_text_of_a_map_of_one_s_own_fits_the_strings_of_rapid(tmp_path: Path) -> None:
    names = ", ".join(f"{k}: {'n' * 90}_{k}" for k in range(20))
    changed = own_map(tmp_path, "values: failing_reason", f"values: {{{names}}}")
    client = Irc5(render_client(changed, "rapid", WHERE), GatewayAtHand(changed))
    client.begin_upload(MODEL | {"rising_b": [0.0, 70.0, 60.0]}, 0)
    cycles(client, 8)
    assert "nnnn" in client.text and not client.get("fgUploaded")


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_map_with_the_low_word_first_is_told_instead_of_read_wrongly(language: str, tmp_path: Path) -> None:
    changed = own_map(tmp_path, "name: range_low, address: 1002,", "name: range_low, address: 1002, word_order: cdab,")
    with pytest.raises(MissingRegisterError, match=r"map own lacks word order abcd in block staging$"):
        render_client(changed, language, WHERE)


def test_a_universal_robot_may_be_given_whole_numbers_and_decimal_ones_alike() -> None:
    """A variable of URScript keeps the type of its first value."""
    client = UniversalRobot(TEXTS["urscript"], GatewayAtHand(MAP))
    client.machine.start("fg_model_number", client.get("FG_M_RANGE_HIGH"), 8)
    client.machine.start("fg_model_count", client.get("FG_M_ORDER"), 2.0)
    client.machine.start("fg_upload", 3.0)
    words = client.get("fg_set_a")
    assert struct.pack(">2H", *words[4:6]) == struct.pack(">f", 8.0)
    assert words[0] == 2 and isinstance(words[0], int)


def test_the_machine_of_urscript_knows_that_a_type_is_for_ever() -> None:
    machine = Machine(parse("global a = 1\ndef f():\n  global a = 1.5\nend\n", "urscript"), {"typed": True}, fold=False)
    machine.begin()
    with pytest.raises(TypeError, match="a is int, not float"):
        machine.start("f")


def test_the_signals_of_a_robot_enable_by_the_bit_of_the_map() -> None:
    text = render_client(MAP, "urscript", WHERE)
    (bit,) = [bit for bit, name in MAP.find("control_word").bits.items() if name == "enable"]
    assert f'modbus_set_output_register("fg_control", {1 << bit}, False)' in text


@pytest.mark.sampled
@pytest.mark.parametrize("kind", [S7, TwinCat, Codesys])
@pytest.mark.parametrize("ramp_n_per_s", [7000.0, -4000.0, 1e38])
def test_a_value_that_16_bits_cannot_hold_is_refused_instead_of_wrapped(kind: type[Plc], ramp_n_per_s: float) -> None:
    """70000 counts wrapped are 4464: a ramp of 446 N/s that nobody has asked for."""
    gateway = GatewayAtHand(MAP)
    client = kind(TEXTS["scl" if kind is S7 else "st"], gateway)
    client.enable(12.0)
    cycles(client)
    holder = client.structures[client.NAMES["command"]]
    holder["FORCE_RAMP"] = ramp_n_per_s
    cycles(client)
    assert "W204 value out of range" in client.text and client.enabled
    assert gateway.bank.command.force_ramp_n_per_s == 0.0
    holder["FORCE_RAMP"] = 3276.7
    cycles(client)
    assert gateway.words[-1][2] == 32767
