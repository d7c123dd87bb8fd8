"""What the host of a virtual machine takes from its processors, as /proc/stat counts it, and what is said of a loop then."""

from pathlib import Path

import pytest

from gateway.processes.exit_cause import EndCause
from gateway.processes.scheduler_counters import ProcessorTime, Silence, StolenTime, explain_silence

LINES = "cpu  9 0 9 9 0 0 0 {} 0 0\ncpu0 5 0 5 5 0 0 0 {} 0 0\ncpu1 4 0 4 4 0 0 0 {} 0 0\nintr 33 {} 0 0\n"


class Host:
    """Of a machine of two processors; takes ticks of ten milliseconds."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "stat"
        self.taken = [700, 41]
        self.take(0, 0)
        self.counter = StolenTime(folder)

    def take(self, *ticks: int) -> None:
        self.taken = [had + more for had, more in zip(self.taken, ticks, strict=True)]
        self.file.write_text(LINES.format(sum(self.taken), *self.taken, 12345))


@pytest.fixture
def host(tmp_path: Path) -> Host:
    return Host(tmp_path)


def test_the_processor_that_was_away_longest_counts_and_what_was_before_does_not(host: Host) -> None:
    host.counter.note(100.0)
    assert host.counter.lately_s() == 0.0
    host.take(3, 10)
    assert host.counter.lately_s() == pytest.approx(0.1), "not the 130 ms of both"
    host.counter.note(101.0)
    assert host.counter.lately_s() == pytest.approx(0.1), "the loop has just gone on, and is asked now"
    host.counter.note(102.0)
    assert host.counter.lately_s() == 0.0


def test_the_kernel_is_asked_once_a_second(host: Host) -> None:
    for tick in range(150):
        host.counter.note(100.0 + 0.01 * tick)
        host.take(0, 1)
    assert host.counter.lately_s() == pytest.approx(1.5), "since the first of them"


@pytest.mark.parametrize("text", [None, "", "cpu0 1 2 3\n", "cpu0 a b c d e f g h\n"])
def test_a_kernel_that_counts_none_is_no_error(tmp_path: Path, text: str | None) -> None:
    if text is not None:
        (tmp_path / "stat").write_text(text)
    counter = StolenTime(tmp_path)
    counter.note(100.0)
    assert counter.lately_s() == 0.0


@pytest.mark.parametrize(("stolen_s", "cause"), [(0.1, EndCause.MACHINE_BUSY), (0.05, EndCause.STALLED)])
def test_a_loop_whose_processor_was_taken_has_not_slept_of_its_own(stolen_s: float, cause: EndCause) -> None:
    """In its own counters it did: 98 of 101 ms, and the line said that the machine's load was not to blame."""
    silence = Silence(0.101, 0.1, ProcessorTime(0.003, 0.0), "S", was_late=True, stolen_s=stolen_s)
    ending = explain_silence(silence, "load 3.59 on 2 cores")
    assert ending.cause is cause
    assert ("the host of this virtual machine kept a processor away for 100 ms" in ending.text) is (stolen_s == 0.1)
    assert ("not the machine's load" in ending.text) is (stolen_s != 0.1)
