"""Whether a load cell that lies is found while a force is held by it: one that repeats itself though the voltage has risen, one
whose sign is turned, and one that shows many times the force, or hardly any. No code of the gateway is used here.
"""

from collections.abc import Mapping
from math import inf
from typing import Any

from tests.simulation.judges.observer import Observer

RISEN_V = 3.0
"""More than any friction hides."""
FROZEN_S, FALSE_S = 1.2, 1.3
"""0.5 s of equal readings, of which the force must have moved in 0.3 s behind a dead time; and 1 s."""
TOUCHES_N = 10.0
LEAVES_S = 1.0
"""So long what pressed before may still press: a voltage that has just fallen and risen again need have moved nothing."""
SMALL, LARGE = 0.2, 4.0
"""Shares of the true force that are told from 1 whatever the friction."""


class LyingCell:
    """is_driving: somebody has asked for a voltage, which is not held by the cell."""

    is_driving = False
    _lowest_v = _false_s = _risen_s = 0.0
    _was_false = _was_frozen = False

    def __init__(self, observer: Observer) -> None:
        self._observer = observer

    def note_mode(self, mode: float | None) -> None:
        """A write was taken. mode: what it says of it, None for nothing."""
        if mode is not None:
            self.is_driving = mode != 0.0

    def look(self, settings: Mapping[str, Any], now_s: float, *, is_whole: bool) -> None:
        """Judge the voltage that stands now. is_whole: whether wires and machine are."""
        observer = self._observer
        is_judged = is_whole and not (observer.is_safe or observer.is_run or self.is_driving)
        if not is_judged or len(settings) != 1:  # of a frozen cell another scale is another reading
            self._was_false = self._was_frozen = False
        else:
            self._judge_frozen(frozenset(settings), now_s)
            self._judge_false(settings, now_s)

    def _judge_frozen(self, names: frozenset[str], now_s: float) -> None:
        voltage_v = self._observer.voltage_v
        was_frozen, self._was_frozen = self._was_frozen, "cell.frozen" in names
        if not self._was_frozen or not was_frozen:
            self._lowest_v, self._risen_s = inf, now_s
            return
        self._lowest_v = min(self._lowest_v, self._highest_lately_v(now_s))
        if voltage_v - self._lowest_v < RISEN_V or not self._touches:
            self._risen_s = now_s
        if now_s - self._risen_s > FROZEN_S:
            told = f"{self._lowest_v:.2f} -> {voltage_v:.2f} V, and it reads the same"
            self._observer.complain("I3 frozen", told, now_s)
            self._risen_s = now_s

    def _highest_lately_v(self, now_s: float) -> float:
        highest_v = self._observer.voltage_v
        for set_s, voltage_v in reversed(self._observer.history.settings):
            highest_v = max(highest_v, voltage_v)
            if now_s - set_s >= LEAVES_S:  # it stood until the next one
                break
        return highest_v

    @property
    def _touches(self) -> bool:
        readings = self._observer.history.readings
        return bool(readings) and abs(readings[-1][1] or 0.0) > TOUCHES_N

    def _judge_false(self, settings: Mapping[str, Any], now_s: float) -> None:
        scale = float(settings.get("cell.scale", 1.0))
        is_false = bool(settings.get("cell.inverted")) or not SMALL < scale < LARGE
        was_false, self._was_false = self._was_false, is_false
        if not (is_false and was_false) or self._observer.voltage_v < RISEN_V:
            self._false_s = now_s
        if now_s - self._false_s > FALSE_S:
            self._observer.complain("I3 false cell", f"{self._observer.voltage_v:.2f} V by {dict(settings)}", now_s)
            self._false_s = now_s
