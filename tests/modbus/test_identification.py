"""FC43/14: categories, one object, and identities longer than one answer."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.modbus import ModbusError
from gateway.modbus.identification import (
    BASIC,
    EXTENDED,
    INDIVIDUAL,
    REGULAR,
    identification_answer,
)
from tests.modbus.host_answers import identification_request, parse_identification

SHORT = {0: b"Company", 1: b"Product", 2: b"V2.11"}


def walked(identity: dict[int, bytes], code: int) -> dict[int, bytes]:
    """Everything a host gets that follows "more follows" to its end."""
    found: dict[int, bytes] = {}
    following: int | None = 0
    while following is not None:
        reply = identification_answer(identification_request(code, following), identity)
        assert len(reply) <= 253
        objects, following = parse_identification(reply[1:])
        assert objects
        found |= objects
    return found


def test_the_basic_identity_is_laid_out_as_the_specification_says() -> None:
    expected = (
        "2b 0e 01 81 00 00 03" + "00 07" + b"Company".hex() + "01 07" + b"Product".hex() + "02 05" + b"V2.11".hex()
    )
    assert identification_answer(identification_request(BASIC), SHORT) == bytes.fromhex(expected)


@given(
    st.dictionaries(st.integers(0, 255), st.binary(max_size=244), min_size=1, max_size=20),
    st.sampled_from([BASIC, REGULAR, EXTENDED]),
)
def test_following_more_follows_gives_every_object_of_the_category(identity: dict[int, bytes], code: int) -> None:
    identity = SHORT | identity
    last = {BASIC: 2, REGULAR: 0x7F, EXTENDED: 0xFF}[code]
    assert walked(identity, code) == {number: value for number, value in identity.items() if number <= last}


def test_an_object_that_fills_an_answer_is_whole_and_a_longer_one_is_cut() -> None:
    room = 253 - 7 - 2  # of the PDU, less its head, number and length
    whole, cut = SHORT | {3: bytes(room)}, SHORT | {3: bytes(room + 1)}
    for identity in (whole, cut):
        first = identification_answer(identification_request(REGULAR, 0), identity)
        assert parse_identification(first[1:]) == (SHORT, 3)
        second = identification_answer(identification_request(REGULAR, 3), identity)
        assert len(second) == 253
        assert parse_identification(second[1:]) == ({3: bytes(room)}, None)
        alone = identification_answer(identification_request(INDIVIDUAL, 3), identity)
        assert parse_identification(alone[1:]) == ({3: bytes(room)}, None)


@pytest.mark.parametrize("over", [0, 1, 2])
def test_objects_that_do_not_fit_together_by_a_byte_come_in_two_answers(over: int) -> None:
    room = 253 - 7
    identity = {0: bytes(100), 1: bytes(room - 2 - 100 - 2 + over)}
    reply = identification_answer(identification_request(BASIC), identity)
    assert (len(reply) == 253, parse_identification(reply[1:])[1]) == ((True, None) if over == 0 else (False, 1))
    assert walked(identity, BASIC) == identity


def test_one_object_can_be_asked_for() -> None:
    reply = identification_answer(identification_request(INDIVIDUAL, 1), SHORT)
    assert parse_identification(reply[1:]) == ({1: b"Product"}, None)


def test_one_object_that_is_not_there_is_02() -> None:
    with pytest.raises(ModbusError) as caught:
        identification_answer(identification_request(INDIVIDUAL, 3), SHORT)
    assert caught.value.code == 2


def test_a_stream_from_an_unknown_object_starts_again() -> None:
    reply = identification_answer(identification_request(BASIC, 9), SHORT)
    assert parse_identification(reply[1:]) == (SHORT, None)


@pytest.mark.parametrize(("highest", "conformity"), [(2, 0x81), (6, 0x82), (0x80, 0x83)])
def test_conformity_says_how_far_the_identity_goes(highest: int, conformity: int) -> None:
    assert identification_answer(identification_request(BASIC), SHORT | {highest: b"x"})[3] == conformity


@pytest.mark.parametrize("data_hex", ["", "0e0181000001", "0e01810000010005aa", "0d0181000000", "0e018100000100"])
def test_a_cut_off_answer_is_noticed(data_hex: str) -> None:
    with pytest.raises(ValueError, match=r"object|identification"):
        parse_identification(bytes.fromhex(data_hex))
