"""A request without an answer: sent once, its connection closed, for a late answer is none to the next; and told as it is."""

import os
import socket
import threading
from collections.abc import Iterator
from contextlib import suppress
from types import SimpleNamespace
from typing import Any

import pytest
from pymodbus.exceptions import ModbusIOException

from gateway.cli.errors import CliError
from gateway.cli.master import wires
from gateway.cli.master.client import Assignment, GatewayClient
from gateway.cli.master.wires import RtuWire, TcpWire
from gateway.codes.refusals import RefusalReason
from gateway.devices import SerialSettings
from gateway.ports import Pty
from gateway.registers import RegisterMap


class DeafServer(threading.Thread):
    """Takes one connection, hears everything, says nothing."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.listening = socket.create_server(("127.0.0.1", 0))
        self.heard = b""

    def run(self) -> None:
        accepted, _ = self.listening.accept()
        with accepted:
            while data := accepted.recv(4096):
                self.heard += data


@pytest.fixture
def deaf() -> Iterator[DeafServer]:
    server = DeafServer()
    server.start()
    yield server
    server.join(10)
    server.listening.close()


def test_a_write_without_an_answer_is_one_write(deaf: DeafServer, call: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A repeated one is a second one: a force that somebody has taken back meanwhile would be there again."""
    monkeypatch.setattr(wires, "TIMEOUT_S", 0.05)
    monkeypatch.setattr(GatewayClient, "check_map", lambda self: None)  # a deaf one would not come further
    port = deaf.listening.getsockname()[1]
    done = call("write", "force_setpoint=12", "--gateway", f"127.0.0.1:{port}")
    assert done.exit_code == 69 and done.stderr.startswith("E131 ")
    assert "sent without an answer, and perhaps in effect: FC16 address 1: 04B0" in done.stderr
    deaf.join(10)
    assert len(deaf.heard) == 15


def test_of_what_never_went_out_nobody_is_told_that_it_may_be_in_effect(
    call: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(GatewayClient, "check_map", lambda self: None)
    with socket.create_server(("127.0.0.1", 0)) as gone:
        port = gone.getsockname()[1]
    done = call("write", "force_setpoint=12", "--gateway", f"127.0.0.1:{port}")
    assert done.exit_code == 69 and "in effect" not in done.stderr


def test_it_is_on_a_serial_line_too(call: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wires, "TIMEOUT_S", 0.05)
    monkeypatch.setattr(GatewayClient, "check_map", lambda self: None)
    heard, line = bytearray(), Pty()
    done = call("write", "force_setpoint=12", "--rtu", line.path, "--baud", "115200")
    with suppress(OSError):  # nothing more is there
        while True:
            heard += os.read(line.fd, 4096)
    line.close()
    assert done.exit_code == 69 and len(heard) == 11


def test_a_serial_line_is_waited_for_as_long_as_the_longest_exchange_takes() -> None:
    for baud in (1200, 9600, 115200):
        assert RtuWire("/dev/ttyNONE", SerialSettings(baud=baud))._timeout_s > 2 * 256 * 11 / baud


class StubWire(TcpWire):
    """Connects to a client of ours, and notes what is asked of a silence."""

    def connect(self) -> Any:
        return StubWire.client

    def no_answer(self, unit: int, error: Exception, *, has_answered: bool) -> CliError:
        return CliError(f"silent, answered before: {has_answered}")


def test_behind_a_silence_the_connection_is_a_new_one(register_map: RegisterMap) -> None:
    closed = list[bool]()
    answers = iter([SimpleNamespace(isError=lambda: False, registers=[7])])

    def ask(address: int, **options: int) -> Any:
        if (answer := next(answers, None)) is None:
            raise ModbusIOException("no response")
        return answer

    StubWire.client = SimpleNamespace(  # type: ignore[attr-defined]
        connected=True, read_holding_registers=ask, close=lambda: closed.append(True)
    )
    with GatewayClient(StubWire("127.0.0.1", 5020), 1, register_map) as client:
        assert client.read_words(0, 1) == (7,)
        with pytest.raises(CliError, match="answered before: True"):
            client.read_words(0, 1)
        assert closed == [True]
    with (
        GatewayClient(StubWire("127.0.0.1", 5020), 1, register_map) as fresh,
        pytest.raises(CliError, match="answered before: False"),
    ):
        fresh.read_words(0, 1)


def test_behind_a_question_that_somebody_has_broken_off_the_connection_is_a_new_one(register_map: RegisterMap) -> None:
    """Its answer is still to come: on the same connection it would be taken for that of the stop behind it."""
    closed = list[bool]()

    def break_off(address: int, **options: int) -> Any:
        raise KeyboardInterrupt

    StubWire.client = SimpleNamespace(  # type: ignore[attr-defined]
        connected=True, read_holding_registers=break_off, close=lambda: closed.append(True)
    )
    client = GatewayClient(StubWire("127.0.0.1", 5020), 1, register_map)
    with pytest.raises(KeyboardInterrupt):
        client.read_words(0, 1)
    assert closed == [True]


def test_a_request_carries_no_more_words_than_modbus_allows(register_map: RegisterMap) -> None:
    client = GatewayClient(TcpWire("127.0.0.1", 5020), 1, register_map)
    arrays = [one for one in register_map.registers_of("staging") if "_b_" in one.name or "_w_" in one.name]
    frames = client.frames([Assignment(register, bytes(2 * register.words)) for register in arrays])
    assert sum(len(frame.words) for frame in frames) == sum(register.words for register in arrays) > 123
    assert all(len(frame.words) <= 123 for frame in frames)


def test_what_was_written_before_a_refusal_is_told_with_it(fake: Any, call: Any) -> None:
    """Two blocks are two requests: whoever reads of a refusal alone believes that nothing has changed."""
    fake.bank.refuse[202] = fake.bank.refuse[203] = (3, RefusalReason.OUT_OF_RANGE)
    second = next(one for one in fake.bank.register_map.registers_of("float_abcd") if one.address == 202)
    done = call("write", "force_setpoint=12", f"{second.name}@float_abcd=1", "--gateway", fake.address)
    assert done.exit_code == 1 and done.stderr.startswith("W204 ")
    assert fake.bank.writes == [(1, (1200,))]
    assert "sent before, and in effect: FC16 address 1: 04B0" in done.stderr


@pytest.mark.parametrize("count", [0, 1, 3])
def test_who_answers_more_or_fewer_registers_than_were_asked_for_is_asked_once(
    register_map: RegisterMap, count: int
) -> None:
    """Of none at all the question was asked again without end, to whatever device it was."""
    asked = list[int]()

    def ask(address: int, **options: int) -> Any:
        asked.append(address)
        return SimpleNamespace(isError=lambda: False, registers=count * [7])

    StubWire.client = SimpleNamespace(  # type: ignore[attr-defined]
        connected=True, read_holding_registers=ask, close=lambda: None
    )
    with (
        GatewayClient(StubWire("127.0.0.1", 5020), 1, register_map) as client,
        pytest.raises(CliError, match=f"E131 127.0.0.1:5020 answered {count} registers to read 2 at 0"),
    ):
        client.read_words(0, 2)
    assert asked == [0]


def test_neither_port_nor_unit_nor_network_are_to_blame_for_a_gateway_that_ends_behind_its_answers(
    fake: Any, register_map: RegisterMap
) -> None:
    """It was called no Modbus server, the TLS port, another unit id, or one with an allow-list."""
    with GatewayClient(TcpWire("127.0.0.1", fake.port), 1, register_map) as client:
        client.check_map()
        fake.stop()
        with pytest.raises(CliError) as told:
            client.check_map()
    assert str(told.value) == (
        f"E131 {fake.address} closed the connection, though it answered before: it has stopped or started anew, or the network "
        "between is cut; its log (force-gateway events on its machine) says which"
    )
