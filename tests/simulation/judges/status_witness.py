"""Whether what the status registers say is true (I10), asked of the wires themselves, and whether the force that is requested
is one that a master has written whole (I7), by whoever owns it (I4). No code of the gateway is used here."""

import struct
from collections import deque
from collections.abc import Callable
from ipaddress import ip_address
from math import inf

from tests.simulation.judges.observer import FAULT, RUN_BITS, STATUS_WORDS, Observer
from tests.simulation.masters.spelling import BEAT, control_of, setpoints_of, word_of

UNAVAILABLE = 0x8000
LONGEST_MS = 32767  # a register holds no more
LARGEST_PLACE, TAKE, MARGIN_S = 255, 8, 0.005
"""Of serial faces, which are shown as an owner, too; who takes over; how late an answer tells of its write."""
FAULT_BIT, ENABLED_BIT = 16, 1
WARNING_BIT, LIMITED_BIT, UNREACHABLE_BIT = 32, 64, 128
AGE_SLACK_S = 0.012
"""And two periods: a tick that finds a fresh sample decides nothing, and the age is that of the last decision."""
WAITED_S = 0.1
"""A reading that waited through a standstill of no more is dated when it is read, and so long the last decision stands."""
SETTLED_S = 0.5
"""A voltage that has not changed for so long is the one that has been asked for as long, wherever the wire works."""
COUNT_V = 0.012
SCALES = (1.0, 1.0, 0.01, 0.01, 0.01, 0.01, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
SIGNED = frozenset((2, 3, 4, 5, 6, 7, 8, 12, 13))
"""Of the first of the status registers."""
SAME_S, BEATEN_S = 1e-6, 5.0
MASTER_LOST, RELEASED_S = 1, 0.3
LATE_LOOKS, WRITTEN_S = 3, 0.6
"""A written setpoint is looked for in this time before it is seen, and until so many looks later."""


class StatusWitness:
    """heard_s: when the load cell's wire has brought its last byte."""

    _state, _held_s = 0, 0.0
    _words: tuple[int, ...] = ()

    def __init__(self, observer: Observer, heard_s: Callable[[], float]) -> None:
        self._observer, self._heard_s = observer, heard_s
        self._last_s, self._known = 0.0, 0
        self._asked_mv, self._asked_s = 0, 0.0
        self._owner, self._commands = 0, list[tuple[float, str, int]]()
        self._last_control = 0
        self._requested: deque[tuple[float, int, int, tuple[int, ...]]] = deque()
        self._left: tuple[int, tuple[int, ...]] = (0, ())  # of the look before: what was pursued, and for whom
        self._lowered = 0  # what a calibration has made of a setpoint, which it stays for whoever enables it then
        self._requested_s = 0.0
        self._written: deque[tuple[float, float, str]] = deque()
        self._beats: deque[tuple[float, float]] = deque()
        self._echoes: deque[tuple[float, int]] = deque()
        self._beat, self._refused_s, self._write_s = 0, inf, 0.0

    def note(self, block: bytes, at_s: float) -> None:
        """Judge the status block as it was at at_s."""
        words = struct.unpack(f">{STATUS_WORDS}H", block)
        self._judge_state(words, at_s)
        self._state, self._words = words[1], words
        self._judge_age(words[12], at_s)
        self._judge_voltage(words[6], at_s)
        self._judge_owner(words[16] << 16 | words[17], at_s)
        self._judge_refusal(words[19], at_s)
        self._judge_released(words, at_s)
        self._echoes.append((at_s, words[14]))
        if len(self._echoes) > LATE_LOOKS:
            self._judge_echo()
        self._requested.append((at_s, words[3], words[4], words[16:18]))
        if len(self._requested) > LATE_LOOKS:
            self._judge_requested()
        self._last_s = at_s

    def note_write(self, host: str, pdu: bytes, now_s: float) -> None:
        """A write was taken, or nobody knows whether it was. host: where it is known, and that it was taken; now_s: at the
        latest."""
        if (control := control_of(pdu)) is not None:
            self._commands.append((now_s, host, control))
        self._written += ((now_s, counts, host) for counts in setpoints_of(pdu))
        self._write_s = max(self._write_s, now_s)
        if (beat := word_of(pdu, BEAT)) is not None:
            self._beats.append((now_s, beat))

    def note_refusal(self, now_s: float) -> None:
        """A request was refused."""
        self._refused_s = min(self._refused_s, now_s)

    def forget_owner(self) -> None:
        """Another gateway begins: it has none, whoever had the one before, and has refused nothing."""
        self._owner, self._refused_s = 0, inf

    def note_floats(self, block: bytes, at_s: float) -> None:
        """Judge the same quantities as float32, read with the block before."""
        if at_s - self._last_s > SAME_S:
            return
        for place, (number, word) in enumerate(
            zip(struct.unpack(f">{len(SCALES)}f", block), self._words, strict=False)
        ):
            scale = SCALES[place]
            is_signed = place in SIGNED
            counts = word - 65536 if is_signed and word & UNAVAILABLE else word
            is_same = counts == -UNAVAILABLE if number != number else abs(number - counts * scale) <= 0.51 * scale
            if not is_same and not (is_signed and abs(counts) >= LONGEST_MS):
                self._observer.complain("I10", f"status {place} is {word} and as a float {number}", at_s)

    def note_control_word(self, word: int, at_s: float) -> None:
        """Judge the control word, read with the block before: off and a fault leave no enable standing."""
        if word & ENABLED_BIT and self._state in (0, FAULT) and at_s - self._last_s < SAME_S:
            self._observer.complain("I10", f"control_word {word:#x} in state {self._state}", at_s)

    def _judge_refusal(self, reason: int, at_s: float) -> None:
        """Each refusal leaves its reason."""
        if self._refused_s < at_s - MARGIN_S and not reason:
            self._observer.complain("I10", "something was refused, and no reason is told", at_s)
            self._refused_s = inf

    def _judge_released(self, words: tuple[int, ...], at_s: float) -> None:
        """A lease's end releases the setpoint, until somebody commands anew."""
        owner, is_lost = words[16] << 16 | words[17], words[1] == FAULT and words[10] == MASTER_LOST
        self._held_s = self._held_s if is_lost else at_s
        if owner and is_lost and self._write_s < self._held_s and at_s - self._held_s > RELEASED_S:
            self._observer.complain("owner", f"{owner:#x} owns behind its lease's end", at_s)

    def _judge_echo(self) -> None:
        """As `_judge_requested`: a heartbeat of a write that was refused is never used."""
        at_s, beat = self._echoes.popleft()
        while self._beats and self._beats[0][0] < at_s - BEATEN_S:
            self._beats.popleft()
        if beat not in (0, self._beat) and not any(one == beat or one != one for _, one in reversed(self._beats)):
            self._observer.complain("I7", f"heartbeat {beat} is used, which nobody has written", at_s)
        self._beat = beat

    def _judge_requested(self) -> None:
        """A look of some time ago: who hears no answer tells so late. What was written since the look before it, which a
        standstill may have made long, may be seen now for the first time. Who takes over has asked for what is pursued: less
        than was written, where a calibration has lowered it or a lost master's is held, even since the look before."""
        at_s, counts, accepted, owner = self._requested.popleft()
        while self._written and self._written[0][0] < min(at_s, self._requested_s) - WRITTEN_S:
            self._written.popleft()
        self._requested_s = at_s
        signed = counts - 65536 if counts & UNAVAILABLE else counts
        is_known = counts in (0, self._known) or self._is_left(counts, accepted, owner)
        if not is_known and all(abs(signed - one) > 1.0 for _, one, _ in self._written):
            self._observer.complain("I7", f"{0.01 * signed:.2f} N are requested, which nobody has written", at_s)
        self._known, self._left = counts, (accepted, owner)
        if 0 < accepted < counts:
            self._lowered = accepted

    def _is_left(self, counts: int, accepted: int, owner: tuple[int, ...]) -> bool:
        """Decide whether a new owner has asked for what another one's setpoint had come to, at this look or the one before, or
        for what a calibration had made of it. Who owned before that look as well may have lost and taken it since: then the
        other one has just written."""
        left, former = self._left
        is_new, name = owner != former, str(ip_address(owner[0] << 16 | owner[1]))
        has_lost = is_new or any(one > counts and host != name for _, one, host in self._written)
        return (is_new and counts in (left, self._lowered)) or (has_lost and counts == accepted)

    def _judge_owner(self, owner: int, at_s: float) -> None:
        """Where one owns the setpoint before and after, and nobody has taken over or let go between, nobody else enables. A run
        may be ended by anybody, also by a word in which enable stands as before."""
        commands = [one for one in self._commands if one[0] <= at_s]
        self._commands = self._commands[len(commands) :]
        was, self._owner = self._owner, owner
        before = [self._last_control, *(control for _, _, control in commands)]
        self._last_control = before[-1]
        if not was == owner > LARGEST_PLACE or any(
            control & TAKE or not control & ENABLED_BIT for _, _, control in commands
        ):
            return
        for (command_s, host, control), stood in zip(commands, before, strict=False):
            if stood & RUN_BITS and not control & RUN_BITS:
                continue
            if host and int(ip_address(host)) != owner and self._last_s + MARGIN_S < command_s < at_s - MARGIN_S:
                self._observer.complain("I4", f"{host} commands {control:#x}, owner is {ip_address(owner)}", at_s)

    def _judge_state(self, words: tuple[int, ...], at_s: float) -> None:
        if bool(words[0] & FAULT_BIT) != (words[1] == FAULT):
            self._observer.complain("I10", f"status word {words[0]:#x} in state {words[1]}", at_s)
        if bool(words[0] & ENABLED_BIT) == (words[1] in (0, FAULT)):
            self._observer.complain("I10", f"status word {words[0]:#x} in state {words[1]}", at_s)
        if words[1] in (0, FAULT) and (words[4] or words[5]):
            told = f"{words[4]} and {words[5]} counts are pursued in state {words[1]}"
            self._observer.complain("I10", told, at_s)
        for bit, word in ((WARNING_BIT, words[11]), (LIMITED_BIT, words[9]), (UNREACHABLE_BIT, words[11] & 1 << 1)):
            if bool(words[0] & bit) != bool(word):
                self._observer.complain("I10", f"status word {words[0]:#x} beside {word:#x}", at_s)

    def _judge_age(self, age_ms: int, at_s: float) -> None:
        """No sample is younger than the last byte that has come. What is read first after a standstill is as it was before."""
        if not 0.09 < at_s - self._last_s < 0.11:
            return
        heard_s, period_s = self._heard_s(), self._observer.bounds.period_s
        silent_s, awoken = at_s - heard_s, self._observer.history.awoken
        younger_s = silent_s - AGE_SLACK_S - 2.0 * period_s - age_ms * 1e-3
        if younger_s <= 0.0 or age_ms >= LONGEST_MS:
            return
        waits = sum(
            any(begin_s < one_s <= end_s for one_s in awoken)
            for begin_s, end_s in ((heard_s, heard_s + WAITED_S), (at_s - 2.0 * period_s, at_s))
        )
        if younger_s > WAITED_S * waits:
            self._observer.complain("I10", f"a sample of {age_ms} ms, after {silent_s:.3f} s of silence", at_s)

    def _judge_voltage(self, asked_mv: int, at_s: float) -> None:
        """Another voltage than before waits where an answer is late; as the week's soak drew it."""
        observer = self._observer
        if asked_mv != self._asked_mv:
            self._asked_mv, self._asked_s = asked_mv, at_s
        if at_s - self._asked_s < SETTLED_S:
            return
        lost = (observer.output_lost_s, observer.answers_lost_s, observer.control_lost_s)
        if at_s - observer.setting_s < SETTLED_S or any(since_s is not None for since_s in lost):
            return
        if abs(asked_mv * 1e-3 - observer.voltage_v) > COUNT_V:
            self._observer.complain("I10", f"{asked_mv} mV are shown, {observer.voltage_v:.3f} V stand", at_s)
