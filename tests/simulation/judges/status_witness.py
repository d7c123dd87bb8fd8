"""Whether what the status registers say is true (I10), asked of the wires themselves, and whether the force that is requested
is one that a master has written whole (I7), by whoever owns it (I4). No code of the gateway is used here."""

import struct
from collections import deque
from collections.abc import Callable
from ipaddress import ip_address

from tests.simulation.judges.observer import FAULT, STATUS_WORDS, Observer
from tests.simulation.masters.spelling import control_of, setpoints_of

UNAVAILABLE = 0x8000
LONGEST_MS = 32767  # a register holds no more
LARGEST_PLACE, TAKE, MARGIN_S = 255, 8, 0.005
"""Of serial faces, which are shown as an owner, too; who takes over; how late an answer tells of its write."""
FAULT_BIT, ENABLED_BIT = 16, 1
AGE_SLACK_S = 0.012
"""And two periods: a tick that finds a fresh sample decides nothing, and the age is that of the last decision."""
SETTLED_S = 0.5
"""A voltage that has not changed for so long is the one that has been asked for as long, wherever the wire works."""
COUNT_V = 0.012
LATE_LOOKS, WRITTEN_S = 3, 0.6
"""A written setpoint is looked for in this time before it is seen, and until so many looks later."""


class StatusWitness:
    """heard_s: when the load cell's wire has brought its last byte."""

    def __init__(self, observer: Observer, heard_s: Callable[[], float]) -> None:
        self._observer, self._heard_s = observer, heard_s
        self._last_s, self._known = 0.0, 0
        self._asked_mv, self._asked_s = 0, 0.0
        self._owner, self._commands = 0, list[tuple[float, str, int]]()
        self._requested: deque[tuple[float, int]] = deque()
        self._written: deque[tuple[float, float]] = deque()

    def note(self, block: bytes, at_s: float) -> None:
        """Judge the status block as it was at at_s."""
        words = struct.unpack(f">{STATUS_WORDS}H", block)
        self._judge_state(words, at_s)
        self._judge_age(words[12], at_s)
        self._judge_voltage(words[6], at_s)
        self._judge_owner(words[16] << 16 | words[17], at_s)
        self._requested.append((at_s, words[3]))
        if len(self._requested) > LATE_LOOKS:
            self._judge_requested()
        self._last_s = at_s

    def note_write(self, host: str, pdu: bytes, now_s: float) -> None:
        """A write was taken, or nobody knows whether it was. host: where it is known, and that it was taken; now_s: at the
        latest."""
        if (control := control_of(pdu)) is not None:
            self._commands.append((now_s, host, control))
        self._written += ((now_s, counts) for counts in setpoints_of(pdu))

    def forget_owner(self) -> None:
        """Another gateway begins: it has none, whoever had the one before."""
        self._owner = 0

    def _judge_requested(self) -> None:
        """A look of some time ago: who hears no answer tells so late."""
        at_s, counts = self._requested.popleft()
        while self._written and self._written[0][0] < at_s - WRITTEN_S:
            self._written.popleft()
        signed = counts - 65536 if counts & UNAVAILABLE else counts
        is_known = counts in (0, self._known) or any(not abs(signed - one) > 1.0 for _, one in self._written)
        if not is_known:
            self._observer.complain("I7", f"{0.01 * signed:.2f} N are requested, which nobody has written", at_s)
        self._known = counts

    def _judge_owner(self, owner: int, at_s: float) -> None:
        """Where one owns the setpoint before and after, and nobody has taken over or let go between, nobody else enables."""
        commands = [one for one in self._commands if one[0] <= at_s]
        self._commands = self._commands[len(commands) :]
        was, self._owner = self._owner, owner
        if not was == owner > LARGEST_PLACE or any(
            control & TAKE or not control & ENABLED_BIT for _, _, control in commands
        ):
            return
        for command_s, host, control in commands:
            if host and int(ip_address(host)) != owner and self._last_s + MARGIN_S < command_s < at_s - MARGIN_S:
                self._observer.complain("I4", f"{host} commands {control:#x}, owner is {ip_address(owner)}", at_s)

    def _judge_state(self, words: tuple[int, ...], at_s: float) -> None:
        if bool(words[0] & FAULT_BIT) != (words[1] == FAULT):
            self._observer.complain("I10", f"status word {words[0]:#x} in state {words[1]}", at_s)
        if words[0] & ENABLED_BIT and words[1] in (0, FAULT):
            self._observer.complain("I10", f"enabled in state {words[1]}", at_s)

    def _judge_age(self, age_ms: int, at_s: float) -> None:
        """No sample is younger than the last byte that has come. What is read first after a standstill is as it was before."""
        if not 0.09 < at_s - self._last_s < 0.11:
            return
        silent_s = at_s - self._heard_s()
        if age_ms < LONGEST_MS and age_ms * 1e-3 < silent_s - AGE_SLACK_S - 2.0 * self._observer.bounds.period_s:
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
