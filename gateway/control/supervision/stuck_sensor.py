"""Find a load cell that repeats one value, bit for bit, while its frames go on.

Two ways to tell. While the force changes: since the value last changed, the rising branch (the least force a voltage can
leave) has somewhere been above the falling branch (the most it can leave) of another time, by more than five quanta. That is
friction-proof; a single number would trip on every small reversal, where friction really holds the force. It must have been so
for a good part of frozen_s: the model begins to move with the voltage, the machine a dead time later, and a quiet cell has
repeated itself for long before. Only in contact, and where the output device measures no lack of air: in free air, or without
any, a quiet cell rightly repeats itself. While the force stands still: more equal samples than the cell's own noise allows
(repeated_readings), or than the rig says (frozen_equal_samples).
"""

from math import ceil, inf
from typing import Final

from gateway.control.sample_conditioning import Reading
from gateway.control.settings import Supervision
from gateway.control.supervision.plausibility import ExpectedForce
from gateway.control.supervision.repeated_readings import RepeatedReadings

_QUANTA: Final = 5.0
SLOW_S: Final = 2.0
"""From which on it is said how late a frozen cell would be found."""
_DEAD_SHARE: Final = 0.6  # of frozen_s, 0.3 s of 0.5: who answers a voltage as late as that has measured it
_WIDER_LOOP: Final = 0.5  # friction may have grown by this share of the loop since the calibration


class StuckSensorCheck:
    """Fed with every reading; ask for `words` after each."""

    def __init__(self, supervision: Supervision) -> None:
        self._frozen_s = supervision.frozen_s
        self._dead_s = _DEAD_SHARE * self._frozen_s
        self._least_change_n = _QUANTA * supervision.sample_quantum_n
        self._reported_limit = supervision.frozen_equal_samples
        self._noise = RepeatedReadings()
        self._value_n = inf
        self._slack_n = self._answer_s = self._airless_s = 0.0
        self._equal, self._equal_s, self._earlier, self._earlier_s = 1, 0.0, 0, 0.0
        self.start()

    def expect_noise(self, noise_n: float) -> None:
        """Begin with the noise of the calibration in use, N; 0: not known."""
        self._noise.expect(noise_n)

    def start(self) -> None:
        """Begin a new enable: the model's moves before do not count, and equal samples only where the cell stays dead for
        SLOW_S more. One that is quiet in free air has moved until then."""
        self._earlier += self._equal
        self._earlier_s += self._equal_s
        self._equal, self._equal_s = 1, 0.0
        self._watch_model()

    def _watch_model(self) -> None:
        self._same_s = self._moved_s = 0.0
        self._least_n, self._most_n = -inf, inf

    def observe(self, reading: Reading, response: ExpectedForce, touching: bool) -> None:
        """Judge one new reading."""
        if reading.is_usable:
            self._noise.observe(reading.raw_n, reading.interval_s, touching)
        if reading.raw_n != self._value_n:
            self._value_n = reading.raw_n
            self.start()
            self._earlier, self._earlier_s = 0, 0.0
        else:
            self._equal += 1
            self._equal_s += reading.interval_s
            self._same_s += reading.interval_s
        if not touching:
            self._watch_model()
        self._slack_n, self._answer_s = _WIDER_LOOP * response.width_n, response.lag_s
        least_n, most_n = response.bounds_n()
        self._least_n = max(self._least_n, least_n + response.outside_n)
        self._most_n = min(self._most_n, most_n + response.outside_n)
        self._airless_s = self._airless_s + reading.interval_s if response.lacks_air else 0.0
        if self._airless_s >= self._dead_s:  # a pressure that rises comes behind its voltage, too
            self._moved_s = 0.0
        elif self._least_n - self._most_n > self._least_change_n + self._slack_n:  # the force must have moved
            self._moved_s += reading.interval_s

    @property
    def words(self) -> str:
        """Observation and why it cannot be, empty for a cell that may be alive."""
        if self._same_s >= self._frozen_s and self._moved_s >= max(self._dead_s, self._answer_s):
            return f"repeated for {self._same_s:.2f} s while the force must have changed"
        if self._reported_limit is not None or self._equal_s >= self._frozen_s:
            return self.repeats or self._repeats_since_earlier
        return ""

    @property
    def _repeats_since_earlier(self) -> str:
        is_dead = self._equal_s >= SLOW_S and self._earlier + self._equal >= self._noise.limit
        if self._reported_limit is not None or not is_dead:
            return ""
        return f"repeated for {self._earlier_s + self._equal_s:.0f} s, since before the enable"

    @property
    def repeats(self) -> str:
        """Observation of more equal samples than a living cell gives, after however short a time; empty for fewer."""
        if self._reported_limit is not None:
            is_over = self._equal > self._reported_limit
            return f"{self._counted}, allowed {self._reported_limit} (frozen_equal_samples)" if is_over else ""
        if self._equal >= self._noise.limit:
            return f"{self._counted}, while its noise has left at most {self._noise.longest} equal so far"
        return ""

    @property
    def _counted(self) -> str:
        return f"repeated for {self._equal_s:.2f} s, {self._equal} samples bit for bit"

    @property
    def found_s(self) -> float:
        """Time, s, that a cell which freezes now repeats itself, the force at rest, until it is called frozen; inf: never."""
        limit = self._noise.limit if self._reported_limit is None else self._reported_limit
        if limit == inf:
            return inf
        return max(self._frozen_s, (ceil(limit) - 1) * self._noise.interval_s)  # the first of them was alive

    @property
    def slow_words(self) -> str:
        """W234, empty where a frozen cell is found within SLOW_S."""
        if self.found_s <= SLOW_S:
            return ""
        noise = self._noise
        when = f"after {self.found_s:.1f} s" if self.found_s < inf else "never"
        noise_text = (
            f"{noise.counts:.2f} counts of {noise.count_n:.3g} N" if noise.counts > 0.0 else "less than it can tell"
        )
        return (
            f"W234 while the force stands still a frozen load cell would be found {when}: its noise is {noise_text} at "
            f"{1.0 / noise.interval_s:.0f} samples/s; set a finer count, a faster rate or less filter on the amplifier"
        )

    def note_trip(self) -> None:
        """Note that the fault is told: these equal samples are not learned from."""
        self._noise.forget_run()
