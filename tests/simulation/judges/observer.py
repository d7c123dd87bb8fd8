"""An observer beside the gateway, which shares no code with it: it hears the bytes on the output's wire, knows what was done to
the world, and reads the status registers as any master could. What it finds broken is a line of `broken`.

I1 range, I2 slew, I3 the safe voltage in time after the loss of cell, output, master or control and after over-force, I4 none
without an enable, I5 faults latch, I6 the safe voltage first, I7 whole sentences, I11 one first cause. What registers say
besides is judged by status_witness.py, command_witness.py and target_witness.py (I7, I8, I10), what renews a lease by
lease_judge.py and a load cell that lies by lying_cell.py (I3), I8 and roles (I7) by the masters, I9 by the integrator, I12 by
the log and the soak, I13 by the schedule.
"""

import re
import struct
from dataclasses import dataclass, field
from hashlib import sha256
from math import inf, nan
from typing import Any

from tests.simulation.judges.recording_judge import History

COUNT_V = 10.0 / 1023
FAULT = 4
STATUS_FIRST, STATUS_WORDS = 100, 20


@dataclass(frozen=True)
class Bounds:
    """What the rig's file says, and what the wire takes (`GRACE_S`, and two periods).
    lease_s: endless where a lost master's force is held; lost_down_s: how long it may take to ramp down; reply_timeout_s: how
    long an answer of the output is waited for, before anything else is sent."""

    voltage_max_v: float
    slew_v_per_s: float
    sample_timeout_s: float
    stall_s: float
    lease_s: float
    period_s: float
    lost_down_s: float = 0.0
    output_timeout_s: float = inf
    reply_timeout_s: float = 0.0
    over_force_n: float = 75.0
    safe_v: float = 0.0
    voltage_min_v: float = 0.0


ENABLE, RESET, RUN_BITS = 1, 2, 32 | 64
DOWN_S = 4.0  # a run's end, whoever ends it, is a ramp down that needs no master; it takes this long at the most
ORDER_S = 0.02  # by which the answer to an earlier write may come after that to a later one, on another wire
UNHEARD_S = 0.1  # so late a write may be taken whose master has hung up, or fallen silent on a bus
SENTENCE = re.compile(
    rb"(ST|US|OL),(?:GS|NT),([ +\-.0-9]{8})(kg| N|lb| g)\r\n"
)  # of the demo rig's cell; OL: beyond its range
SETTING, CUT_SETTING = re.compile(rb"()SET (\d+)"), re.compile(rb"(.*)SET (\d+)")
UNITS_N = {b"kg": 9.80665, b" N": 1.0, b" g": 9.80665e-3, b"lb": 4.4482216152605}
OVER_READINGS = 3  # in a row are over-force
ZERO_N = 8.0  # so far may the zero have been moved by somebody who has tared
GRACE_S = 0.04  # 20 ms, and two sentences on the wire; and two periods: a tick decides nothing within one of a command


@dataclass
class Observer:
    """settings: how many there were; the last came at setting_s; fingerprint: a digest of all of them."""

    bounds: Bounds
    broken: list[str] = field(default_factory=list)
    history: History = field(default_factory=History)
    settings: int = 0
    setting_s: float = 0.0
    voltage_v: float = 0.0
    largest_v: float = 0.0
    fingerprint: Any = field(default_factory=sha256)
    cell_lost_s: float | None = None
    cell_heard_s: float = 0.0
    cell_said_s: float = 0.0
    over_s: float | None = None
    answers_lost_s: float | None = None
    output_lost_s: float | None = None
    answer_spoiled_s: float = -inf
    control_lost_s: float | None = None
    write_s: float = 0.0
    disabled_s: float | None = 0.0
    is_run: bool = False
    run_ended_s: float = -DOWN_S
    _over: int = 0
    _line: bytes = b""
    _cell_line: bytes = b""
    _dropped: bytes = b""
    _is_cut: bool = True
    _must_be_safe: bool = True
    _begun_s: float = 0.0
    _pressing_s: float = 0.0
    _fault: int | None = None
    _fault_s: float = 0.0  # when it was read: over a standstill long before now
    _reset_s: float = -1.0
    _unheard_s: float = -1.0
    _enabled_s: float = -1.0

    # -- the wire

    def hear(self, chunk: bytes, now_s: float) -> None:
        """Bytes that have reached the output device."""
        *lines, self._line = (self._line + chunk).split(b"\r\n")
        for heard in lines:
            line = self._without_dropped(heard)
            if found := (CUT_SETTING if self._is_cut else SETTING).fullmatch(line):
                if line == heard:
                    self._note_setting(int(found[2]) * COUNT_V, now_s)
            elif line != b"MON" and not self._is_cut:
                self.complain("I7", f"{heard!r} is no sentence", now_s)
            self._is_cut = False

    def note_dropped(self, sent: bytes) -> None:
        """Its sender has forgotten the rest of a sentence of which this is on the wire: it stands before the next one, which
        the device then does not understand."""
        self._dropped += sent

    def _without_dropped(self, heard: bytes) -> bytes:
        dropped, self._dropped = self._dropped, b""
        return heard.removeprefix(dropped)

    @property
    def is_safe(self) -> bool:
        """Whether the safe voltage stands: less than it may drop a tool, too."""
        is_begun = self.settings or self.voltage_v
        return not is_begun or abs(self.voltage_v - self.bounds.safe_v) <= 0.6 * COUNT_V

    def hear_cell(self, chunk: bytes, now_s: float) -> None:
        """What has reached the gateway from its load cell, most often a sentence."""
        if not self.history.is_plain:
            self.history.readings.append((now_s, None))
            return
        *lines, self._cell_line = (self._cell_line + chunk).split(b"\n")
        for line in lines:
            self._hear_sentence(line + b"\n", now_s)

    def _hear_sentence(self, line: bytes, now_s: float) -> None:
        found = SENTENCE.search(line)
        if found:
            self.cell_said_s = now_s
        is_beyond = found is not None and found[1] == b"OL"
        force_n = _force_n(found) if found and not is_beyond else None
        self.history.readings.append((now_s, force_n))
        is_over = is_beyond or (force_n is not None and abs(force_n) >= self.bounds.over_force_n + ZERO_N)
        self._over = self._over + 1 if is_over else 0
        self.over_s = (self.over_s or now_s) if self._over >= OVER_READINGS else None

    def note_cut(self, until_s: float) -> None:
        """The sender was cut off, or the plug pulled: half a sentence may stand before the next, and the first that is begun
        now must be safe. until_s: what is on the wire already is through by then."""
        self.history.cuts.append(until_s)
        self._is_cut = self._must_be_safe = True
        self._begun_s, self._dropped = until_s, b""

    def note_mended(self) -> None:
        """The wire is whole again on which a device heard nothing. It stands where it stood: where that is the safe voltage it
        need not be said once more, for nobody may have noticed."""
        self._must_be_safe = self._must_be_safe and not self.is_safe

    def _note_setting(self, voltage_v: float, now_s: float) -> None:
        if not self.bounds.voltage_min_v - 0.6 * COUNT_V <= voltage_v <= self.bounds.voltage_max_v + COUNT_V:
            self.complain("I1", f"{voltage_v:.3f} V", now_s)
        if self._must_be_safe and now_s > self._begun_s:
            if abs(voltage_v - self.bounds.safe_v) > 0.6 * COUNT_V:
                self.complain("I6", f"{voltage_v:.3f} V comes first", now_s)
            self._must_be_safe = False
        before_s, before_v, was_safe = self.setting_s, self.voltage_v, self.is_safe
        allowed_v = self.bounds.slew_v_per_s * (now_s - before_s + 0.02) + COUNT_V
        if self.settings and voltage_v - before_v > allowed_v + 1e-9:
            self.complain("I2", f"{before_v:.3f} -> {voltage_v:.3f} V in {now_s - before_s:.4f} s", now_s)
        self.history.settings.append((now_s, voltage_v))
        self.setting_s, self.voltage_v, self.largest_v = now_s, voltage_v, max(self.largest_v, voltage_v)
        if was_safe and not self.is_safe:
            self._pressing_s = now_s
        self.settings += 1
        self.fingerprint.update(f"{now_s:.6f} {voltage_v:.4f}\n".encode())

    # -- what is known of the world and of masters

    def note_accepted(self, control: int | None, now_s: float) -> None:
        """A write was taken. control: the control word in it; -1: bits of it were changed in a way that is not followed."""
        self.write_s = now_s
        if control is None:
            return
        if control != -1:
            if self.is_run and not control & RUN_BITS:
                self.run_ended_s = now_s
            self.is_run = bool(control & RUN_BITS)
        if control == -1 or self.is_run or control & ENABLE:
            self.disabled_s, self._enabled_s = None, now_s
        elif self.disabled_s is None:
            is_last = now_s - self._unheard_s >= UNHEARD_S and now_s - self._enabled_s >= ORDER_S
            self.disabled_s = now_s if is_last else self._lease_end_s(now_s)
        if control & RESET:
            self._reset_s = now_s

    def _lease_end_s(self, now_s: float) -> float | None:
        """When who perhaps presses must have stopped; None for never."""
        until_s = max(self.disabled_s or 0.0, now_s + self.bounds.lease_s + self.bounds.lost_down_s)
        return None if until_s == inf else until_s

    def note_unanswered(self, control: int | None, now_s: float) -> None:
        """A master has hung up before it heard whether its write was taken: it may press until its lease has run out, if
        it ever does."""
        self.write_s = now_s
        if control is None:
            return
        if control & (ENABLE | RUN_BITS):
            self._unheard_s = now_s
            if self.disabled_s is not None:
                self.disabled_s = self._lease_end_s(now_s)
        if control & RESET:
            self._reset_s = now_s

    def note_status(self, pdu: bytes, now_s: float) -> None:
        """The status block, as a master has read it."""
        words = struct.unpack(f">{STATUS_WORDS}H", pdu[2:])
        state, fault = words[1], words[10]
        if state == FAULT and not fault:
            self.complain("I11", "a fault without a cause", now_s)
        if self._fault and self._fault_s - self._reset_s > 0.2:
            if state != FAULT:
                self.complain("I5", f"fault {self._fault} is gone without a reset", now_s)
            elif fault != self._fault:
                self.complain("I11", f"fault {self._fault} became {fault}", now_s)
        self._fault, self._fault_s = (
            fault if state == FAULT else None,
            now_s,
        )  # in OFF it says why control was started again

    def note_death(self, now_s: float, until_s: float) -> None:
        """Control has died: the next one begins in OFF, and shows why it was started. until_s: as in `note_cut`."""
        self._fault = None
        self.note_disabled(now_s)
        self.note_cut(until_s)

    def note_disabled(self, now_s: float) -> None:
        """Nobody may press from now on, nor go down slowly."""
        is_going_down = self.is_run or now_s - self.run_ended_s < DOWN_S
        self.is_run, self.run_ended_s = False, now_s - DOWN_S
        if self.disabled_s is None or is_going_down:
            self.disabled_s = now_s

    def is_answered_by(self, now_s: float) -> bool:
        """Whether the answer to the write that began the pressing must have come."""
        return now_s - self._pressing_s > GRACE_S

    def note_serving(self, now_s: float) -> None:
        """Control is there; a moment later it is judged again by what it has heard."""
        if self.control_lost_s is not None and now_s - self.control_lost_s > self._grace_s:
            self.control_lost_s = None

    @property
    def _grace_s(self) -> float:
        return GRACE_S + 2.0 * self.bounds.period_s

    def look(self, now_s: float) -> None:
        """Judge the voltage that stands now."""
        if self.is_safe or self.output_lost_s is not None:
            return
        standing_s = now_s - self.setting_s
        down_s = DOWN_S if self.is_run or now_s - self.run_ended_s < DOWN_S else 0.0
        grace_s = self._grace_s
        is_unanswered = self.answers_lost_s is not None
        if is_unanswered or now_s - self.answer_spoiled_s <= self.bounds.reply_timeout_s + grace_s:
            grace_s += self.bounds.reply_timeout_s  # for nothing: it was lost, or late
        limits = (
            ("I3 cell", self.cell_lost_s, self.bounds.sample_timeout_s),
            ("I3 cell unheard", self.cell_heard_s, self.bounds.sample_timeout_s),
            ("I3 over-force", self.over_s, 0.0),
            ("I3 output", self.answers_lost_s, self.bounds.output_timeout_s),
            ("I3 control", self.control_lost_s, self.bounds.stall_s),
            ("I3 master", self.write_s, self.bounds.lease_s + max(down_s, self.bounds.lost_down_s)),
            ("I4", self.disabled_s, down_s),
        )
        for law, since_s, bound_s in limits:
            if since_s is None or now_s - since_s <= bound_s + grace_s:
                continue
            if self.control_lost_s is not None and law != "I3 control":
                continue  # who stands still hears nothing: then it is the guardian's turn, within its own bound
            if law not in ("I4", "I3 master") or self.is_answered_by(now_s):
                self.complain(
                    law, f"{self.voltage_v:.3f} V for {standing_s:.3f} s, {now_s - since_s:.3f} s after", now_s
                )

    def complain(self, law: str, words: str, now_s: float) -> None:
        if len(self.broken) < 20:
            self.broken.append(f"{law} at {now_s:.4f}: {words}")


def _force_n(found: re.Match[bytes]) -> float:
    try:
        number = float(found[2].replace(b" ", b""))
    except ValueError:
        return nan
    return number * UNITS_N[found[3]]
