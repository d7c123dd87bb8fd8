"""Any bytes that a master may send: framing and bank do what references say that share no code with them."""

import struct
from collections.abc import Callable
from random import Random

from gateway.modbus import server
from gateway.modbus.fast import whole_answer
from gateway.modbus.rtu_receiver import MOST_BYTES
from tests.fuzz.conftest import PER_PUSH, Examples
from tests.fuzz.damage import damaged, held_bytes, pieces
from tests.fuzz.frame_model import crc
from tests.fuzz.modbus_laws import PEERS, assert_answered_as_model, assert_read_as_reference, bank_and_model
from tests.modbus.rtu_bus import SILENCE_S, Bus

PLACES = (0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 10, 13, 15, 16, 99, 100, 116, 131, 200, 200, 201, 202, 210, 226, 230, 232, 295,
          300, 300, 302, 310, 331, 400, 416, 416, 417, 431, 432, 999, 1000, 1145, 1199, 1500, 1699, 40001, 65535)  # fmt: skip
WORDS = (
    0,
    0,
    0,
    0,
    1,
    1,
    1,
    2,
    3,
    4,
    8,
    9,
    16,
    32,
    127,
    1200,
    6000,
    6001,
    0x4140,
    0x7FC0,
    0x8000,
    0xFFFF,
    0x449A,
    0x5000,
)
FLOATS = (
    0.0,
    0.0,
    0.0,
    1.0,
    1.0,
    12.0,
    59.99,
    60.0,
    60.01,
    -1.0,
    0.5,
    9.0,
    1e-4,
    2.34e-41,
    1234.5,
    float("nan"),
    float("inf"),
)


def test_the_examples_of_a_push_are_two_hundred_thousand() -> None:
    assert sum(PER_PUSH.values()) >= 200_000


# -- MBAP


def test_a_stream_of_anything_is_read_as_the_reference_reads_it(examples: Callable[..., Examples]) -> None:
    count, chance = examples("MBAP streams")
    lost_ones = 0
    while count > 0:
        sent = [
            struct.pack(">HHHB", k, 0, k % 9 + 2, 1) + chance.randbytes(k % 9 + 1) for k in range(chance.randint(1, 9))
        ]
        stream = damaged(b"".join(sent), chance) if chance.random() < 0.7 else b"".join(sent)
        count -= len(sent)
        lost_ones += assert_read_as_reference(pieces(stream, chance))
    assert lost_ones > 100


# -- the bank


def request(chance: Random) -> bytes:
    """A request PDU: most of them well made, some not at all."""
    function = chance.choice((1, 2, 3, 4, 5, 6, 6, 15, 16, 16, 16, 16, 22, 23, 23))
    address, way = chance.choice(PLACES), chance.random()
    if way < 0.03:
        return chance.randbytes(chance.randint(1, 30))
    if function <= 4:
        pdu = struct.pack(">BHH", function, address, chance.choice((1, 2, 13, 16, 32, 96, 125, 126, 2000, 2001, 0)))
    elif function == 5:
        pdu = struct.pack(
            ">BHH", 5, chance.choice((0, 1, 2, 3, 3, 5, 15, 16, 100)), chance.choice((0, 0xFF00, 0xFF00, 1))
        )
    elif function == 6:
        pdu = struct.pack(">BHH", 6, address, chance.choice(WORDS))
    elif function == 15:
        bits = chance.choice((1, 2, 4, 7, 16, 17))
        pdu = struct.pack(">BHHB", 15, chance.choice((0, 0, 1, 3, 100)), bits, (bits + 7) // 8)
        pdu += bytes(chance.choice((0, 1, 1, 3, 9, 16, 255)) for _ in range((bits + 7) // 8))
    elif function == 22:
        pdu = struct.pack(">BHHH", 22, address, chance.choice((0, 0xFFFF, 0xFFFE)), chance.choice(WORDS))
    else:
        data = payload(chance, address)
        head = struct.pack(">HH", chance.choice(PLACES), chance.choice((1, 13, 32, 126))) if function == 23 else b""
        pdu = bytes((function,)) + head + struct.pack(">HHB", address, len(data) // 2, len(data)) + data
    return damaged(pdu, chance, 1) or b"\0" if way < 0.08 else pdu


def payload(chance: Random, address: int) -> bytes:
    if chance.random() < 0.6 and 200 <= address < 420:
        numbers = [chance.choice(FLOATS) for _ in range(chance.choice((1, 1, 2, 2, 5, 13, 16)))]
        packed = [struct.pack(">f", one) for one in numbers]
        return b"".join(one if address < 300 or address > 400 else one[2:] + one[:2] for one in packed)
    return struct.pack(">H", chance.choice(WORDS)) + b"".join(
        struct.pack(">H", chance.choice(WORDS)) for _ in range(chance.choice((0, 0, 1, 1, 2, 3)))
    ) + bytes(2 * chance.choice((0, 0, 0, 5, 10)))  # fmt: skip


def test_the_bank_answers_any_request_as_the_reference_does(examples: Callable[..., Examples]) -> None:
    count, chance = examples("bank requests")
    codes = [0] * 256
    bank, model = bank_and_model()
    for _ in range(count):
        pdu, peer = request(chance), PEERS[chance.choice((0, 0, 0, 0, 1, 2))]
        codes[assert_answered_as_model(bank, model, pdu, peer)] += 1
    assert held_bytes(bank) < 80_000
    assert all(codes[code] > count // 1000 for code in (0, 1, 2, 3, 6)), codes[:12]


def test_the_short_way_answers_as_the_long_one() -> None:
    chance = Random(3)
    (one, _), (two, _) = bank_and_model(), bank_and_model()
    for k in range(1500):
        pdu = request(chance)[:253]
        fast = whole_answer(struct.pack(">HHHB", k, 0, len(pdu) + 1, 1) + pdu, (1,), one, PEERS[0])
        assert fast is not None and fast[7:] == server.answer(pdu, two, PEERS[0])


# -- RTU


def test_noise_on_a_bus_makes_no_request_and_costs_none(examples: Callable[..., Examples]) -> None:
    """Whatever is heard was on the wire with its checksum; and behind a silence the next request is heard."""
    count, chance = examples("RTU bursts")
    bus = Bus()
    for number in range(count):
        pdu = struct.pack(">BHH", chance.choice((3, 4, 6)), chance.randrange(132), chance.randint(1, 100))
        ours = bytes((1,)) + pdu
        ours += crc(ours)
        burst = damaged(ours, chance) if chance.random() < 0.6 else chance.randbytes(chance.choice((1, 7, 40, 600)))
        for piece in pieces(burst, chance):
            bus.send(piece, pause_s=chance.choice((0.0, 0.0, 0.5 * SILENCE_S)))
            assert held_bytes(bus.receiver) < 2 * MOST_BYTES
        for heard in bus.requests():
            frame = bytes((heard.unit,)) + heard.pdu
            assert frame + crc(frame) in burst, f"{number}: {burst.hex()} was heard as {heard}"
        assert pdu in [heard.pdu for heard in bus.send(ours).requests()], f"{number}: after {burst.hex()}"
