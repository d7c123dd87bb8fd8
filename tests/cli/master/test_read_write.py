"""`read` and `write` against the real TCP server: names and units out, one FC16 in, refusals in words."""

import json
import socket
import threading
from pathlib import Path
from typing import Any

import pytest

from gateway.cli.master.client import Assignment, GatewayClient
from gateway.cli.master.wires import TcpWire
from gateway.cli.options import endpoint
from gateway.codes.refusals import RefusalReason
from gateway.registers.writes.ownership import NOT_IPV4


def test_read_shows_units_names_and_bits(fake, call) -> None:
    fake.bank.set("force_measured", 12.03)
    fake.bank.set("state", 3)
    fake.bank.set("status_word", 0b1111)
    fake.bank.set("owner_ip", 0xC0A80101)
    answer = call("read", "force_measured", "state", "status_word", "owner_ip", "--gateway", fake.address)
    assert answer.exit_code == 0, answer.output
    columns = [line.split("  ") for line in answer.output.splitlines()]
    assert [[cell.strip() for cell in row if cell] for row in columns] == [
        ["force_measured", "12.03 N", "04B3"],
        ["state", "holding", "0003"],
        ["status_word", "0x000F (enabled, ready, contact, in_band)", "000F"],
        ["owner_ip", "192.168.1.1", "C0A8 0101"],
    ]


def test_a_number_that_is_not_there_is_not_a_number(fake, call) -> None:
    fake.bank.words[102] = 0x8000
    assert call("read", "force_measured", "--gateway", fake.address).output.split()[1] == "-"
    facts = json.loads(call("read", "force_measured", "--json", "--gateway", fake.address).output)
    assert facts["force_measured"]["value"] is None


@pytest.mark.parametrize("block", ["float_abcd", "float_cdab"])
def test_read_knows_both_word_orders(block: str, fake, call) -> None:
    fake.bank.set(f"force_measured@{block}", 12.5)
    facts = json.loads(call("read", f"force_measured@{block}", "--json", "--gateway", fake.address).output)
    assert facts[f"force_measured@{block}"] | {"words": []} == {
        "value": 12.5,
        "text": "12.50 N",
        "unit": "N",
        "address": 236 if block == "float_abcd" else 336,
        "words": [],
    }


def test_a_block_is_read_whole_and_in_one_request(fake, call) -> None:
    answer = call("read", "status", "--gateway", fake.address)
    assert len(answer.output.splitlines()) == len(fake.bank.register_map.registers_of("status"))
    assert [count for _, count in fake.bank.reads] == [2, 32], "the map's hash, and the block"


def test_an_unknown_name_gets_a_proposal(fake, call) -> None:
    answer = call("read", "force_mesured", "--gateway", fake.address)
    assert answer.exit_code == 2
    assert "did you mean force_measured?" in answer.stderr
    assert call("write", "force_setpiont=12", "--gateway", fake.address).exit_code == 2
    assert fake.bank.reads == []


def test_setpoint_and_enable_are_one_request_of_two_registers(fake, call) -> None:
    answer = call("write", "force_setpoint=12", "control_word=1", "--gateway", fake.address)
    assert answer.exit_code == 0, answer.output
    assert fake.bank.writes == [(0, (1, 1200))]
    assert fake.bank.reads == [(412, 2)], "map_hash, and no register of the block"


def test_registers_between_are_written_back_as_they_were(fake, call) -> None:
    fake.bank.set("force_setpoint", 7.5)
    fake.bank.set("heartbeat", 99)
    answer = call("write", "control_word=enable", "tilt_angle=-12.3", "--gateway", fake.address)
    assert fake.bank.writes == [(0, (1, 750, 0, 0, 99, 0, 65536 - 123))]
    assert "force_setpoint, force_ramp, mode, heartbeat, voltage_setpoint kept as read" in answer.output


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("control_word=enable,tare", (0, (5,))),
        ("control_word=enable+take-ownership", (0, (9,))),
        ("control_word=0x1", (0, (1,))),
        ("control_word=enable,0x1+enable", (0, (1,))),  # said thrice it is no other bit
        ("mode=voltage", (3, (1,))),
        ("mode=1", (3, (1,))),
        ("force_setpoint=12.345", (1, (1234,))),  # to the register's resolution
        ("force_setpoint@float_abcd=12", (202, (0x4140, 0x0000))),
        ("force_setpoint@float_cdab=12", (302, (0x0000, 0x4140))),
        ("byte_order_echo=1234.5", (416, (0x449A, 0x5000))),
    ],
)
def test_values_are_written_as_people_say_them(text: str, words: tuple[int, tuple[int, ...]], fake, call) -> None:
    answer = call("write", text, "--gateway", fake.address)
    assert answer.exit_code == 0, answer.output
    assert fake.bank.writes == [words]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("force_setpoint", "is not NAME=VALUE"),
        ("force_setpoint=twelve", "twelve is not a number in N"),
        ("force_setpoint=12,5", "decimals take a point: 12.5"),
        ("force_setpoint=12.5 N", "12.5 N is not a number in N; without its unit: 12.5"),
        ("force_setpoint=12,5N", "without its unit, decimals with a point: 12.5"),
        ("force_setpoint=", "nothing is not a number in N"),
        ("force_measured=1", "force_measured is read only"),
        ("mode=volts", "did you mean voltage?"),
        ("control_word=enabel", "did you mean enable?"),
        ("control_word=1.5", "control_word = 1.5 is not a whole number"),
        ("mode=0.6", "mode = 0.6 is not a whole number"),
        ("heartbeat=0.5", "heartbeat = 0.5 is not a whole number"),
        ("force_setpoint=5000", "force_setpoint: 5000 N: allowed 0 .. 327.67 N"),
    ],
)
def test_what_cannot_be_meant_is_a_usage_error_and_sends_nothing(text: str, sentence: str, fake, call) -> None:
    answer = call("write", text, "--gateway", fake.address)
    assert answer.exit_code == 2
    assert sentence in answer.stderr
    assert (fake.bank.reads, fake.bank.writes) == ([], [])


def test_a_register_given_twice_is_a_usage_error(fake, call) -> None:
    answer = call("write", "force_setpoint=1", "force_setpoint=2", "--gateway", fake.address)
    assert answer.exit_code == 2
    assert "given twice" in answer.stderr


def test_a_dry_run_writes_nothing_and_says_what_it_would(fake, call) -> None:
    answer = call("write", "force_setpoint=12", "control_word=1", "--dry-run", "--gateway", fake.address)
    assert "would send FC16 address 0: 0001 04B0" in answer.output
    assert fake.bank.writes == []
    document = json.loads(call("write", "mode=force", "--dry-run", "--json", "--gateway", fake.address).output)
    assert document == {"sent": False, "frames": [{"address": 3, "words": [0], "kept": []}]}


def test_a_read_only_register_between_splits_the_request(fake, call) -> None:
    call("write", "commit=1", "slot_select=2", "--gateway", fake.address)
    assert fake.bank.writes == [(1145, (1,)), (1149, (2,))]


@pytest.mark.parametrize(
    ("reason", "exception", "code"),
    [
        (RefusalReason.OUT_OF_RANGE, 3, "W204"),
        (RefusalReason.WORDS_SWAPPED, 3, "W201"),
        (RefusalReason.NOT_OWNER, 6, "W210"),
        (RefusalReason.CELL_SILENT, 0x0B, "W215"),
    ],
)
def test_a_refusal_is_told_in_words_with_its_code(reason: RefusalReason, exception: int, code: str, fake, call) -> None:
    fake.bank.refuse[1] = (exception, reason)
    answer = call("write", "force_setpoint=65", "control_word=1", "--gateway", fake.address)
    assert answer.exit_code == 1
    assert answer.stderr.startswith(f"{code} ")
    assert f"exception {exception:02X}" in answer.stderr
    assert "force_setpoint = 65 N (address 1)" in answer.stderr
    assert reason.name.lower().replace("_", " ") in answer.stderr
    assert f"force-gateway explain {code}" in answer.stderr


def test_an_old_refusal_of_another_register_is_not_blamed(fake, call) -> None:
    fake.bank.set("refusal_address", 4)
    fake.bank.set("refusal_reason", RefusalReason.NOT_OWNER)
    del fake.bank.words[118 + 1]
    fake.bank.refuse[1] = (3, RefusalReason.NONE)
    answer = call("write", "force_setpoint=65", "--gateway", fake.address)
    assert answer.exit_code == 1
    assert answer.stderr == "exception 03 (value refused) to write 1 at 1\n"


def test_no_gateway_is_told_with_its_address(call) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{taken.getsockname()[1]}"  # bound, not listening: refused
        answer = call("read", "state", "--gateway", address)
    assert answer.exit_code == 69
    assert answer.stderr.startswith(f"E130 no gateway at {address}: Connection refused")


def test_who_finds_no_gateway_is_told_of_those_that_run_on_other_ports(call, monkeypatch, tmp_path: Path) -> None:
    """`run --bind :0` in one terminal, `hold 12` in another: "start one" was the answer, beside one that ran."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    said = {"cell-a": {"rig": "cell-a", "port": 40537}, "cell-b": {"rig": "cell-b", "port": None}}
    for name in said:
        (tmp_path / "force-gateway" / name).mkdir(parents=True)
        (tmp_path / "force-gateway" / name / "control.sock").touch()
    monkeypatch.setattr("gateway.cli.control_socket.ask", lambda state, request: said[state.name])
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        answer = call("read", "state", "--gateway", f"127.0.0.1:{taken.getsockname()[1]}")
    assert answer.exit_code == 69
    assert answer.stderr.endswith("or give --gateway HOST:PORT; here runs cell-a on port 40537\n")
    assert "here run" not in call("read", "state", "--gateway", "robot.invalid:5020").stderr


def test_a_host_that_does_not_exist_is_told(call, monkeypatch) -> None:
    def unknown(*arguments: object) -> None:
        raise socket.gaierror(-2, "Name or service not known")

    monkeypatch.setattr(socket, "create_connection", unknown)
    answer = call("read", "state", "--gateway", "robto:5020")
    assert answer.exit_code == 69
    assert "no such host name" in answer.stderr


@pytest.mark.parametrize("host", ["cell..3", "c" * 64], ids=["empty part", "long part"])
def test_a_host_that_no_name_can_be_is_none_that_exists(host: str, call) -> None:
    answer = call("read", "state", "--gateway", f"{host}:5020")
    assert answer.exit_code == 69
    assert answer.stderr.startswith(f"E130 no gateway at {host}:5020: no such host name")


def test_a_server_that_hangs_up_is_no_gateway(call) -> None:
    """Somebody who accepts and closes at once, as a gateway does for who is not on its allow-list."""
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def hang_up() -> None:
            connection, _ = listener.accept()
            connection.recv(12)
            connection.close()

        thread = threading.Thread(target=hang_up)
        thread.start()
        answer = call("read", "state", "--gateway", f"127.0.0.1:{listener.getsockname()[1]}")
        thread.join(10)
    assert answer.exit_code == 69
    assert answer.stderr.startswith("E131 ")
    assert "allow-list" in answer.stderr


@pytest.mark.parametrize("words", [("read", "state"), ("write", "control_word=1"), ("hold", "12"), ("upload", "demo")])
def test_a_foreign_unit_is_an_exception_and_not_a_timeout_or_another_map(words: tuple[str, ...], fake, call) -> None:
    """And told as one: that a read of 2 at 412 met a silent unit says nothing of --unit."""
    answer = call(*words, "--unit", "7", "--gateway", fake.address)
    assert answer.exit_code == 1
    assert answer.stderr.startswith("W222 unit id not served: exception 0B")
    assert "Use unit id 1" in answer.stderr


def test_more_registers_than_one_request_carries_are_read_in_several(fake) -> None:
    fake.bank.words |= {1500 + at: at for at in range(200)}
    with GatewayClient(TcpWire("127.0.0.1", fake.port), 1, fake.bank.register_map) as client:
        assert client.read_words(1500, 200) == tuple(range(200))
    assert fake.bank.reads == [(1500, 125), (1625, 75)]


def test_values_written_by_a_program_travel_the_same_way(fake) -> None:
    with GatewayClient(TcpWire("127.0.0.1", fake.port), 1, fake.bank.register_map) as client:
        wanted = {"force_setpoint": 12.0, "control_word": 1, "byte_order_echo": 1234.5}
        registers = [fake.bank.register_map.find(name) for name in wanted]
        client.write_values([Assignment(register, register.encode(wanted[register.name])) for register in registers])
        assert [reading.value for reading in client.read_values(registers)] == list(wanted.values())
    assert fake.bank.writes == [(0, (1, 1200)), (416, (0x449A, 0x5000))]


def test_an_owner_without_an_ipv4_address_is_told_as_such(fake, call) -> None:
    """The page, say, or a master by IPv6: 255.255.255.255 is nobody's address."""
    fake.bank.set("owner_ip", NOT_IPV4)
    answer = call("read", "owner_ip", "--gateway", fake.address)
    assert "somebody without an IPv4 address" in answer.output and "255.255" not in answer.output


@pytest.mark.parametrize("given", ["::1", "[::1]", "[::1]:5020"])
def test_an_ipv6_address_is_told_as_it_is_given(given: str) -> None:
    """'no gateway at ::1:5020' named another address: so it was asked for where it was pasted."""
    context: Any = None
    asked = endpoint(context, context, given)
    assert asked and TcpWire(*asked).where == "[::1]:5020"
