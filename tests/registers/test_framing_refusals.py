"""What the framing refuses leaves its reason in registers and log like every other refusal, and changes nothing else."""

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.modbus import Peer, answer
from gateway.modbus.server import refuse_unit
from gateway.registers import RegisterBank
from gateway.registers.command import Status
from gateway.registers.refusal import NO_ADDRESS
from gateway.registers.words import StatusBit

MASTER = Peer("10.0.0.5", 40001)


def last_refusal(bank: RegisterBank) -> tuple[int, int, bytes]:
    """refusal_address, refusal_reason, and the two words of refusal_value."""
    words = bank.read_registers(118, 4)
    return int.from_bytes(words[:2], "big"), int.from_bytes(words[2:4], "big"), words[4:]


CASES = [
    ("03 0000 007e", 3, RefusalReason.QUANTITY, 0, "W220 quantity 126, allowed 1 .. 125 at address 0", "42fc0000"),
    ("10 0001 0001 03 000100", 3, RefusalReason.QUANTITY, 1, "W220 byte count 3, expected 2 at address 1", "40400000"),
    ("05 0000 1234", 3, RefusalReason.OUT_OF_RANGE, 0, "W223 coil value 0x1234, allowed 0x0000 and 0xFF00", "4591a000"),
    ("17 0064 0001 00", 3, RefusalReason.QUANTITY, 100, "W220 function 23 with 6 bytes, a read/write has", "40c00000"),
    ("16 0002 0000", 3, RefusalReason.QUANTITY, 2, "W220 function 22 with 5 bytes, a mask write has 7", "40a00000"),
    ("07", 1, RefusalReason.FUNCTION, NO_ADDRESS, "W221 function 7 is not served", "40e00000"),
    ("2b 0e 04 63", 2, RefusalReason.ADDRESS, NO_ADDRESS, "W224 no identification object 99", "42c60000"),
]


@pytest.mark.parametrize(("request_hex", "exception", "reason", "address", "sentence", "value_hex"), CASES)
def test_the_reason_is_in_the_registers_and_in_the_log(
    request_hex: str, exception: int, reason: RefusalReason, address: int, sentence: str, value_hex: str, bank
) -> None:
    said: list[tuple[str, Peer]] = []
    bank.on_refusal = lambda refusal, peer: said.append((refusal.sentence, peer))
    command, owner = bank.read_registers(0, 13), bank.owner
    request = bytes.fromhex(request_hex)
    assert answer(request, bank, MASTER) == bytes((request[0] | 0x80, exception))
    assert last_refusal(bank) == (address, reason, bytes.fromhex(value_hex))
    assert len(said) == 1 and said[0][0].startswith(sentence) and said[0][1] == MASTER
    assert (bank.read_registers(0, 13), bank.owner) == (command, owner)


@pytest.mark.parametrize(
    "request_hex", ["03 2710 0001", "04 0064 007d", "01 0020 0001", "17 2710 0001 0000 0001 02 0000"]
)
def test_a_refused_read_names_who_asked(request_hex: str, bank: RegisterBank) -> None:
    said: list[Peer] = []
    bank.on_refusal = lambda refusal, peer: said.append(peer)
    assert answer(bytes.fromhex(request_hex), bank, MASTER)[1] == 2
    assert said == [MASTER]


def test_a_foreign_unit_is_reason_40(bank: RegisterBank) -> None:
    said: list[str] = []
    bank.on_refusal = lambda refusal, peer: said.append(refusal.sentence)
    assert refuse_unit((9, bytes.fromhex("0600010064")), (0, 1, 255), bank, MASTER) == bytes.fromhex("86 0b")
    assert last_refusal(bank)[:2] == (1, 40)
    assert said == ["W222 unit id 9, served here: 0, 1, 255 at address 1"]


def test_the_server_id_says_who_it_is_and_whether_a_fault_stands(bank: RegisterBank) -> None:
    running = answer(b"\x11", bank, MASTER)
    assert running[2:4] == b"F\xff" and running[-1] == 0xFF
    assert running[4:-1].startswith(b"force-gateway ")
    for word, run in ((StatusBit.FAULT, b"F\x00"), (StatusBit(0), b"F\xff")):
        bank.publish(Status(status_word=int(word)))  # of now, although nobody has read a register since
        assert answer(b"\x11", bank, MASTER)[2:4] == run


@pytest.mark.parametrize(
    ("request_hex", "is_refused_write"), [("03 0000 007e", False), ("10 0001 0001 03 000100", True)]
)
def test_what_the_owner_may_not_read_is_no_refused_write_of_it(
    bank: RegisterBank, request_hex, is_refused_write
) -> None:
    """A master that is lost right behind one is told of it, and not of its heartbeat alone."""
    bank.write_registers(0, bytes.fromhex("0001 0064"), MASTER)
    answer(bytes.fromhex(request_hex), bank, MASTER)
    assert bool(bank.owner_refused) is is_refused_write
