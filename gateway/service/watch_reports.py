"""Where control hears from the residual watch: a cause as a number, a sentence, and counters.

The watch is another process and may be wrong about everything: what it says is checked, changes one warning bit and one
status register, and never the control. What it said last stands until it says otherwise, and its age is readable.
"""

from collections.abc import Callable
from typing import Any, Final

from gateway.codes.warning_bits import WarningBit
from gateway.registers.residual_cause import ResidualCause
from gateway.service.running_rig.control_loop import ControlLoop, Log
from gateway.service.socket_requests import ResidualRequest, parse_request

Answer = dict[str, Any]
COUNTERS: Final = ("looks", "judged", "skipped", "cpu_s", "rms_n", "floor_n", "pause_s", "memory_mb")
"""Numbers that the watch may tell about itself; others are not kept."""
_LONGEST_SENTENCE: Final = 500
_LARGEST_COUNT: Final = 1.0e15


class WatchReports:
    """Called from the loop only. clock: monotonic seconds."""

    def __init__(self, loop: ControlLoop, clock: Callable[[], float], log: Log) -> None:
        self._loop = loop
        self._clock = clock
        self._log = log
        self._sentence = self._why_skipped = ""
        self._counters: dict[str, float] = {}
        self._warnings = 0
        self._heard_s: float | None = None
        self._plant = (0, 0.0)

    def follow_plant(self, number: int, since_s: float) -> None:
        """Note the plant in use, 0 the rig's own, for the watch to hear of; what was said of another one is no longer true."""
        self._plant = (number, since_s)
        self._hear_worse("")

    def answer(self, request: Answer) -> Answer:
        """Take the watch's report, or answer how it stands. ValueError refuses.
        {"cause": number, "sentence": text, "counters": {...}} reports; without a cause it is a question."""
        report = parse_request(ResidualRequest, request)
        if report.cause is not None:
            self._hear(report.cause, report)
        number, since_s = self._plant
        said = {"sentence": self._sentence, "why_skipped": self._why_skipped}
        return self.figures() | said | {"plant": number, "plant_since_s": since_s}

    def figures(self) -> Answer:
        """Return cause by number and name, how often a warning rose, the watch's counters, and the age of it all."""
        cause = self._loop.residual_cause
        age_s = None if self._heard_s is None else round(self._clock() - self._heard_s, 3)
        return {"cause": int(cause), "name": cause.effect, "warnings": self._warnings, "age_s": age_s} | self._counters

    def _hear(self, number: int, report: ResidualRequest) -> None:
        if number not in set(ResidualCause):
            raise ValueError(f"cause = {number}: a number of residual_cause is expected")
        self._counters = _numbers(report.counters)
        self._heard_s = self._clock()
        cause, before = ResidualCause(number), self._loop.residual_cause
        self._sentence, self._why_skipped = (text[:_LONGEST_SENTENCE] for text in (report.sentence, report.why_skipped))
        if cause is not before:
            self._change(cause)
        self._hear_worse(report.worse[:_LONGEST_SENTENCE])

    def _hear_worse(self, sentence: str) -> None:
        """Warn while the plant in use makes the force worse; each change is told once."""
        loop, bit = self._loop, WarningBit.COMPENSATION_WORSE
        if bool(sentence) == bool(loop.warnings.bits & bit):
            return
        loop.warnings.bits = loop.warnings.bits | bit if sentence else loop.warnings.bits & ~bit
        self._log(
            "compensation", f"A347 {sentence}" if sentence else "the force is no worse than before the plant in use"
        )
        loop.refresh()

    def _change(self, cause: ResidualCause) -> None:
        loop = self._loop
        was_none, loop.residual_cause = loop.residual_cause is ResidualCause.NONE, cause
        if cause is ResidualCause.NONE:
            loop.warnings.bits &= ~WarningBit.MODEL_DIFFERS
            self._log("residual", self._sentence or "the model agrees with the measurements again")
        else:
            loop.warnings.bits |= WarningBit.MODEL_DIFFERS
            self._warnings += was_none
            self._log("residual", f"A345 {self._sentence or cause.effect}")
        loop.refresh()


def _numbers(counters: dict[str, Any]) -> dict[str, float]:
    """Return the known counters that are finite numbers."""
    return {name: counters[name] for name in COUNTERS if _is_number(counters.get(name))}


def _is_number(value: Any) -> bool:
    """No bool, and no integer beyond what a float carries, which isfinite does not take."""
    return type(value) in (int, float) and abs(value) < _LARGEST_COUNT
