"""Framing and bank beside their references: what both sides of a request must agree on, whoever makes the bytes."""

from collections.abc import Iterable

from gateway.modbus import Peer, Role, server
from gateway.modbus.mbap import FramingLost, MbapFramer
from gateway.profiles import load_register_map
from gateway.registers import BankRules, RegisterBank
from gateway.registers.words import ControlBit
from tests.fuzz.bank_model import BankModel, assert_nothing_changed
from tests.fuzz.frame_model import frames_of

MAP = load_register_map("force-v1")
PEERS = [Peer(f"10.0.0.{k}", 4000 + k, role=Role.CALIBRATION) for k in (1, 2, 3)]
FACES = ((0, 16), (200, 32), (300, 32))


def assert_read_as_reference(pieces: Iterable[bytes]) -> bool:
    """Feed a TCP stream as it comes; return whether its framing was lost."""
    framer, got, is_lost, fed = MbapFramer(), [], False, bytearray()
    for piece in pieces:
        fed += piece
        try:
            got += framer.feed(piece)
        except FramingLost as lost:
            got, is_lost = [*got, *lost.frames], True
            break
        assert len(framer) < 260
    assert ([tuple(one) for one in got], is_lost) == frames_of(bytes(fed)), fed.hex()
    return is_lost


def bank_and_model() -> tuple[RegisterBank, BankModel]:
    """A bank as nobody has written to it yet, and what stands for it."""
    rules = BankRules(rig_name="demo", force_max_n=60.0, supported_bits=ControlBit(15))
    bank = RegisterBank(MAP, rules, now=lambda: 1.0)
    bank.read_registers(100, 32)  # a status is shown when somebody asks for the first time
    return bank, BankModel()


def assert_answered_as_model(bank: RegisterBank, model: BankModel, pdu: bytes, peer: Peer) -> int:
    """Answer, registers and owner as the model has them, and nothing of what is refused; return the exception code or 0."""
    before = bytes(bank._image.data)
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
    return code
