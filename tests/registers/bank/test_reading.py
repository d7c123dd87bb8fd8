"""Reads: slices of blocks, and 02 with a reason for everything else."""

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.modbus import ModbusError, answer
from gateway.registers import Refusal


def test_reserved_words_inside_a_block_read_zero(bank):
    assert bank.read_registers(13, 3) == bytes(6)
    assert bank.read_registers(130, 2) == bytes(4)


def test_proof_constants_read_as_documented(bank, register_map):
    assert bank.read_registers(400, 1) == bytes.fromhex("1234")
    assert bank.read_registers(402, 8) == bytes.fromhex("12345678 56781234 449A5000 5000449A")
    assert bank.read_registers(410, 2) == bytes.fromhex("0002 4647")
    assert bank.read_registers(412, 2) == register_map.map_hash.to_bytes(4, "big")


@pytest.mark.parametrize(("address", "count"), [(0, 16), (15, 1), (100, 32), (200, 96), (400, 32), (1100, 100)])
def test_a_range_inside_one_block_is_read(bank, address, count):
    assert len(bank.read_registers(address, count)) == 2 * count


WRONG = [
    (0, 18, "W202 addresses 0 .. 17 are not in one block"),
    (0, 17, "W203 addresses 0 .. 16 ends one past its block"),
    (1, 16, "W203"),
    (16, 1, "W203"),
    (99, 2, "W203 addresses 99 .. 100 begins one before its block"),
    (131, 2, "W203"),
    (50, 1, "W202 address 50"),
    (432, 1, "W203"),
    (500, 2, "W202"),
    (2000, 1, "W202"),
    (65535, 1, "W203 address 65535 is what register 0 becomes"),
    (40001, 2, "W202 40001 is the name of address 0"),
    (40102, 2, "W202 40102 is the name of address 101"),
    (49999, 1, "W202 49999 is the name of address 9998"),
    (30001, 1, "W202 30001 is the name of address 0"),
    (40000, 1, "W202 address 40000: 40001 is the name of address 0"),
]


@pytest.mark.parametrize(("address", "count", "sentence"), WRONG)
def test_a_range_that_no_block_holds_is_02_with_a_reason(bank, address, count, sentence):
    told = []
    bank.on_refusal = lambda refusal, peer: told.append(refusal.sentence)
    for read in (bank.read_registers, bank.check_registers_readable):
        with pytest.raises(Refusal) as caught:
            read(address, count)
        assert caught.value.code == 2
        assert caught.value.sentence.startswith(sentence)
    assert told == [caught.value.sentence] * 2


def test_a_request_that_writes_and_may_not_read_is_a_write_that_is_refused(bank, master):
    """Of an FC23 nothing is written then: its owner is told so when its heartbeat is missed, and the audit notes it."""
    noted = []
    bank.on_refused_write = lambda refusal, peer: noted.append((refusal.sentence, peer))
    master.write(0, 1, 1200)
    with pytest.raises(Refusal) as caught:
        bank.check_registers_readable(999, 1, master.peer)
    assert noted == [(caught.value.sentence, master.peer)] and bank.owner_refused == caught.value.sentence


def test_a_refused_read_is_readable_in_the_registers(bank, master):
    with pytest.raises(ModbusError):
        bank.read_registers(40001, 1)
    assert (master.word(118), master.word(119)) == (40001, RefusalReason.ADDRESS)


def test_coils_are_the_bits_of_both_words(bank, master):
    master.write(0, 1)
    assert bank.read_bits(0, 16) == b"\x01\x00"
    assert bank.read_bits(0, 1) == b"\x01"
    assert bank.read_bits(100, 16) == bank.read_registers(100, 1)[::-1]


@pytest.mark.parametrize(("address", "count"), [(0, 17), (15, 2), (16, 1), (99, 2), (116, 1), (100, 17), (200, 1)])
def test_bits_lie_within_one_of_the_two_words(bank, address, count):
    with pytest.raises(Refusal) as caught:
        bank.read_bits(address, count)
    assert caught.value.code == 2


def test_the_identification_names_map_and_rig(bank, make_bank):
    assert bank.identity[0] == b"force-gateway"
    assert (bank.identity[5], bank.identity[6]) == (b"force-v1", b"demo")
    assert make_bank(rig_name="süd-7").identity[6] == b"s?d-7", "it is ASCII, as long as the name"


def test_a_whole_request_goes_through_the_server_core(bank, master):
    assert answer(bytes.fromhex("10 0000 0002 04 0001 04B0"), bank, master.peer) == bytes.fromhex("10 0000 0002")
    assert answer(bytes.fromhex("03 0000 0002"), bank, master.peer) == bytes.fromhex("03 04 0001 04B0")
    assert answer(bytes.fromhex("06 0001 1964"), bank, master.peer) == bytes.fromhex("86 03")
    assert answer(bytes.fromhex("17 0064 0001 03E9 0001 02 0000"), bank, master.peer) == bytes.fromhex("97 01")
