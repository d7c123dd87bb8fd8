"""What keeps happening is a warning, told once with its numbers and its cause; what happens now and then is none."""

import re
from collections.abc import Callable

import pytest

from gateway.codes.warning_bits import WarningBit
from gateway.control.blame_for_silence import Held
from gateway.devices.messages import Garbage
from gateway.processes.scheduling.scheduler_counters import ProcessorTime
from gateway.profiles import load_device, load_rig
from gateway.registers.words import State
from gateway.service.running_rig.rate_warnings import LEAST, SHARE, WINDOW_S, LineNoise, SlowLoop
from gateway.service.running_rig.starting import lasting_warnings, warning_notes
from tests.service.every_device.test_every_device_presses import rig_with
from tests.service.rigs import demo
from tests.service.wired import Wired

NOISE, SLOW = WarningBit.SERIAL_NOISE, WarningBit.SLOW_LOOP
TICK_S, TICKS_PER_WINDOW = 0.01, 1000
BROKEN_FRAME, BROKEN_ECHO = b"ST,GS,+0#09.99kg\r\n", b"5x2\r\n"
Hear = Callable[[Wired], None]


def on_cell(wired: Wired) -> None:
    wired.loop.on_cell_bytes(BROKEN_FRAME, wired.now_s)


def on_output(wired: Wired) -> None:
    wired.loop.on_output_bytes(BROKEN_ECHO, wired.now_s)


def broken(wired: Wired, hear: Hear, count: int, every_s: float) -> Wired:
    for _ in range(count):
        hear(wired)
        wired.run(every_s)
    return wired


# -- A341


@pytest.mark.parametrize(("hear", "line"), [(on_cell, "load cell's line"), (on_output, "output's line")])
def test_noise_is_told_once_while_it_lasts_and_is_over_when_it_has_been_quiet(hear: Hear, line: str) -> None:
    wired = Wired().pressing(20.0)
    broken(wired, hear, 8, 0.1)
    assert wired.warnings & NOISE
    (sentence,) = wired.said("A341")
    assert sentence.startswith(f"A341 {line}: ") and "motor cable" in sentence
    assert wired.state is State.HOLDING, "a warning leaves the force as it is"
    wired.run(WINDOW_S - 0.2)
    assert wired.warnings & NOISE
    wired.run(0.3)
    assert not wired.warnings & NOISE
    broken(wired, hear, 11, 0.02)
    assert len(wired.said("A341")) == 2


def test_the_sentence_counts_what_was_dropped() -> None:
    wired = Wired().ready()
    wired.run(WINDOW_S)
    broken(wired, on_cell, 12, 0.02)
    (sentence,) = wired.said("A341")
    found = re.search(r"(\d+) of (\d+) messages \((\d+) bytes\)", sentence)
    assert found
    count, heard, size = map(int, found.groups())
    assert size == count * len(BROKEN_FRAME)
    assert SHARE < count / heard < 1.2 * SHARE, "it is told as soon as it is too much"
    assert 850 <= heard <= 1050


@pytest.mark.parametrize(
    "broken_frames",
    [range(LEAST - 1), range(0, 3000, 150), range(1500, 1509)],
    ids=["a port opened amid a message", "every 1.5 s", "a burst"],
)
def test_now_and_then_a_broken_frame_is_no_noise(broken_frames: range) -> None:
    noise, whole, bad = LineNoise("load cell's"), [object()], [Garbage(BROKEN_FRAME)]
    for frame in range(3000):
        assert not noise.hear(bad if frame in broken_frames else whole, 0.01 * frame)
    assert not noise.is_on


def test_the_bit_stands_while_either_line_is_noisy() -> None:
    wired = Wired().ready()
    broken(wired, on_cell, 8, 0.02)
    wired.run(2.0)
    broken(wired, on_output, 8, 0.02)
    assert len(wired.said("A341")) == 2
    wired.run(8.5)
    assert wired.warnings & NOISE, "the output's line was noisy eight seconds ago"
    wired.loop.warnings.bits |= WarningBit.MODEL_DIFFERS
    wired.run(1.6)
    assert not wired.warnings & NOISE
    assert wired.warnings & WarningBit.MODEL_DIFFERS, "which has nothing to do with a line"


def test_a_line_of_which_nothing_can_be_read_is_not_blamed_on_a_motor() -> None:
    noise, garbage = LineNoise("output's"), Wired().exchange.on_bytes(BROKEN_ECHO, 0.0)
    told = [noise.hear(garbage, 0.1 * k) for k in range(5)]
    assert told[:2] == ["", ""] and told[3:] == ["", ""]
    assert "another speed" in told[2] and "3 of 3 messages (15 bytes)" in told[2]


@pytest.mark.parametrize(
    ("hear", "again"),
    [
        (on_output, lambda wired: wired.loop.on_output_opened()),
        (on_cell, lambda wired: wired.loop.on_cell_opened()),
    ],
    ids=["output", "load cell"],
)
def test_another_device_behind_a_port_is_not_blamed_on_a_motor(hear: Hear, again: Hear) -> None:
    """Behind a plug that came back, what the device before had said well counted for it."""
    wired = broken(Wired().ready(), hear, 3, 0.02)
    (before,) = wired.said("A341")
    assert "motor" in before
    again(wired)
    for _ in range(LEAST):
        hear(wired)
    _, told = wired.said("A341")
    assert "3 of 3 messages" in told and "motor" not in told


# -- A342


def late_ticks(every: int, expirations: int = 1, late_s: float = 0.007) -> Callable[[int], tuple[int, float]]:
    return lambda tick: (expirations, late_s) if tick % every == 0 else (1, 0.0)


@pytest.mark.parametrize("how", [late_ticks(10), late_ticks(20, expirations=3, late_s=0.0)], ids=["late", "missed"])
def test_a_loop_that_keeps_coming_late_is_slow_until_it_has_been_in_time_for_long_enough(
    how: Callable[[int], tuple[int, float]],
) -> None:
    wired = Wired().pressing(20.0)
    wired.lateness = how
    wired.run(2.0)
    assert wired.warnings & SLOW
    assert len(wired.said("A342")) == 1
    assert wired.state is State.HOLDING
    wired.lateness = lambda tick: (1, 0.0)
    wired.run(WINDOW_S - 0.5)
    assert wired.warnings & SLOW
    wired.run(0.6)
    assert not wired.warnings & SLOW


@pytest.mark.parametrize(
    "how",
    [
        late_ticks(1, late_s=0.0049),
        late_ticks(110),
        lambda tick: (12, 0.002) if tick in (100, 900) else (1, 0.0),
    ],
    ids=["a little late each time", "under 1 %", "two stalls"],
)
def test_ticks_that_are_late_now_and_then_make_no_slow_loop(how: Callable[[int], tuple[int, float]]) -> None:
    slow = SlowLoop(TICK_S)
    for tick in range(3 * TICKS_PER_WINDOW):
        assert not slow.tick(tick * TICK_S, *how(tick), lambda: None)
    assert not slow.is_on


@pytest.mark.parametrize(
    ("used", "words"),
    [
        (ProcessorTime(on_cpu_s=0.001, waited_s=0.009), "99 ms of them waiting for a processor"),
        (ProcessorTime(on_cpu_s=0.001, waited_s=0.009), "the machine is too busy"),
        (ProcessorTime(on_cpu_s=0.016, waited_s=0.0), "the gateway's own work takes too long"),
        (ProcessorTime(on_cpu_s=0.001, waited_s=0.001), "this machine stood still"),
        (None, "not counted why"),
    ],
)
def test_a_slow_loop_says_whether_the_machine_or_the_program_is_to_blame(
    used: ProcessorTime | None, words: str
) -> None:
    slow, told = SlowLoop(TICK_S), []
    for tick in range(2 * TICKS_PER_WINDOW):
        late_s = 0.012 if tick % 20 == 0 else 0.0
        told.append(slow.tick(tick * TICK_S, 1, late_s, lambda: used))
    (sentence,) = filter(None, told)
    assert sentence.startswith("A342 11 of 201 ticks within 10 s were missed or over 5 ms late, 132 ms in all")
    assert words in sentence


@pytest.mark.parametrize(("withheld_s", "is_told"), [(0.066, True), (0.065, False)])
def test_what_was_withheld_from_outside_is_no_other_program(withheld_s: float, is_told: bool) -> None:
    slow, told = SlowLoop(TICK_S, lambda: (withheld_s, "a quota did it")), []
    for tick in range(2 * TICKS_PER_WINDOW):
        late_s = 0.012 if tick % 20 == 0 else 0.0
        told.append(slow.tick(tick * TICK_S, 1, late_s, lambda: ProcessorTime(0.001, 0.009)))
    (sentence,) = filter(None, told)
    assert ("132 ms in all: a quota did it" in sentence) is is_told
    assert ("the machine is too busy" in sentence) is not is_told


def test_the_loop_asks_the_kernel_what_the_time_since_the_last_tick_went_to() -> None:
    wired, had = Wired().ready(), ProcessorTime()

    def used() -> ProcessorTime:
        """The process waits for 0.6 of all time."""
        return had._replace(on_cpu_s=0.01 * wired.now_s, waited_s=0.6 * wired.now_s)

    wired.loop.processor_time = used
    wired.lateness = late_ticks(20)
    wired.run(4.0)
    (sentence,) = wired.said("A342")
    assert "the machine is too busy" in sentence


ASKED_CELL = "adam-4016"


@pytest.mark.parametrize(
    ("cell", "hear", "is_answer"),
    [("stream-st-gs", on_output, True), ("stream-st-gs", on_cell, False), (ASKED_CELL, on_cell, True)],
)
def test_answers_that_a_slow_loop_has_torn_are_not_blamed_on_cables(cell: str, hear: Hear, is_answer: bool) -> None:
    """What comes of its own accord waits in the kernel, whole."""
    wired = Wired(rig_with(load_device(cell))).pressing(20.0)
    wired.lateness = late_ticks(20)
    wired.run(4.0)
    assert wired.warnings & SLOW
    broken(wired, hear, 8, 0.1)
    (sentence,) = wired.said("A341")
    assert ("our own loop is late (A342)" in sentence) is is_answer
    assert ("cable" not in sentence) is is_answer


@pytest.mark.parametrize(
    ("held", "said"),
    [
        (Held(rig_waited_s=0.4), "the simulated rig's process waited 400 ms for a processor in that time"),
        (Held(rig_waited_s=0.4, withheld=(0.3, "a quota did it")), "a quota did it"),
        (Held(rig_stopped_s=0.4), "the simulated rig's process was stopped for 400 ms in that time"),
        (Held(rig_waited_s=0.05), "a motor cable"),
    ],
)
def test_answers_that_a_late_simulated_rig_has_torn_are_not_blamed_on_cables(held: Held, said: str) -> None:
    """On a busy machine, or behind a debugger: there is no cable at all."""
    wired = Wired().pressing(20.0)
    wired.loop.warnings.held = lambda then_s, now_s: held
    broken(wired, on_output, 8, 0.1)
    (sentence,) = wired.said("A341")
    assert said in sentence and ("cable" in sentence) is ("cable" in said)


# -- A343


def test_a_real_rig_without_a_watchdog_behind_it_says_so_and_a_simulated_one_holds_nothing() -> None:
    real = load_rig("irc5-cell")
    assert lasting_warnings(real, is_coarse_clock=False) == WarningBit.NO_WATCHDOG
    assert lasting_warnings(real, is_coarse_clock=True) == WarningBit.NO_WATCHDOG | WarningBit.CLOCK_FALLBACK
    (note,) = warning_notes(real)
    assert note.startswith("A343 smc-itv-rc has no watchdog")
    for simulated in (demo(), real.as_simulated()):
        assert lasting_warnings(simulated, is_coarse_clock=False) == WarningBit(0)
        assert warning_notes(simulated) == ()
