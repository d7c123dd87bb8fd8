"""What a byte string does to framing, bank, RTU line and certificates, judged by references that share no code with them."""

import struct

from cryptography import x509

from gateway.modbus.certificate import ROLE_OID, read_certificate
from gateway.modbus.rtu_receiver import MOST_BYTES
from tests.certificates import signed
from tests.fuzz.damage import held_bytes
from tests.fuzz.frame_model import crc
from tests.fuzz.guided.slices import framed, sliced
from tests.fuzz.modbus_laws import PEERS, assert_answered_as_model, assert_read_as_reference, bank_and_model
from tests.modbus.rtu_bus import SILENCE_S, Bus

ASKED = struct.pack(">BBHH", 1, 3, 100, 4)
ASKED += crc(ASKED)
PAUSES_S = (0.0, 0.5 * SILENCE_S, 1.2 * SILENCE_S, 0.05)


def judge_mbap(data: bytes) -> None:
    assert_read_as_reference([piece for _, piece in sliced(data)])


def judge_bank(data: bytes) -> None:
    """Requests of three hosts in a row."""
    bank, model = bank_and_model()
    for selector, pdu in sliced(data):
        if pdu:
            assert_answered_as_model(bank, model, pdu, PEERS[selector % 3])


def judge_rtu(data: bytes) -> None:
    """Whatever is heard was on the wire with its checksum; behind a silence the next request is heard."""
    bus, sent = Bus(), b""
    for selector, piece in sliced(data):
        bus.send(piece, pause_s=PAUSES_S[selector % 4])
        sent += piece
        assert held_bytes(bus.receiver) < 2 * MOST_BYTES
    for heard in bus.requests():
        frame = bytes((heard.unit,)) + heard.pdu
        assert heard.unit in (0, 1) and frame + crc(frame) in sent, f"heard {heard}"
    assert ASKED[1:-2] in [heard.pdu for heard in bus.send(ASKED).requests()]


def judge_certificate(data: bytes) -> None:
    """Read or refused; and where cryptography reads it too, both say the same."""
    try:
        read = read_certificate(data)
    except ValueError:
        read = None
    try:
        reference = x509.load_der_x509_certificate(data)
        names = [one.value for one in reference.subject.get_attributes_for_oid(x509.NameOID.COMMON_NAME)]
        roles = [one.value for one in reference.extensions if one.oid.dotted_string == ROLE_OID]
        serial, begins = reference.serial_number, reference.not_valid_before_utc
    except Exception:  # whatever the reference makes of bytes that are none
        return
    if serial <= 0:
        return  # which RFC 5280 forbids
    assert read is not None, "cryptography reads it"
    assert int(read.serial, 16) == serial and read.begins == begins.strftime("%Y%m%d%H%M%SZ")
    assert read.name == (names[-1] if names else "")
    assert read.role == (role_in(roles[0].value) if roles else None)  # type: ignore[attr-defined]


def role_in(der: bytes) -> str:
    """A UTF8String of less than 128 bytes; empty for what is none."""
    tag_and_size, said = der[:2], der[2:]
    return said.decode("utf-8", "backslashreplace") if tag_and_size == bytes((0x0C, len(said) % 256)) else ""


def _bank_seeds() -> list[bytes]:
    """An enabled setpoint and its end, floats, FC22 and FC23."""
    enable = ("10000000020400010000", "06000104b0", "050000ff00", "0500000000")
    floats = struct.pack(">BHHBff", 16, 200, 4, 8, 1.0, 12.0)
    pair = struct.pack(">BHHHHBHH", 23, 100, 4, 0, 2, 4, 9, 1200)
    mask = struct.pack(">BHHH", 22, 0, 0xFFFE, 1)
    rows = [bytes.fromhex(one) for one in enable], [floats, pair, mask], [pair]
    return [b"".join(framed(one, k % 3) for k, one in enumerate(row)) for row in rows]


MBAP_SEEDS = [framed(struct.pack(">HHHB", k, 0, 6, 1) + struct.pack(">BHH", 3, 100, 4)) for k in range(3)]
BANK_SEEDS = _bank_seeds()
RTU_SEEDS = [framed(ASKED, 2), framed(ASKED[:3], 3) + framed(ASKED), framed(ASKED * 3), framed(b"\xff\x00" + ASKED, 1)]


def certificate_seeds() -> list[bytes]:
    """Certificates as `certs` makes them, and one with a wrong role."""
    from cryptography.hazmat.primitives.serialization import Encoding

    return [signed()[name].certificate.public_bytes(Encoding.DER) for name in ("monitor", "roleless", "captain")]
