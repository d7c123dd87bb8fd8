"""Whether a master's lease is renewed by what renews it: a heartbeat that changes, an enable's rise, or a takeover, once until
its master beats. Frames that flow with one and the same heartbeat, reads and refused writes renew nothing. No code of the
gateway is used here."""

from math import inf, isnan, nan

from tests.simulation.judges.observer import DOWN_S, RUN_BITS, Observer
from tests.simulation.masters.spelling import BEAT, BITS, ENABLE, control_of, word_of, written_address
from tests.simulation.masters.tcp_master import TAKE

REPEATED_S = 2.0
"""In which a frame that is sent on and on comes again: who waits for three seconds has looked."""
ON_WIRE_S = 0.04
"""20 ms, and two sentences at 9600 baud."""


Frame = tuple[str, int, int, int]


def frame_of(host: str, pdu: bytes) -> Frame:
    """What a master that writes in cycles has one of for each of its frames."""
    return host, pdu[0], written_address(pdu), len(pdu)


class LeaseJudge:
    """Told of each write of a master: in its order, before the observer is. holder: whose write was the last that left enable
    at 1, or may have by a single bit."""

    def __init__(self, observer: Observer) -> None:
        self._observer = observer
        self._beat = nan
        """What the register holds; not a number where nobody knows."""
        self._is_enabled = False
        """Whether the last write of the control word has enabled; not where that cannot be told from its bits."""
        self._renewed_s = -inf
        self._brought: dict[Frame, float] = {}
        """Of each master's frames the last heartbeat."""
        self._since_s: dict[Frame, float] = {}
        """Since when each of them brings that."""
        self._shown: dict[Frame, float] = {}
        """The same, of those that were refused, too."""
        self._took: set[str] = set()
        """Who has taken over, and has not beaten since."""
        self._refused: dict[str, tuple[bytes, float]] = {}
        """Of each master the start, its heartbeat in it, that was refused last, and when."""
        self.holder = ""
        self._is_ending = False
        self._turned_away: tuple[str, float] = "", -inf
        """Whose request was refused last, and when."""
        self._left: dict[Frame, float] = {}
        """What the frames of the holder brought when control died; nothing once any of them has brought another heartbeat."""

    def note_write(self, pdu: bytes, now_s: float, *, is_answered: bool, host: str = "") -> None:
        """A write was taken, or nobody knows whether it was. host: of its master."""
        beat, control = word_of(pdu, BEAT), control_of(pdu)
        was_off = self._observer.disabled_s is not None or not self._is_enabled
        takes = control is not None and bool(control & TAKE)
        begins = control is not None and (
            control < 0 or control & RUN_BITS or was_off or (takes and host not in self._took)
        )
        frame = frame_of(host, pdu)
        beats = beat is not None and (isnan(beat) or beat not in (self._beat, self._brought.get(frame)))
        if begins or not is_answered or beats:
            self._renewed_s = max(self._renewed_s, now_s)
        if beats:
            self._took.discard(host)
        if takes:
            self._took.add(host)
        if control is not None:
            self._is_enabled = is_answered and control > 0 and bool(control & ENABLE)
            self.holder = host if self._is_enabled or (is_answered and control == BITS) else ""
        if beat is not None:
            if beat != self._brought.get(frame):
                self._since_s[frame] = now_s
            self._beat = self._brought[frame] = beat if is_answered and not isnan(beat) else nan

    def note_start(self, pdu: bytes, now_s: float, *, is_taken: bool, host: str) -> None:
        """A request was answered: told before `note_write`. A start that was refused may begin nothing while it stays as it
        was, and none of its master's other frames has brought another heartbeat."""
        control, beat, frame = control_of(pdu), word_of(pdu, BEAT), frame_of(host, pdu)
        self._judge_left(frame, control, beat, now_s, is_taken=is_taken)
        if not is_taken:
            self._turned_away = host, now_s
            self._renew_at_end()
        if beat is not None and self._shown.get(frame) != beat:
            self._shown[frame] = beat
            if self._refused.get(host, (pdu, 0.0))[0] != pdu:
                del self._refused[host]
        if control is None or control <= 0 or not control & (ENABLE | RUN_BITS) or beat is None:
            return
        refused, refused_s = self._refused.pop(host, (b"", -inf))
        if not is_taken:
            self._refused[host] = pdu, now_s
            return
        is_again = pdu == refused and now_s - refused_s < REPEATED_S
        if is_again and self._observer.disabled_s is not None and self._observer.bounds.lease_s < inf:
            told = f"{host} began by {pdu.hex()}, which was refused {now_s - refused_s:.3f} s before"
            self._observer.complain("I7 repeated start", told, now_s)

    def _judge_left(
        self, frame: Frame, control: int | None, beat: float | None, now_s: float, *, is_taken: bool
    ) -> None:
        """Behind a death the holder's frames begin nothing as they stood, whichever comes first."""
        if not self._left:
            return
        left = self._left.get(frame) if beat is not None else None
        if frame[0] in {host for host, *_ in self._left} and (control == 0 or (beat is not None and beat != left)):
            self._left.clear()
        if left is None or left != beat or not is_taken or control is None or not control & ENABLE:
            return
        if self._observer.disabled_s is not None and self._observer.bounds.lease_s < inf:
            self._observer.complain("I7 left frame", f"{frame[0]} began by a frame of before the death", now_s)

    def note_ending(self) -> None:
        """The gateway is told to stop: on the way to 0 who is refused, or was just before, is there all the same."""
        self._is_ending = True
        self._renew_at_end()

    def _renew_at_end(self) -> None:
        host, refused_s = self._turned_away
        if self._is_ending and host == self.holder:
            self.renew(refused_s)
            self._observer.write_s = max(self._observer.write_s, refused_s)

    def forget(self, died_s: float, *, is_all: bool = False) -> None:
        """Another process does not know what was refused once, nor what each frame brought, but for what those of the holder
        had brought before the last tick, which tells of it; is_all: not of those either, for the guardian is another one."""
        told_s = died_s - 2.0 * self._observer.bounds.period_s
        left = {
            frame: beat
            for frame, beat in self._brought.items()
            if frame[0] == self.holder and self._since_s[frame] < told_s
        }
        self._left = {} if is_all else left or self._left
        self._is_ending, self._turned_away = False, ("", -inf)
        self._refused.clear()
        self._brought.clear()
        self._since_s.clear()
        self._shown.clear()

    def renew(self, now_s: float) -> None:
        """Who commands is there, as something else tells than a heartbeat that was taken."""
        self._renewed_s = max(self._renewed_s, now_s)

    def look(self, now_s: float) -> None:
        """Judge the voltage that stands now."""
        observer, bounds = self._observer, self._observer.bounds
        if observer.is_safe or observer.output_lost_s is not None or observer.control_lost_s is not None:
            return
        if not observer.is_answered_by(now_s):
            return
        is_down = observer.is_run or now_s - observer.run_ended_s < DOWN_S
        bound_s = (
            bounds.lease_s + max(bounds.lost_down_s, DOWN_S if is_down else 0.0) + 2.0 * bounds.period_s + ON_WIRE_S
        )
        if (
            observer.answers_lost_s is not None
            or now_s - observer.answer_spoiled_s < 2.0 * bounds.reply_timeout_s + 0.1
        ):
            bound_s += bounds.reply_timeout_s + 0.05
        if now_s - self._renewed_s > bound_s:
            told = f"{observer.voltage_v:.3f} V, {now_s - self._renewed_s:.3f} s behind the last heartbeat that changed"
            observer.complain("I3 heartbeat", told, now_s)
            self._renewed_s = now_s
