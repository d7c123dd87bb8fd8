"""Detect contact: a threshold with hysteresis in force and in time: two samples make contact, 0.1 s and two samples below
half the threshold end it.

The release waits because a fast unloading undershoots; the onset does not, because the force must not stay at the
pre-contact force longer than it has to. One sample alone is neither: of a cell of 10 Hz it already stands for 0.1 s.
"""

from typing import Final

from gateway.control.sample_conditioning import Reading

_SAMPLES: Final = 2  # one alone may be a spike
_RELEASE_S: Final = 0.1  # longer than the undershoot of a fast unloading
_RELEASE_SHARE: Final = 0.5  # of the threshold: the hysteresis


class ContactDetector:
    """threshold_n: contact force from which the tool counts as touching (rig default contact_threshold_n)."""

    def __init__(self, threshold_n: float) -> None:
        self._touch_n = threshold_n
        self._release_n = threshold_n * _RELEASE_SHARE
        self.restart()

    def restart(self) -> None:
        """Begin without contact: what was read before counted from another zero."""
        self.touching = False
        self._above = self._below = 0
        self._below_s = 0.0

    def update(self, reading: Reading) -> bool:
        """Decide whether the tool is in contact. Only new, usable samples count; an overload changes nothing."""
        if reading.is_new and reading.is_usable:
            self._count(reading.contact_n, reading.interval_s)
        return self.touching

    def _count(self, contact_n: float, interval_s: float) -> None:
        self._above = self._above + 1 if contact_n >= self._touch_n else 0
        is_below = contact_n < self._release_n
        self._below = self._below + 1 if is_below else 0
        self._below_s = self._below_s + interval_s if is_below else 0.0
        if self._above >= _SAMPLES:
            self.touching = True
        elif self._below >= _SAMPLES and self._below_s >= _RELEASE_S:
            self.touching = False
