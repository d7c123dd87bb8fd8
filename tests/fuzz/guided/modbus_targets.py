"""What a byte string does to framing, bank, RTU line and certificates, judged by references that share no code with them."""

import struct
from collections.abc import Iterator

from cryptography import x509

from gateway.modbus import Peer, Role, server
from gateway.modbus.certificate import ROLE_OID, read_certificate
from gateway.modbus.mbap import FramingLost, MbapFramer
from gateway.modbus.rtu_receiver import MOST_BYTES
from gateway.profiles import load_register_map
from gateway.registers import BankRules, RegisterBank
from gateway.registers.words import ControlBit
from tests.certificates import signed
from tests.fuzz.bank_model import BankModel, assert_nothing_changed
from tests.fuzz.damage import held_bytes
from tests.fuzz.frame_model import crc, frames_of
from tests.modbus.rtu_bus import SILENCE_S, Bus

MAP = load_register_map("force-v1")
PEERS = [Peer(f"10.0.0.{k}", 4000 + k, role=Role.CALIBRATION) for k in (1, 2, 3)]
FACES = ((0, 16), (200, 32), (300, 32))
ASKED = struct.pack(">BBHH", 1, 3, 100, 4)
ASKED += crc(ASKED)
PAUSES_S = (0.0, 0.5 * SILENCE_S, 1.2 * SILENCE_S, 0.05)


def sliced(data: bytes) -> Iterator[tuple[int, bytes]]:
    """The input as (selector, up to 31 bytes), by a byte that says both: a mutation elsewhere moves no cut."""
    at = 0
    while at < len(data):
        size, selector = data[at] & 31, data[at] >> 5
        yield selector, data[at + 1 : at + 1 + size]
        at += 1 + size


def framed(stream: bytes, selector: int = 0) -> bytes:
    """An input whose slices are the stream's."""
    parts = [stream[at : at + 31] for at in range(0, len(stream), 31)]
    return b"".join(bytes((selector << 5 | len(part),)) + part for part in parts)


def judge_mbap(data: bytes) -> None:
    framer, got, is_lost, fed = MbapFramer(), [], False, bytearray()
    for _, piece in sliced(data):
        fed += piece
        try:
            got += framer.feed(piece)
        except FramingLost as lost:
            got, is_lost = [*got, *lost.frames], True
            break
        assert len(framer) < 260
    assert ([tuple(one) for one in got], is_lost) == frames_of(bytes(fed))


def judge_bank(data: bytes) -> None:
    """Requests of three hosts in a row: answer, registers and owner as the model has them, and nothing of what is refused."""
    rules = BankRules(rig_name="demo", force_max_n=60.0, supported_bits=ControlBit(15))
    bank, model = RegisterBank(MAP, rules, now=lambda: 1.0), BankModel()
    bank.read_registers(100, 32)  # a status is shown when somebody asks for the first time
    for selector, pdu in sliced(data):
        if not pdu:
            continue
        peer, before = PEERS[selector % 3], bytes(bank._image.data)
        answer = server.answer(pdu, bank, peer)
        code = answer[1] if answer[0] & 0x80 else 0
        wanted = model.answer(pdu, peer.host)
        assert wanted is None or code == wanted, f"{pdu.hex()} of {peer.host}: {code}, by the rules {wanted}"
        assert len(answer) <= 253
        if code:
            assert_nothing_changed(before, bytes(bank._image.data), pdu)
        else:
            assert all(bank.read_registers(base, size) == model.face(base) for base, size in FACES), pdu.hex()
            assert bank.owner == model.owner


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
