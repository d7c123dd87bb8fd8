"""What a control process leaves, through the guardian, to the one that is started when it dies, and a gateway that ends, in
its state directory, to the next one.

By itself a start knows only what it finds. By this:
- the recording goes on;
- a TLS face whose port is any free one (0) keeps it;
- a master that keeps the bit of a run at 1 begins no other run by that, and one that keeps enable at 1 over a latched fault, or
  with a heartbeat with which it was lost, or which it has written before, presses nothing, although fault and loss are
  forgotten (this alone behind the gateway's own end, too: a service is restarted by who wonders why the machine stands);
- a calibration or a plant that is another one now (their files are gone, say) is told, and so is a tare that is forgotten,
  until the next one: behind a second death it is missing as well.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from gateway.registers import RegisterBank
from gateway.service.running_rig.recording.wanted_recording import WantedRecording

_LEAST_TOLD_N: Final = 0.05
_OWN: Final = "the rig's own"
_HELD: Final[Mapping[str, Callable[[Any], bool]]] = {
    "held_runs": lambda bits: type(bits) is int,
    "held_enables": lambda held_s: type(held_s) is float,
    "lost_beats": lambda beats: type(beats) is list and all(type(beat) is int for beat in beats),
}


def left_of(kept: Mapping[str, Any]) -> dict[str, Any]:
    """Return what of this counts behind the gateway's own end, too: by which bits and heartbeats nothing begins. What is no
    such fact, whatever has become of its file, is left out."""
    facts = {name: kept[name] for name in _HELD if isinstance(kept.get(name), dict) and kept[name]}
    return {name: held for name, held in facts.items() if all(map(_HELD[name], held.values()))}


class Handover:
    """kept: each fact by its name, as the process before has told it last, empty for the first one; record: whether the first
    one records from its start."""

    def __init__(self, kept: Mapping[str, Any], *, record: bool) -> None:
        self._kept = kept
        self._record = record

    @property
    def tls_ports(self) -> dict[str, int]:
        """The port of each TLS face, by its place in `fieldbus`, as masters know it."""
        return dict(self._kept.get("tls_ports", {}))

    def restore_held(
        self, bank: RegisterBank, now_s: float, keep: Callable[..., None], left_beats: Sequence[int] | None = None
    ) -> None:
        """Let a bank go on with the bits that masters kept at 1, and leave those of its own time to the next process (keep).
        left_beats: heartbeats of who owned when the process before died; None: nobody knows."""
        bank.held_enables.on_lost = lambda lost: keep(lost_beats=lost)
        bank.held_runs.on_change = lambda held: keep(held_runs=held)
        bank.held_enables.on_change = lambda held: keep(held_enables=held)
        bank.held_runs.restore(self._kept.get("held_runs", {}))
        held, lost, owner = (self._kept.get(name) for name in ("held_enables", "lost_beats", "owner"))
        lost = dict(lost or {})
        if owner is not None and left_beats is not None:  # of another program on its host the one before may have told
            lost[owner] = [*lost.get(owner, ()), *left_beats]
        keep(owner=None)
        bank.held_enables.restore(held or {}, lost, now_s)

    def recording(self, now_s: float) -> WantedRecording | None:
        """Return what is to be recorded; None: nothing, or its time is over by now_s (monotonic)."""
        if "recording" not in self._kept:
            return WantedRecording() if self._record else None
        facts = self._kept["recording"]
        wanted = WantedRecording.from_facts(facts) if facts else None
        return None if wanted is None or wanted.is_over(now_s) else wanted

    @property
    def forgotten_zero_n(self) -> float:
        """Zero of a tare that counted before and is none any more, N: control has to doubt its own. 0 where there was none."""
        zero_n = float(self._kept.get("zero_n", 0.0))
        return zero_n if abs(zero_n) >= _LEAST_TOLD_N else 0.0

    def changes(self, **in_use: int) -> tuple[str, ...]:
        """Return W250 for each number in use that is not the one before, and for the zero of a tare. in_use: what is in use
        now, by its noun."""
        changed = tuple(
            f"W250 {noun} {before} was in use before the restart, now it is {number or _OWN}: see `force-gateway {noun} list`"
            for noun, number in in_use.items()
            if (before := self._kept.get(noun, number)) != number
        )
        if not (zero_n := self.forgotten_zero_n):
            return changed
        off = f"the cell reads {abs(zero_n):.2f} N {'more' if zero_n > 0.0 else 'less'} than before it"
        return (*changed, f"W250 the tare before the restart is forgotten, and {off}: tare again before you press")
