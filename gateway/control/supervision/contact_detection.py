"""Detect contact: a threshold with hysteresis in force and in time: two samples make contact, 0.1 s below half the
threshold ends it.

The release waits because a fast unloading undershoots; the onset does not, because the force must not stay at the
pre-contact force longer than it has to.
"""

from typing import Final

from gateway.control.sample_conditioning import Reading

_SAMPLES_TO_TOUCH: Final = 2  # one alone may be a spike
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
        self._above = 0
        self._below_s = 0.0

    def update(self, reading: Reading) -> bool:
        """Decide whether the tool is in contact. Only new, usable samples count; an overload changes nothing."""
        if reading.is_new and reading.is_usable:
            self._count(reading.contact_n, reading.interval_s)
        return self.touching

    def _count(self, contact_n: float, interval_s: float) -> None:
        self._above = self._above + 1 if contact_n >= self._touch_n else 0
        self._below_s = self._below_s + interval_s if contact_n < self._release_n else 0.0
        if self._above >= _SAMPLES_TO_TOUCH:
            self.touching = True
        elif self._below_s >= _RELEASE_S:
            self.touching = False
