"""What is refused, with which number, and that it leaves no trace. Order: function 01, shape 03, address 02, value 03."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.modbus import ModbusError, Peer, RequestError, RequestFault, answer
from gateway.modbus import pdu as P  # noqa: N812
from gateway.modbus.server import refuse_unit
from tests.modbus.host_answers import AnswerMismatch, answer_data, write_coil_request, write_coils_request
from tests.modbus.memory_bank import MemoryBank

PEER = Peer("127.0.0.1", 4711)
FORBIDDEN_WORD = bytes.fromhex("dead")


class FussyBank(MemoryBank):
    """200 words and 16 coils; refuses one value, after the address as banks must."""

    def __init__(self) -> None:
        super().__init__(words=200, bits=16, identity={0: b"v", 1: b"p", 2: b"1"})

    def write_registers(self, address: int, data: bytes, _peer: Peer) -> None:
        self.check_registers_readable(address, len(data) // 2)
        if FORBIDDEN_WORD in (data[at : at + 2] for at in range(0, len(data), 2)):
            raise ModbusError(3)
        super().write_registers(address, data, _peer)


class ListeningBank(FussyBank):
    """Keeps what it is told of."""

    def __init__(self) -> None:
        super().__init__()
        self.heard: list[tuple[RequestFault, int, int | None, Peer]] = []

    def note_refusal(self, refusal: RequestError, peer: Peer) -> None:
        self.heard.append((refusal.fault, refusal.value, refusal.address, peer))


def refusal(request_hex: str) -> int:
    """The exception code, after checking that it is one of this function and that nothing was changed."""
    served, request = FussyBank(), bytes.fromhex(request_hex)
    reply = answer(request, served, PEER)
    assert len(reply) == 2
    assert reply[0] == request[0] | 0x80
    assert not any(served.image)
    assert not any(served.bits)
    return reply[1]


@pytest.mark.parametrize("function", sorted(set(range(128)) - {1, 2, 3, 4, 5, 6, 8, 15, 16, 17, 22, 23, 43}))
def test_an_unknown_function_is_refused_under_its_own_number(function: int) -> None:
    assert answer(bytes((function, 0, 0, 0, 1)), FussyBank(), PEER) == bytes((function | 0x80, 1))


@pytest.mark.parametrize(
    "request_hex",
    [
        "01 0000 0000",
        "01 0000 07d1",
        "02 0000 ffff",
        "03 0000 0000",
        "03 0000 007e",
        "04 0000 ffff",
        "0f 0000 0000 00",
        "0f 0000 07b1 f7" + 247 * "00",
        "10 0000 0000 00",
        "10 0000 007c f8" + 248 * "00",
        "17 0000 0000 0000 0001 02 0001",
        "17 0000 007e 0000 0001 02 0001",
        "17 0000 0001 0000 0000 00",
        "17 0000 0001 0000 007a f4" + 244 * "00",
        "2b 0e 00 00",
        "2b 0e 05 00",
    ],
)
def test_a_bad_quantity_is_03(request_hex: str) -> None:
    assert refusal(request_hex) == 3


@pytest.mark.parametrize(
    "request_hex",
    [
        "0f 0000 0008 02 ff00",
        "0f 0000 0009 01 ff",
        "0f 0000 0008 01 ffff",
        "10 0000 0002 02 00010002",
        "10 0000 0001 02 00010002",
        "10 0000 0002 04 0001",
        "10 0000 0001 03 000100",
        "17 0000 0001 0000 0001 04 0001",
        "17 0000 0001 0000 0001 02 00010002",
        "17 0000 0001 0000 0002 02 0001",
    ],
)
def test_a_byte_count_that_disagrees_is_03(request_hex: str) -> None:
    assert refusal(request_hex) == 3


@pytest.mark.parametrize(
    "request_hex",
    [
        "01 0010 0001",
        "02 000f 0002",
        "03 00c8 0001",
        "03 00c7 0002",
        "04 ffff 0001",
        "05 0010 ff00",
        "06 00c8 0001",
        "0f 000f 0002 01 03",
        "10 00c7 0002 04 00010002",
        "16 00c8 0000 0001",
        "17 00c8 0001 0000 0001 02 0001",
        "17 0000 0001 00c8 0001 02 0001",
        "2b 0e 04 09",
    ],
)
def test_an_address_outside_is_02(request_hex: str) -> None:
    assert refusal(request_hex) == 2


@pytest.mark.parametrize(
    "request_hex", ["05 0000 0001", "05 0003 ff01", "05 000f 00ff", "06 0000 dead", "10 0000 0002 04 0001 dead"]
)
def test_a_value_that_is_not_allowed_is_03(request_hex: str) -> None:
    assert refusal(request_hex) == 3


@pytest.mark.parametrize(
    ("request_hex", "code"),
    [
        ("03 ffff 0000", 3),
        ("10 ffff 0002 02 0001", 3),
        ("17 ffff 0001 ffff 0000 00", 3),
        ("05 ffff 1234", 2),
        ("06 ffff dead", 2),
        ("10 00c8 0001 02 dead", 2),
        ("17 00c8 0001 0000 0001 02 dead", 2),
    ],
)
def test_quantity_comes_before_address_and_address_before_value(request_hex: str, code: int) -> None:
    assert refusal(request_hex) == code


WHOLE_REQUESTS = [
    P.read_request(1, 0, 3),
    P.read_request(2, 0, 3),
    P.read_request(3, 0, 3),
    P.read_request(4, 0, 3),
    write_coil_request(0, True),
    P.write_register_request(0, 7),
    write_coils_request(0, [True] * 9),
    P.write_registers_request(0, b"\x01\x02\x03\x04"),
    P.mask_write_request(0, 0, 0xFFFF),
    P.read_write_request(0, 1, 0, b"\x01\x02"),
    bytes.fromhex("2b 0e 01 00"),
    bytes.fromhex("11"),
]


@pytest.mark.parametrize("request_pdu", WHOLE_REQUESTS, ids=lambda pdu: f"function {pdu[0]}")
def test_a_truncated_or_surplus_request_is_03_and_does_nothing(request_pdu: bytes) -> None:
    for size in range(1, len(request_pdu)):
        assert refusal(request_pdu[:size].hex()) == 3
    assert refusal((request_pdu + b"\x00").hex()) == 3


def test_other_encapsulated_interfaces_are_not_served() -> None:
    assert refusal("2b 0d 0000") == 1
    assert refusal("2b 0d") == 1, "the function comes before the shape"


@pytest.mark.parametrize("sub_function", [1, 2, 4, 10, 20, 255, 0x0100, 0xFFFF])
def test_other_diagnostic_sub_functions_are_not_served(sub_function: int) -> None:
    """6.8: "sub-function code supported: no" is exception 01."""
    assert refusal(f"08 {sub_function:04x} 0000") == 1


@pytest.mark.parametrize("request_hex", ["08", "08 00", "08 0000 a5", "08 0000 a537 00"])
def test_a_diagnostic_request_without_whole_words_is_03(request_hex: str) -> None:
    assert refusal(request_hex) == 3


FAULTS = [
    ("03 0005 007e", RequestFault.QUANTITY, 126, 5),
    ("03 0005 0000", RequestFault.QUANTITY, 0, 5),
    ("10 0007 0001 03 000100", RequestFault.QUANTITY, 3, 7),
    ("0f 0005 07b1 f7" + 247 * "00", RequestFault.QUANTITY, 1969, 5),
    ("17 0001 0001 0002 007a f4" + 244 * "00", RequestFault.QUANTITY, 122, 2),
    ("06 0007", RequestFault.QUANTITY, 3, 7),
    ("06", RequestFault.QUANTITY, 1, None),
    ("05 0003 1234", RequestFault.VALUE, 0x1234, 3),
    ("07", RequestFault.FUNCTION, 7, None),
    ("2b 0d 0000", RequestFault.FUNCTION, 43, None),
    ("08 0001 0000", RequestFault.FUNCTION, 8, None),
    ("2b 0e 05 00", RequestFault.VALUE, 5, None),
    ("2b 0e 04 09", RequestFault.OBJECT, 9, None),
    ("11 00", RequestFault.QUANTITY, 2, None),
]


@pytest.mark.parametrize(("request_hex", "fault", "value", "address"), FAULTS)
def test_what_the_protocol_refuses_the_bank_is_told_once(
    request_hex: str, fault: RequestFault, value: int, address: int | None
) -> None:
    told = ListeningBank()
    answer(bytes.fromhex(request_hex), told, PEER)
    assert told.heard == [(fault, value, address, PEER)]


def test_what_the_bank_refuses_itself_it_is_not_told_of() -> None:
    told = ListeningBank()
    for request in ("03 00c8 0001", "06 0000 dead", "05 0010 1234"):
        answer(bytes.fromhex(request), told, PEER)
    assert told.heard == []


def test_a_foreign_unit_is_refused_with_its_number() -> None:
    told = ListeningBank()
    assert refuse_unit((9, P.read_request(3, 4, 1)), (1, 255), told, PEER) == bytes.fromhex("83 0b")
    assert told.heard == [(RequestFault.UNIT, 9, 4, PEER)]


def test_read_write_with_a_bad_read_half_writes_nothing() -> None:
    served = FussyBank()
    assert answer(P.read_write_request(190, 20, 0, b"\x12\x34"), served, PEER) == bytes.fromhex("97 02")
    assert not any(served.image)


def test_an_empty_request_is_answered_too() -> None:
    assert answer(b"", FussyBank(), PEER) == bytes.fromhex("80 01")


@given(st.binary(min_size=1, max_size=253))
def test_whatever_arrives_is_answered_with_a_pdu_of_its_own_function(request_pdu: bytes) -> None:
    reply = answer(request_pdu, FussyBank(), PEER)
    assert 2 <= len(reply) <= 253
    assert reply[0] & 0x7F == request_pdu[0] & 0x7F


def test_a_bug_in_the_bank_is_not_dressed_up_as_an_exception_answer() -> None:
    class Broken(FussyBank):
        def read_registers(self, address: int, count: int, _peer: Peer = PEER) -> bytes:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        answer(P.read_request(3, 0, 1), Broken(), PEER)


def test_the_host_reads_a_refusal_as_one() -> None:
    with pytest.raises(ModbusError) as caught:
        answer_data(P.read_request(3, 0, 1), bytes.fromhex("83 0b"))
    assert caught.value.code == 0x0B
    assert P.is_exception(bytes.fromhex("83 0b")) and not P.is_exception(bytes.fromhex("03 02 83 83"))


@pytest.mark.parametrize("reply_hex", ["", "03", "03 02 00", "03 04 00000000", "04 02 0000", "84 02", "83"])
def test_the_host_refuses_an_answer_that_is_not_its_own(reply_hex: str) -> None:
    with pytest.raises(AnswerMismatch):
        answer_data(P.read_request(3, 0, 1), bytes.fromhex(reply_hex))


def test_the_host_notices_an_echo_that_differs() -> None:
    with pytest.raises(AnswerMismatch):
        answer_data(P.write_register_request(1, 3), bytes.fromhex("06 0001 0004"))


@pytest.mark.parametrize(
    "build",
    [
        lambda: P.read_request(3, 0, 126),
        lambda: P.read_request(1, 0, 0),
        lambda: P.write_registers_request(0, bytes(248)),
        lambda: P.write_registers_request(0, bytes(3)),
        lambda: P.read_write_request(0, 1, 0, bytes(244)),
    ],
)
def test_the_host_does_not_build_what_no_device_may_accept(build: object) -> None:
    with pytest.raises(ValueError, match="values in one request"):
        build()  # type: ignore[operator]


def test_a_read_and_write_whose_bytes_do_not_fit_names_where_it_would_have_written() -> None:
    bank = ListeningBank()
    cut = P.read_write_request(3, 2, 7, bytes(4))[:-1]
    assert answer(cut, bank, PEER) == bytes((23 | 0x80, 3))
    assert bank.heard == [(RequestFault.QUANTITY, 3, 7, PEER)]


def test_a_refused_request_names_its_first_address_whatever_its_function() -> None:
    for function in (1, 2, 3, 4, 5, 6, 15, 16, 22, 23):
        assert P.address_in(bytes((function, 0x04, 0xB1))) == 0x04B1, function
        assert P.address_in(bytes((function, 0x04))) is None, function
    assert [P.address_in(bytes((function, 0x04, 0xB1))) for function in (8, 17, 43)] == [None] * 3
