"""The real register bank behind the real request handling, without a socket; control is a stand-in that obeys at once."""

from __future__ import annotations

import struct
from dataclasses import replace

from gateway.bsfm.coefficients import CoefficientLimits
from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.modbus import Peer, answer
from gateway.modbus.peer import Role
from gateway.registers import BankRules, Command, RegisterBank, RegisterMap, Status
from gateway.registers.rig_rules import BASIC_BITS
from gateway.registers.upload.staging import StagedFault, check_staged
from gateway.registers.words import (
    CommitStatus,
    ControlBit,
    SelfTestResult,
    SelfTestVerdict,
    State,
    StatusBit,
)
from gateway.registers.writes.admission import STARTS
from gateway.registers.writes.proposed_write import EdgeRefusal, ProposedWrite

COMMAND_WORDS, HEARTBEAT = 13, 4
ECHO_AT = struct.pack(">H", 416)


class Unplugged(Exception):  # noqa: N818
    """The wire is cut."""


class GatewayAtHand:
    """requests: every PDU that was asked, exceptions: what was refused, as (function, code); asked_at: addresses and ports at
    which a client looked for it."""

    def __init__(
        self, register_map: RegisterMap, *, wants_echo: bool = False, units: tuple[int, ...] = (0, 1, 255)
    ) -> None:
        self.units = units
        bits = BASIC_BITS | ControlBit.VALVE_PULL | ControlBit.START_SELF_TEST
        rules = BankRules(rig_name="test", force_max_n=60.0, supported_bits=bits, require_byte_order_echo=wants_echo)
        self.bank = RegisterBank(register_map, rules, now=lambda: 0.0)
        self.bank.on_command = self.obey
        self.bank.on_asked = self.decide
        self.bank.staging.on_commit = self.commit
        self.requests: list[bytes] = []
        self.asked_at: set[tuple[str, int]] = set()
        self.exceptions: list[tuple[int, int]] = []
        self.is_cut = self.is_testing = False
        self.fault = FaultCode.NONE
        self.peer = Peer("10.0.0.9", 40000, role=Role.CALIBRATION)
        self.publish(0.0, on=False)

    def obey(self, command: Command) -> None:
        if ControlBit.RESET_FAULT in command.control_word:
            self.fault = FaultCode.NONE
        was_testing = self.is_testing
        self.is_testing = ControlBit.START_SELF_TEST in command.control_word
        if was_testing and not self.is_testing:
            self.bank.self_test.show(7, SelfTestResult.STOPPED, {})
        self.publish(command.force_setpoint_n, on=bool(command.control_word & STARTS))

    def decide(self, proposal: ProposedWrite) -> EdgeRefusal | None:
        if self.fault and ControlBit.ENABLE in proposal.command.control_word:
            return EdgeRefusal(RefusalReason.FAULT_LATCHED, ControlBit.ENABLE, "a fault is latched")
        busy = ControlBit.ENABLE | ControlBit.TARE | ControlBit.RESET_FAULT
        if self.is_testing and proposal.command.control_word & busy:
            return EdgeRefusal(RefusalReason.BUSY, ControlBit.ENABLE, "a self-test has the output")
        is_asked = bool(proposal.command.control_word & ~self.bank.command.control_word & ControlBit.START_SELF_TEST)
        if is_asked and self.bank.command.control_word & ControlBit.ENABLE:
            return EdgeRefusal(RefusalReason.SELF_TEST_REFUSED, ControlBit.START_SELF_TEST, "a force is held")
        return None

    def end_self_test(self, result: SelfTestResult, **verdicts: SelfTestVerdict) -> None:
        """The self-test has come to its end: the output is off, and the command cleared."""
        self.bank.self_test.show(7, result, verdicts)
        self.is_testing = False
        self.bank.clear_command()
        self.publish(0.0, on=False)

    def stop_from_elsewhere(self) -> None:
        """Another master writes 0 to control_word."""
        answer(b"\x06\0\0\0\0", self.bank, Peer("10.0.0.7", 40001))

    def take_over_from_elsewhere(self) -> None:
        """Another master takes the setpoint over, and holds 7 N."""
        answer(struct.pack(">BHHBHH", 16, 0, 2, 4, 9, 700), self.bank, Peer("10.0.0.7", 40001))

    def write_beside_the_client(self, force_n: float) -> None:
        """Another program at the client's address, an owner as well, writes a force."""
        answer(struct.pack(">BHH", 6, 1, round(100 * force_n)), self.bank, replace(self.peer, port=40002))

    def publish(self, force_n: float, *, on: bool) -> None:
        word = StatusBit.ENABLED | StatusBit.READY | StatusBit.IN_BAND if on else StatusBit(0)
        state = State.HOLDING if on else State.OFF
        if self.is_testing:
            state = State.CALIBRATING
        if self.fault:
            word, state = StatusBit.FAULT, State.FAULT
        self.bank.publish(
            Status(
                state=state,
                status_word=int(word),
                force_measured_n=force_n - 0.5,
                force_requested_n=self.bank.command.force_requested_n,
                fault_code=self.fault,
                heartbeat_echo=self.bank.command.heartbeat,
            )
        )

    def fail(self, fault: FaultCode) -> None:
        """Latch a fault: control is off, and the command cleared."""
        self.fault, self.is_testing = fault, False
        self.bank.clear_command()
        self.publish(0.0, on=False)

    def commit(self, _action: object, words: bytes, _peer: Peer) -> None:
        limits = CoefficientLimits(cell_range_n=100.0)
        judged = check_staged(words, limits)
        if isinstance(judged, StagedFault):
            self.bank.staging.show_commit(CommitStatus.FAILED, judged.index, judged.reason)
        else:
            self.bank.staging.show_commit(CommitStatus.COMMITTED)

    def ask(self, frame: bytes) -> bytes:
        """Return the answer to one whole request with its header."""
        if self.is_cut:
            raise Unplugged
        transaction, protocol, length, unit = struct.unpack(">HHHB", frame[:7])
        assert (protocol, length) == (0, len(frame) - 6)
        pdu = self.ask_unit(unit, frame[7:])
        return struct.pack(">HHHB", transaction, 0, len(pdu) + 1, unit) + pdu

    def ask_unit(self, unit: int, request: bytes) -> bytes:
        """Return the answer to a request's PDU; nobody but the rig's units is at home."""
        return self.answer(request) if unit in self.units else bytes([request[0] | 0x80, 0x0B])

    def connect(self) -> None:
        """Accept a connection, or not."""
        if self.is_cut:
            raise Unplugged

    def answer(self, request: bytes) -> bytes:
        if self.is_cut:
            raise Unplugged
        self.requests.append(request)
        pdu = answer(request, self.bank, self.peer)
        if pdu[0] & 0x80:
            self.exceptions.append((request[0], pdu[1]))
        return pdu

    @property
    def writes(self) -> list[tuple[int, tuple[int, ...]]]:
        """Every write to the command block: (first address, words)."""
        found = []
        for request in self.requests:
            first, second = struct.unpack_from(">HH", request, 1)
            if request[0] == 23:
                address, count = struct.unpack_from(">HH", request, 5)
                found.append((address, struct.unpack(f">{count}H", request[10:])))
            elif request[0] == 16 and first < 16:
                found.append((first, struct.unpack(f">{second}H", request[6:])))
            elif request[0] == 6 and first < 16:
                found.append((first, (second,)))
        return found

    @property
    def echoes(self) -> int:
        """How often byte_order_echo was written."""
        return sum(request[0] == 16 and request[1:3] == ECHO_AT for request in self.requests)

    @property
    def words(self) -> list[tuple[int, ...]]:
        """Every command that was written, whole or the words behind an earlier one's control word."""
        found: list[tuple[int, ...]] = []
        for address, words in self.writes:
            if address + len(words) == COMMAND_WORDS:
                before = found[-1] if found else (0,)
                found.append((*before[:address], *words))
        return found

    @property
    def beats(self) -> list[int]:
        """Every heartbeat that was written, alone or within a command."""
        return [words[HEARTBEAT - address] for address, words in self.writes]

    @property
    def uploads(self) -> list[tuple[int, bytes]]:
        """Every write to the staging block: (address, data)."""
        found = []
        for request in self.requests:
            address = int.from_bytes(request[1:3], "big")
            if request[0] == 16 and address >= 1000:
                found.append((address, request[6:]))
            elif request[0] == 6 and address >= 1000:
                found.append((address, request[3:]))
        return found


def refuse_commands(gateway: GatewayAtHand) -> list[bytes]:
    """As where another master has the setpoint; return where each command will be noted."""
    answer, asked = gateway.answer, list[bytes]()

    def refuse(request: bytes) -> bytes:
        if request[0] == 23 or (request[0] in (6, 16) and int.from_bytes(request[1:3], "big") < 16):
            asked.append(request)
            return bytes((request[0] | 0x80, 6))
        return answer(request)

    gateway.answer = refuse  # type: ignore[method-assign]
    return asked
