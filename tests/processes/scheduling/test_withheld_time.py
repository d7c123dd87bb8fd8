"""What a host or a quota withholds, as the kernel counts it, and what is said of a loop then."""

from pathlib import Path

import pytest

from gateway.processes.exit_cause import EndCause
from gateway.processes.scheduling.scheduler_counters import ProcessorTime, Silence, explain_silence
from gateway.processes.scheduling.withheld_time import WithheldTime

LINES = "cpu  9 0 9 9 0 0 0 {} 0 0\ncpu0 5 0 5 5 0 0 0 {} 0 0\ncpu1 4 0 4 4 0 0 0 {} 0 0\nintr 33 {} 0 0\n"


class Machine:
    """Of two processors, whose host takes ticks of ten milliseconds."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.taken = folder, [700, 41]
        (folder / "self").mkdir()
        self.take(0, 0)

    def take(self, *ticks: int) -> None:
        self.taken = [had + more for had, more in zip(self.taken, ticks, strict=True)]
        (self.folder / "stat").write_text(LINES.format(sum(self.taken), *self.taken, 12345))

    def groups(self, *lines: str) -> None:
        (self.folder / "self" / "cgroup").write_text("\n".join(lines) + "\n")

    def throttle(self, group: str, text: str) -> None:
        place = self.folder / "cgroup" / group
        place.mkdir(parents=True, exist_ok=True)
        (place / "cpu.stat").write_text(f"usage_usec 9\nnr_periods 7\n{text}\n")

    def counter(self) -> WithheldTime:
        return WithheldTime(self.folder, self.folder / "cgroup")


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def test_the_processor_that_was_away_longest_counts_and_what_was_before_does_not(machine: Machine) -> None:
    counter = machine.counter()
    counter.note(100.0)
    assert counter.lately()[0] == 0.0
    machine.take(3, 10)
    withheld_s, words = counter.lately()
    assert withheld_s == pytest.approx(0.1), "not the 130 ms of both"
    assert "host of this virtual machine kept a processor away for 100 ms" in words
    counter.note(101.0)
    assert counter.lately()[0] == pytest.approx(0.1), "the loop has just gone on, and is asked now"
    counter.note(102.0)
    assert counter.lately()[0] == 0.0


def test_a_processor_that_is_taken_out_or_put_in_meanwhile_has_taken_nothing_from_the_others(machine: Machine) -> None:
    """`echo 0 > /sys/devices/system/cpu/cpu1/online`: its line is gone then, and the next one stands in its place."""
    stat = machine.folder / "stat"
    all_three = "cpu0 5 0 5 5 0 0 0 700 0 0\ncpu1 4 0 4 4 0 0 0 41 0 0\ncpu2 4 0 4 4 0 0 0 {} 0 0\n"
    stat.write_text(all_three.format(900))
    counter = machine.counter()
    stat.write_text("".join(line for line in all_three.format(905).splitlines(True) if "cpu1" not in line))
    assert counter.lately()[0] == pytest.approx(0.05), "not the 8.64 s by which cpu2 is ahead of cpu1"
    counter.note(100.0)
    counter.note(101.0)
    stat.write_text(all_three.format(905))
    assert counter.lately()[0] == 0.0


def test_the_kernel_is_asked_once_a_second(machine: Machine) -> None:
    counter = machine.counter()
    for tick in range(150):
        counter.note(100.0 + 0.01 * tick)
        machine.take(0, 1)
    assert counter.lately()[0] == pytest.approx(1.5), "since the first of them"


@pytest.mark.parametrize(
    ("line", "group", "text"),
    [
        ("0::/", ".", "throttled_usec {}"),
        ("0::/system.slice/gateway.service", "system.slice/gateway.service", "throttled_usec {}"),
        ("0::/system.slice/gateway.service", "system.slice", "throttled_usec {}"),
        ("5:cpu,cpuacct:/docker/7f", "cpu/docker/7f", "throttled_time {}000"),
        ("5:cpu:/docker/7f", "cpu", "throttled_time {}000"),
    ],
)
def test_a_quota_of_any_group_that_we_are_in_counts(machine: Machine, line: str, group: str, text: str) -> None:
    """In a container without a namespace of its own the path is the host's, and what lies at the root is its own."""
    machine.groups("12:memory:/other", line)
    machine.throttle(group, text.format(5_000_000))
    machine.throttle("another.slice", "throttled_usec 1")
    counter = machine.counter()
    counter.note(100.0)
    machine.take(1, 2)
    machine.throttle(group, text.format(5_090_000))
    machine.throttle("another.slice", "throttled_usec 9000000")
    withheld_s, words = counter.lately()
    assert withheld_s == pytest.approx(0.09)
    assert "CPU quota of our container or service withheld 90 ms" in words


@pytest.mark.parametrize("text", [None, "", "cpu0 1 2 3\n", "cpu0 a b c d e f g h i\n"])
def test_a_kernel_that_counts_none_is_no_error(tmp_path: Path, text: str | None) -> None:
    if text is not None:
        (tmp_path / "stat").write_text(text)
    counter = WithheldTime(tmp_path, tmp_path)
    counter.note(100.0)
    assert counter.lately()[0] == 0.0


def test_a_group_of_any_name_and_a_file_that_is_away_for_once_withhold_nothing(machine: Machine) -> None:
    """Neither may keep a gateway from starting, or be told as hours that somebody withheld."""
    (machine.folder / "self" / "cgroup").write_bytes(b"\nx\n0::/a\xff\n")
    machine.throttle(".", "throttled_usec 3600000000")
    counter = machine.counter()
    counter.note(100.0)
    (machine.folder / "cgroup" / "cpu.stat").rename(machine.folder / "away")
    counter.note(101.0)
    counter.note(102.0)
    (machine.folder / "away").rename(machine.folder / "cgroup" / "cpu.stat")
    assert counter.lately()[0] == 0.0


@pytest.mark.parametrize(("withheld_s", "cause"), [(0.1, EndCause.MACHINE_BUSY), (0.05, EndCause.STALLED)])
def test_a_loop_whose_processor_was_taken_has_not_slept_of_its_own(withheld_s: float, cause: EndCause) -> None:
    """In its own counters it did: 98 of 101 ms, and the line said that the machine's load was not to blame."""
    silence = Silence(0.101, 0.1, ProcessorTime(0.003, 0.0), "S", True, (withheld_s, "the host took it"))
    ending = explain_silence(silence, "load 3.59 on 2 cores")
    assert ending.cause is cause
    assert "the host took it" in ending.text and "not the machine's load" not in ending.text


@pytest.mark.parametrize(
    ("state", "ran_s", "withheld_s", "was_late", "words"),
    [
        ("S", 0.003, 0.03, False, "perhaps the machine stood still: the host took it"),
        ("S", 0.003, 0.0, True, "perhaps the machine stood still: the guardian came late, too"),
        ("S", 0.003, 0.0, False, "not the machine's load"),
        ("R", 0.09, 0.03, True, "not the machine's load"),
        ("D", 0.003, 0.03, True, "not the machine's load, in the kernel, for a disk or a driver"),
    ],
)
def test_a_machine_that_may_have_stood_still_is_not_ruled_out(
    state: str, ran_s: float, withheld_s: float, was_late: bool, words: str
) -> None:
    """A loop that slept on a starved virtual machine: `pressure 73 %: not the machine's load`, as if by an error of ours."""
    silence = Silence(0.101, 0.1, ProcessorTime(ran_s, 0.0), state, was_late, (withheld_s, "the host took it"))
    ending = explain_silence(silence, "load 3.59 on 2 cores")
    assert ending.cause is EndCause.STALLED and f"load 3.59 on 2 cores: {words}" in ending.text
    assert ("not the machine's load" in ending.text) is words.startswith("not the machine's load")
