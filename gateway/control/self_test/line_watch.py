"""What both serial lines did while a self-test ran."""

from copy import copy

from gateway.control.inputs import LineStatus, WireCounts
from gateway.control.self_test import judgement
from gateway.control.self_test.items import Finding
from gateway.control.self_test.judgement import Known
from gateway.control.self_test.measurements import intervals_of


class LineWatch:
    """Counts from the first line that it is shown. pressure_pa: of now, nan where the output device measures none."""

    def __init__(self) -> None:
        self._before: tuple[WireCounts | None, WireCounts | None] | None = None
        self._line = LineStatus()
        self._slowest_s = 0.0
        self._times_s: list[float] = []
        self._beside: list[int] = []
        self._heard = 0

    @property
    def pressure_pa(self) -> float:
        """Pressure that the output device measures, Pa."""
        return self._line.pressure_pa

    def observe(self, line: LineStatus) -> None:
        """Take in what the lines have counted; before each step."""
        if self._before is None:
            self._before = copy(line.output_counts), copy(line.cell_counts)
        self._line = line
        if line.wire_s == line.wire_s:
            self._slowest_s = max(self._slowest_s, line.wire_s)

    def note_reading(self, at_s: float) -> None:
        """Note the time of a usable reading."""
        counts = self._line.cell_counts
        before, self._heard = self._heard, counts.heard if counts else 0
        self._times_s.append(at_s)
        self._beside.append(max(0, self._heard - before - 1))

    def findings(self, known: Known, elapsed_s: float) -> tuple[Finding, ...]:
        """Return the verdicts on both lines. elapsed_s: for which the test has run."""
        outputs, cells = self._before or (None, None)
        now = self._line
        counted = now.output_counts.since(outputs) if now.output_counts and outputs else None
        heard = now.cell_counts.since(cells) if now.cell_counts and cells else None
        return (
            judgement.judge_output_line(counted, self._slowest_s, known),
            judgement.judge_cell_line(intervals_of(self._times_s, self._beside), heard, known, elapsed_s),
        )
