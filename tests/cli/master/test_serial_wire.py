"""The client verbs over Modbus RTU: the same answers, the options of a line, and what is told when it stays silent."""

import os
import select
import threading

import pytest

from gateway.cli.master import wires
from gateway.cli.master.client import Frame, GatewayClient, RefusedError
from gateway.cli.master.wires import RtuWire
from gateway.codes.refusals import RefusalReason
from gateway.devices import SerialSettings
from gateway.devices.line_settings import Parity
from gateway.modbus.rtu import encode_adu
from gateway.ports import Pty


def line_of(fake) -> tuple[str, ...]:
    return ("--rtu", fake.serial_path, "--baud", "115200", "--unit", "3")


def test_read_and_write_speak_rtu(fake, call) -> None:
    fake.bank.set("force_measured", 12.03)
    fake.bank.set("owner_ip", 1)
    answer = call("read", "force_measured", "owner_ip", *line_of(fake))
    assert answer.exit_code == 0, answer.output
    assert [row.split()[:2] for row in answer.output.splitlines()] == [
        ["force_measured", "12.03"],
        ["owner_ip", "serial:1"],
    ]
    written = call("write", "force_setpoint=12", "control_word=enable", *line_of(fake))
    assert written.exit_code == 0, written.output
    assert fake.bank.writes == [(0, (1, 1200))]


def test_a_refusal_is_told_in_words(fake, call) -> None:
    fake.bank.refuse[1] = (3, RefusalReason.OUT_OF_RANGE)
    answer = call("write", "force_setpoint=65", *line_of(fake))
    assert answer.exit_code == 1 and "force_setpoint = 65 N (address 1)" in answer.stderr


def test_monitor_shows_the_port(fake, call) -> None:
    answer = call("monitor", "--once", *line_of(fake))
    assert answer.exit_code == 0 and fake.serial_path in answer.output


def test_silence_names_the_settings_that_may_be_wrong(fake, call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wires, "TIMEOUT_S", 0.05)
    answer = call("read", "state", "--rtu", fake.serial_path, "--baud", "115200", "--unit", "4")
    assert answer.exit_code == 69
    assert answer.stderr.startswith(f"E123 {fake.serial_path}: no answer within")
    assert "115200 8E1 and unit 4" in answer.stderr


def test_a_port_that_is_not_there_is_told(call) -> None:
    answer = call("read", "state", "--rtu", "/dev/no-such-port")
    assert answer.exit_code == 69 and answer.stderr.startswith("E102 /dev/no-such-port is not there")


def test_a_port_that_somebody_has_is_told(fake, call) -> None:
    client = RtuWire(fake.serial_path, SerialSettings(baud=115200)).connect()
    try:
        answer = call("read", "state", *line_of(fake))
        assert answer.exit_code == 69 and answer.stderr.startswith(f"E103 {fake.serial_path} is held by")
    finally:
        client.close()  # type: ignore[no-untyped-call]


def test_a_port_that_is_pulled_out_is_told(register_map) -> None:
    line = Pty()
    with GatewayClient(RtuWire(line.path, SerialSettings(baud=115200)), 3, register_map) as client:
        client._connect()
        line.close()
        with pytest.raises(wires.CliError, match=r"^E102 "):
            client.read_words(0, 1)


READ_ONE, WRITE_BEAT, WRITE_OURS = bytes.fromhex("0302 0007"), bytes.fromhex("1000040001"), bytes.fromhex("1000000001")


@pytest.mark.parametrize(
    ("is_write", "pdu"),
    [(True, READ_ONE), (True, WRITE_BEAT), (False, WRITE_OURS), (False, READ_ONE), (False, b"\x90\x03")],
)
def test_an_answer_to_another_request_is_none(register_map, is_write: bool, pdu: bytes) -> None:
    """A second master's, or one that came late. A stop that nobody had heard was told as written."""
    line = Pty()
    with GatewayClient(RtuWire(line.path, SerialSettings(baud=115200)), 1, register_map) as client:
        other = threading.Thread(target=answer_once, args=(line.fd, pdu))
        other.start()
        with pytest.raises(wires.SilentLineError, match=r"^E123 .* the answer to another request: do two masters"):
            client.write(Frame(0, (0,))) if is_write else client.read_words(0, 2)
        assert client.is_unanswered
        other.join(10)
    line.close()


@pytest.mark.parametrize(("pdu", "code"), [(WRITE_OURS, 0), (b"\x90\x06", 6)])
def test_the_answer_to_ours_is_one(register_map, pdu: bytes, code: int) -> None:
    line = Pty()
    with GatewayClient(RtuWire(line.path, SerialSettings(baud=115200)), 1, register_map) as client:
        other = threading.Thread(target=answer_once, args=(line.fd, pdu))
        other.start()
        if code:
            with pytest.raises(RefusedError, match="exception 06"):
                client.write(Frame(0, (0,)))
        else:
            client.write(Frame(0, (0,)))
        assert not client.is_unanswered
        other.join(10)
    line.close()


def answer_once(line: int, pdu: bytes) -> None:
    """Answer what comes first on a line with this, as unit 1."""
    if select.select([line], [], [], 10.0)[0]:
        os.write(line, encode_adu(1, pdu))


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--rtu", "/dev/ttyS9", "--unit", "0"), "0 is the broadcast, which nobody answers"),
        (("--rtu", "/dev/ttyS9", "--unit", "248"), "248 is reserved"),
        (("--rtu", "/dev/ttyS9", "--baud", "19201"), "19201 is no speed of serial lines; did you mean 19200?"),
        (("--rtu", "/dev/ttyS9", "--baud", "0"), "0 is no speed of serial lines; did you mean 300?"),
        (("--rtu", "/dev/ttyS9", "--parity", "evn"), "'evn' is not one of 'none', 'even', 'odd'"),
        (("--rtu", "ttyUSB0"), "ttyUSB0 is not the path of a port"),
        (("--rtu", "/dev/ttyS9", "--gateway", "10.0.0.1"), "give one of them"),
        (("--stop-bits", "2"), "--stop-bits is of a serial line: give --rtu PORT too"),
    ],
)
def test_options_that_cannot_be_meant_are_told(call, options: tuple[str, ...], told: str) -> None:
    for verb in (("read", "state"), ("write", "mode=0"), ("calibrate", "--yes")):
        answer = call(*verb, *options)
        assert answer.exit_code == 2 and told in answer.stderr, answer.output


def test_a_rig_in_the_place_of_a_port_is_told(call) -> None:
    answer = call("run", "--rtu", "demo")
    assert answer.exit_code == 2
    assert "demo is not the path of a port such as /dev/serial/by-id/...; RIG goes before --rtu" in " ".join(
        answer.stderr.split()
    )


def test_the_words_for_parity_are_those_of_a_rig_file() -> None:
    from typing import get_args

    from gateway.cli import options

    assert get_args(Parity) == options._PARITIES
