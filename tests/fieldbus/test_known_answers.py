"""What a read was answered is used again as long as no register has changed: nobody may read what was before."""

from collections.abc import Callable
from random import Random
from struct import pack
from typing import Any

import pytest

from gateway.fieldbus.connection import Connection, ServerState
from gateway.fieldbus.peers import Peers
from gateway.fieldbus.rate_limits import LogLimiter
from gateway.fieldbus.settings import ServerSettings
from gateway.modbus import Role, answer, pdu
from gateway.profiles import load_register_map
from gateway.registers import BankRules, RegisterBank, Status
from gateway.registers.words import ControlBit, SelfTestResult, State
from tests.fieldbus.by_hand import READ, READ_ANSWER, framed
from tests.fieldbus.conftest import HandClock, HandTransport

PLACES = ((0, 16), (100, 32), (200, 26), (300, 26), (400, 32), (1000, 100), (1100, 60), (1500, 10), (7, 1), (118, 4))
WORDS = (0, 0, 0, 1, 1, 8, 9, 12, 600, 0x449A, 0x5000, 0xFFFF)


def real_bank() -> RegisterBank:
    rules = BankRules(rig_name="demo", force_max_n=60.0, supported_bits=ControlBit(15))
    return RegisterBank(load_register_map("force-v1"), rules, now=lambda: 1.0)


def write(chance: Random) -> bytes:
    address, count = chance.choice(PLACES)[0], chance.choice((1, 2, 5))
    words = [chance.choice(WORDS) for _ in range(count)]
    kind = chance.randrange(5)
    if kind == 0:
        return pdu.write_register_request(address, words[0])
    if kind == 1:
        return pdu.mask_write_request(address, chance.choice((0, 0xFFFF)), words[0])
    if kind == 2:
        return pack(">BHH", 5, chance.randrange(8), chance.choice((0, 0xFF00)))
    data = pack(f">{count}H", *words)
    return pdu.write_registers_request(address, data) if kind == 3 else pdu.read_write_request(0, 3, address, data)


def change(chance: Random) -> Callable[[RegisterBank], object]:
    """What changes registers beside masters."""
    status = Status(state=chance.choice((State.OFF, State.HOLDING)), force_measured_n=chance.random())
    number = chance.randrange(4)
    return chance.choice(
        (
            lambda bank: bank.publish(status),
            lambda bank: bank.publish_when_read(status.state, lambda: status),
            lambda bank: bank.clear_command(),
            lambda bank: bank.release_owner(),
            lambda bank: bank.show_watchdogs(number),
            lambda bank: bank.self_test.show(number, SelfTestResult(1), {}),
        )
    )


@pytest.mark.parametrize("seed", range(4))
def test_a_read_is_answered_as_of_now_whatever_has_changed(seed: int) -> None:
    chance, settings, clock = Random(seed), ServerSettings(role=Role.CALIBRATION), HandClock()
    bank, twin, hits = real_bank(), real_bank(), 0
    shared = ServerState(bank, settings, clock, LogLimiter(print), Peers(settings, guarded=False), print)
    ends = []
    for host in ("127.0.0.1", "127.0.0.2"):
        connection, far = Connection(shared), HandTransport(host)
        far.connection = connection
        connection.connection_made(far)  # type: ignore[arg-type]
        ends.append((connection, far))
    for number in range(3000):
        if chance.random() < 0.1:
            act = change(chance)
            act(bank), act(twin)
        request = write(chance) if chance.random() < 0.1 else pdu.read_request(3, *chance.choice(PLACES))
        connection, far = chance.choice(ends)
        hits += framed(request)[2:] in bank.known_answers
        connection.data_received(framed(request, number))
        assert far.written == framed(answer(request, twin, connection.peer), number), (number, request.hex())
        far.written.clear()
    assert hits > 500


def test_who_is_counted_is_counted_for_what_is_known_as_well(stand: Any, deliver: Any) -> None:
    made = stand(requests_per_s=4.0)
    near, _ = made.connect("127.0.0.1")
    deliver(near, _, framed(READ))
    limited, far = made.connect("192.0.2.7")
    for number in range(4):
        deliver(limited, far, framed(READ, number))
    assert far.written == framed(READ_ANSWER, 0) and not far.reading


@pytest.mark.parametrize("host", ["127.0.0.1", "192.0.2.7"])
def test_the_rest_of_a_request_that_looks_like_a_whole_one_is_none(host: str, stand: Any, deliver: Any) -> None:
    made = stand()
    connection, far = made.connect(host)
    deliver(connection, far, framed(READ))
    far.written.clear()
    request = framed(pdu.write_registers_request(10, framed(READ)), 1)
    deliver(connection, far, request[: -len(framed(READ))])
    deliver(connection, far, framed(READ))
    assert far.written == framed(pack(">BHH", 16, 10, len(framed(READ)) // 2), 1)


def test_what_is_known_is_no_answer_behind_the_end_of_a_connection(stand: Any, deliver: Any) -> None:
    made = stand()
    connection, far = made.connect(stuck=True)
    deliver(connection, far, framed(READ))
    connection.close()
    far.reading, before = True, bytes(far.written)
    deliver(connection, far, framed(READ))
    assert far.written == before


def test_who_reads_everything_leaves_little_behind(stand: Any, deliver: Any) -> None:
    made = stand()
    connection, far = made.connect()
    for address in range(199):
        deliver(connection, far, framed(pdu.read_request(3, address, 1)))
    assert 0 < len(made.bank.known_answers) <= 64 and far.writes == 199
