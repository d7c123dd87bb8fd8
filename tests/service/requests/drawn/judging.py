"""Each request of a scene, judged where it is executed, whichever way it came by; and what two plays of it must share."""

import json
from collections.abc import Callable
from struct import unpack
from typing import Any, NamedTuple

from gateway.audit.write_audit import WriteAudit
from gateway.fieldbus.tls_stream import TlsStream
from gateway.modbus import Peer
from tests.fuzz.bank_model import ENABLE
from tests.service.requests.drawn.audit_count import AuditCount
from tests.service.requests.drawn.looks import Look, changed_words, differences
from tests.service.requests.drawn.parties import KEEPER
from tests.service.requests.drawn.reference import CALIBRATING, OK, STAGING, UNITS, Before, Verdict, judge, when_lost
from tests.service.requests.drawn.secure import ROLES
from tests.service.requests.drawn.world import World

REFUSAL_WORDS = ((118, 4), (268, 8), (368, 8))
"""What may be another behind a refusal: where, what and why, in three faces."""
MOST_WORDS, COILS, READ_AND_WRITE = 125, (5, 15), b"\x17"
BURST, PER_S = 50.0, 200.0
"""Requests of one address."""
FAULT_CODE, MASTER_LOST = 110, 1
ACTS = 1145, 1149
"""Commit, and choice of a slot: what is written there acts, and may change other registers."""
LARGEST_HELD = 65536 + 1024 + 260
LIVE = {"accepted_n": 240, "applied_n": 242, "requested_n": 238, "voltage_v": 244, "trim_v": 248}
"""Fields of the state in words that stand in float registers, too."""


class Executed(NamedTuple):
    """What a face was given for one request. asked: when, by whom, of which unit, what; is_idle: nothing may come of it, so it
    can be left out."""

    asked: tuple[float, str, int | None, bytes]
    answer: bytes | None
    is_idle: bool


class Judge:
    """first: of the play before; what was idle in it is left out in this one, and must not be missed."""

    def __init__(self, first: "Judge | None" = None) -> None:
        self.broken, self.told, self.audit = list[str](), list[str](), AuditCount()
        self.executed, self.looks, self._first = list[Executed](), list[Look](), first
        self.asked: dict[str, list[bytes]] = {}
        """What was executed, by who had asked."""
        self._rates: dict[str, tuple[float, float]] = {}
        self.is_disturbed = False  # somebody has ended what the keeper holds, or exchanged what it is held by

    def follow(self, world: World) -> None:
        """From now on: whatever is executed and written there."""
        self._world, self._bank = world, world.bank
        writes: WriteAudit = world.stage.server._asked.audit._writes
        writes._put, writes._clock = self.audit.lines.append, world.clock.time  # type: ignore[assignment]
        self._bank.on_write, self._bank.on_refused_write = writes.note_command, writes.note_refusal
        self._bank.staging.on_act = writes.note_act
        self._writes, server = writes, world.stage.server
        answer = server.answer

        def answered(line: bytes, *, has_waited: bool = False) -> Any:
            given = answer(line, has_waited=has_waited)
            if json.loads(given if isinstance(given, bytes) else given.result(timeout=0.0))["ok"]:
                self.audit.note_local(json.loads(line))
            return given

        server.answer = answered  # type: ignore[method-assign]

    def look(self) -> Look:
        bank, stage = self._bank, self._world.stage
        bank.read_registers(100, 1)
        words = bytearray(bank._image.data)
        for first, count in REFUSAL_WORDS:
            words[2 * first : 2 * (first + count)] = bytes(2 * count)
        decision = self._world.wired.loop.decision
        run = stage.calibration_runs.status() | {"ended": ""}  # which tells what was refused last
        told = str([stage.upload.status(), stage.recordings.status(), run]).replace(str(stage.state), "")
        return Look(bytes(words), bank.owner, bank.last_writer, decision.voltage_v if decision else 0.0, told)

    def judged(self, execute: Callable[..., Any]) -> Callable[..., Any]:
        """Wrap a function that executes requests."""

        def executed(*given: Any) -> Any:
            unit, pdu, peer = _request(execute.__name__, given)
            asked = self._world.clock.now_s, str(peer), unit, pdu
            was = self._was(asked)
            if was and was.is_idle:
                self.executed.append(was)
                self._note_asked(peer, pdu)
                return was.answer
            before, answer = self.look(), execute(*given)
            if was and answer != was.answer and pdu[:1] != READ_AND_WRITE:  # which may read what was refused last
                self.broken.append(f"{asked} is answered {answer!r}, and was {was.answer!r}")
            if answer is not None:  # else it was not one whole frame
                self._note_asked(peer, pdu)
            said = answer[7:] if execute.__name__ == "whole_answer" and answer else answer
            is_idle = answer is not None and self._is_right((unit, pdu, peer), said, before)
            self.executed.append(Executed(asked, answer, is_idle))
            return answer

        return executed

    def _was(self, asked: tuple[float, str, int | None, bytes]) -> Executed | None:
        """What was executed in its place in the play before, which must be the same request; None in a first play."""
        place, before = len(self.executed), self._first.executed if self._first else []
        was = before[place] if place < len(before) else None
        if self._first and (was is None or was.asked != asked):
            self.broken.append(f"{asked} is asked, and was {was and was.asked}: the plays are not the same")
        return was

    def _note_asked(self, peer: Peer, pdu: bytes) -> None:
        """Nobody who comes by an address asks more often than it may, on however many connections."""
        self.asked.setdefault(peer.identity, []).append(pdu)
        if not peer.host[0].isdecimal() or peer.host.startswith("127."):
            return
        now_s, (left, at_s) = self._world.clock.now_s, self._rates.get(peer.host, (BURST, 0.0))
        left = min(BURST, left + (now_s - at_s) * PER_S) - 1.0
        self._rates[peer.host] = left, now_s
        if left < -1.0:
            self.broken.append(f"{peer.host} is answered {-left:.1f} requests more than it may ask, at {now_s:.3f}")

    def _is_right(self, request: tuple[int | None, bytes, Peer], answer: bytes, before: Look) -> bool:
        """Judge one request; return whether nothing may come of it."""
        (unit, pdu, peer), after = request, self.look()
        facts = self._facts(before)
        verdict = judge(pdu, self._role_of(peer), peer.identity, facts, self._world.known_bits)
        if unit is not None and unit not in UNITS:
            verdict = Verdict(frozenset((11,)), is_write=verdict.is_write)
        code = answer[1] if answer[0] & 0x80 else 0
        about = f"{peer} ({peer.role.name.lower()}) {pdu[:40].hex()} -> {answer[:6].hex()}, {facts}"
        if code not in verdict.codes:
            reason = self._bank.last_refusal.sentence if code and self._bank.last_refusal else ""
            self.broken.append(f"not one of {sorted(verdict.codes)}: {about} {reason}")
        if (code or not verdict.is_write) and (changes := differences(before, after)):
            self.broken.append(f"changes {changes[:6]}: {about}")
        if code:
            self._judge_reason(pdu, about)
        if code and verdict.is_write:
            self.audit.note_refused(peer)
        elif verdict.is_write:
            self._judge_accepted(peer, verdict, (before, after), about)
            self._judge_places(pdu, (before, after), about)
        elif not code:
            self._judge_read(pdu, answer, after, about)
        self.told.append(f"  {about}")
        return not verdict.is_write or bool(code and not verdict.is_remembered)

    def _role_of(self, peer: Peer) -> int:
        """As the certificate says, or the rig."""
        is_plain = not peer.name and peer.host[0].isdecimal()
        return ROLES[peer.name] if peer.name in ROLES else self._world.plain_role if is_plain else int(peer.role)

    def _facts(self, look: Look) -> Before:
        return Before(look.command, look.owner, look.word(101), self._world.wired.controller.most_pull_n())

    def would_stop(self, pdu: bytes, peer: Peer) -> bool:
        """Decide whether a request would clear enable, by the rules."""
        now = self.look()
        values = (
            judge(pdu, self._role_of(peer), peer.identity, self._facts(now), self._world.known_bits).values
            or now.command
        )
        return bool(now.word(0) & 1) and not int(values[0]) & 1

    def _judge_reason(self, pdu: bytes, about: str) -> None:
        """The registers say why, and where: at a word of this request, or of the register that it cuts."""
        place, reason = (self._world.wired.word(name) for name in ("refusal_address", "refusal_reason"))
        firsts = [unpack(">H", pdu[at : at + 2])[0] for at in (1, 5) if len(pdu) >= at + 2]
        firsts += [0] if pdu[0] in COILS else []  # bits of the control word
        if not reason or not (place == 0xFFFF or any(first - 1 <= place <= first + MOST_WORDS for first in firsts)):
            self.broken.append(f"the registers tell reason {reason} at {place}: {about}")

    def _judge_accepted(self, peer: Peer, verdict: Verdict, looks: tuple[Look, Look], about: str) -> None:
        before, after = looks
        written = [name for name, by in after.writers.items() if by != before.writers.get(name)]
        if any(after.writers[name][0].identity != peer.identity for name in written):
            self.broken.append(f"{written} are told to be another's: {about}")
        if before.owner != after.owner or before.word(0) != after.word(0) or before.told != after.told:
            self.is_disturbed |= peer.host != KEEPER
        if self._role_of(peer) == 0:
            self.broken.append(f"a monitor writes: {about}")
        values = verdict.values
        if values is not None and verdict.codes == OK:
            is_lost = (
                before.word(FAULT_CODE) != MASTER_LOST == after.word(FAULT_CODE)
            )  # control finds its lease over now
            if after.command != (when_lost(values) if is_lost else values):
                self.broken.append(f"is {after.command}, by the rules {values}: {about}")
            if is_lost:
                self.audit.note_accepted(peer, (before.command, values), verdict.written, (before.owner, before.owner))
                return
        is_no_stop = verdict.written is None or verdict.written & ENABLE
        if before.word(101) == CALIBRATING != after.word(101) and is_no_stop:
            return  # a run has ended meanwhile, and took its setpoints and owner along
        self.audit.note_accepted(peer, (before.command, after.command), verdict.written, (before.owner, after.owner))

    def _judge_places(self, pdu: bytes, looks: tuple[Look, Look], about: str) -> None:
        """What is staged stands there, and nothing else has changed."""
        place, data = (unpack(">H", pdu[5:7])[0], pdu[10:]) if pdu[0] == 23 else (unpack(">H", pdu[1:3])[0], pdu[6:])
        data = pdu[3:5] if pdu[0] == 6 else data
        places = range(place, place + len(data) // 2)
        if pdu[0] not in (6, 16, 23) or not STAGING[0] <= place <= STAGING[1] or any(act in places for act in ACTS):
            return
        if looks[1].words[2 * place : 2 * place + len(data)] != data:
            self.broken.append(f"is not staged: {about}")
        if others := set(changed_words(*looks)) - set(places):
            self.broken.append(f"changes {sorted(others)[:6]}, too: {about}")

    def _judge_read(self, pdu: bytes, answer: bytes, now: Look, about: str) -> None:
        """What is read is what any other face reads in this state."""
        if pdu[0] in (3, 4):
            data = self._bank.read_registers(*unpack(">HH", pdu[1:5]))
        elif pdu[0] in (1, 2):
            first, count = unpack(">HH", pdu[1:5])
            bits = now.word(first // 100 * 100) >> first % 100 & (1 << count) - 1
            data = bits.to_bytes(-(-count // 8), "little")
        else:
            return
        if answer[1:] != bytes((len(data),)) + data:
            self.broken.append(f"reads another state than {data.hex()}: {about}")

    # -- between two requests

    def look_around(self) -> None:
        self.looks.append(now := self.look())
        abcd, cdab = (now.words[2 * first : 2 * first + 192] for first in (200, 300))
        if b"".join(cdab[k + 2 : k + 4] + cdab[k : k + 2] for k in range(0, 192, 4)) != abcd:
            self.broken.append("ABCD and CDAB tell different numbers")
        self._judge_live(now)
        self._judge_owner(now)
        self.judge_bounds()
        self.broken += [sentence for sentence in self._world.stage.said if "A499" in sentence]
        self.broken += [str(error) for error in self._world.errors]
        if self._first and len(self.looks) <= len(self._first.looks):
            was = self._first.looks[len(self.looks) - 1]
            if different := differences(was, now):
                self.broken.append(f"what is refused or read is missed where it is left out: {different[:6]}")

    def _judge_live(self, now: Look) -> None:
        """The page and MQTT are told what the registers tell."""
        live = self._world.stage.ask(b'{"do": "state"}')
        told = [round(1000 * (live["force"][name] or 0.0) * (1000 if name[-1] == "v" else 1)) for name in LIVE]
        stand = [round(1000 * now.number(place)) for place in LIVE.values()]
        if max(abs(a - b) for a, b in zip(told, stand, strict=True)) > 1 or live["owner"] != now.owner:
            about = f"{live['force']} of {live['owner']}, the registers {stand} of {now.owner}"
            self.broken.append(f"the state in words tells {about}")

    def _judge_owner(self, now: Look) -> None:
        """Words 116 and 117 tell the address of who owns: 0 of nobody."""
        owner, shown = now.owner or "0.0.0.0", now.word(116) << 16 | now.word(117)
        told = {"serial:1": 1, "serial:2": 2}.get(owner)
        if owner[0].isdecimal():
            told = int.from_bytes(bytes(map(int, owner.split("."))), "big")
        if told is not None and shown != told:
            self.broken.append(f"owner_ip is {shown:x}, and {owner} owns")

    def judge_bounds(self) -> None:
        for one in self._world.connections:
            transport: Any = one._transport
            held = len(one._framer) + len(getattr(transport, "_socket", transport)._waiting)
            if isinstance(transport, TlsStream):
                held += transport._incoming.pending + transport._outgoing.pending
            if held > LARGEST_HELD:
                self.broken.append(f"{held} bytes are held for {one.peer}")

    def end(self) -> None:
        self._writes.close()
        if self._first is None:
            self.broken += self.audit.broken()
        elif len(self.executed) != len(self._first.executed):
            self.broken.append(f"{len(self.executed)} are executed, and were {len(self._first.executed)}")


def _request(name: str, given: tuple[Any, ...]) -> tuple[int | None, bytes, Peer]:
    """Unit (None: a served one), PDU and who asks."""
    if name == "whole_answer":
        return given[0][6] if len(given[0]) > 6 else None, given[0][7:], given[3]
    if name == "refuse_unit":
        return *given[0], given[3]
    return None, given[0], given[2]
