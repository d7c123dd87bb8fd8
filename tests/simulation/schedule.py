"""One schedule: what masters, people and fate do to a gateway, drawn from a seed, run in virtual time, judged and shrunk.

A schedule is a list of events, each whole by itself, so that any of them can be left out: the shortest list that still breaks
a law is what a failing seed is told by.
"""

import struct
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import nan
from pathlib import Path
from random import Random
from typing import Any

from gateway.profiles import Rig
from gateway.service.simulation.world import SimulatedRig
from tests.service.rigs import strict, with_supervision
from tests.simulation.cables import CABLES, lay_cables
from tests.simulation.edges import Log, SimulatedDisk, simulated_edges
from tests.simulation.masters import BEATS_S, ENABLE, TAKE, Master, read_pdu, write_pdu
from tests.simulation.observer import STATUS_FIRST, STATUS_WORDS, Bounds, Observer
from tests.simulation.processes import SimulatedService
from tests.simulation.virtual_time import BEGIN_S, VirtualClock, VirtualLoop

FAULTS = ("no-air", "no-contact", "sign-inverted", "cell-cut", "cell-frozen", "output-cut")
LEASE_S, STALL_S = 0.2, 0.1
RATES_HZ = (20,) * 6 + (25,) * 3 + (100,)
"""Of loop and load cell, drawn for each seed: at 20 Hz a schedule takes half of the time, and its laws are the same."""
HELD_N = 12.0
IN_BAND_N = 1.0
HEAL_S = 2.0
LOOK_S = 0.02
READ_S = 0.1


@dataclass(frozen=True)
class Event:
    """At at_s after READY, `what` happens to `whom`, with these numbers."""

    at_s: float
    whom: str
    what: str
    numbers: tuple[float, ...] = ()
    data: bytes = b""


def draw_events(seed: int, duration_s: float) -> Iterator[Event]:
    """What happens, in its order: a little more than two events a second."""
    chance, at_s = Random(seed), 0.0
    while (at_s := at_s + chance.expovariate(2.2)) < duration_s:
        yield _draw(chance, round(at_s, 4))


def _draw(chance: Random, at_s: float) -> Event:
    draw, master = chance.random(), chance.choice(("worker", "worker", "rival"))
    if draw < 0.34:
        return Event(
            at_s, master, chance.choice(("hold", "hold", "hold", "take")), (round(chance.uniform(0.0, 66.0), 2),)
        )
    if draw < 0.46:
        return Event(at_s, master, chance.choice(("reset", "let_go", "fall_silent", "disconnect")))
    if draw < 0.62:
        return Event(at_s, chance.choice(("worker", "rival", "fool")), "ask", data=_stupid(chance))
    if draw < 0.68:
        return Event(at_s, "villain", "send_raw", data=_hostile(chance))
    if draw < 0.86:
        return Event(at_s, "world", chance.choice(FAULTS), (float(chance.random() < 0.5),))
    if draw < 0.92:
        return Event(at_s, chance.choice(("output", "load_cell")), chance.choice(("pull", "push")))
    what = chance.choice(("kill", "stop", "kill_guardian", "terminate", "disk_full", "disk_free", "clock_jump"))
    return Event(at_s, "machine", what, (round(chance.uniform(0.005, 0.3), 4), chance.uniform(-1e6, 1e6)))


def _stupid(chance: Random) -> bytes:
    """A request that may be refused: any register, any value, any function."""
    address = chance.choice(
        (0, 0, 0, 1, 4, chance.randrange(0, 16), chance.randrange(100, 130), 200, 300, 416, 1000, 1147, 1500)
    )
    count = chance.choice((1, 1, 2, 5, 13, chance.randrange(1, 124)))
    words = [chance.choice((0, 1, 2, 9, 33, 65535, chance.randrange(65536))) for _ in range(count)]
    if address == 0 and words:
        words[0] &= ~0x60  # runs of their own (bits 5 and 6) move without a master's lease, by right
    function = chance.choice((3, 4, 1, 2, 5, 6, 15, 16, 16, 16, 22, 23, 43, 99))
    if function == 16:
        return write_pdu(address, *words)
    if function == 6:
        return struct.pack(">BHH", 6, address, words[0])
    if function == 5:
        return struct.pack(">BHH", 5, chance.choice((0, 1, 2, 3, 4)), chance.choice((0, 0xFF00, 0x1234)))
    if function == 22:
        return struct.pack(">BHHH", 22, address, 0xFF9F, chance.randrange(65536) & ~0x60 & 0xFFFF)
    if function in (1, 2, 3, 4):
        return struct.pack(">BHH", function, address, chance.choice((0, 1, 10, 125, 126, 65535)))
    return bytes((function,)) + chance.randbytes(chance.randrange(0, 40))


def _hostile(chance: Random) -> bytes:
    whole = struct.pack(">HHHB", 7, 0, 6, 1) + read_pdu(100, 10)
    return chance.choice(
        (
            chance.randbytes(chance.randrange(1, 400)),
            whole[: chance.randrange(1, len(whole))],
            whole * chance.randrange(2, 60),
            struct.pack(">HHHB", 1, 0, 65535, 1),
            struct.pack(">HHHB", 1, 9, 6, 1) + whole[7:],
        )
    )


@dataclass(frozen=True)
class Outcome:
    """What was broken, and a fingerprint of everything that was on the output's wire."""

    broken: tuple[str, ...]
    fingerprint: str
    settings: int
    largest_v: float


def simulated_rig(seed: int) -> Rig:
    """A demo rig with strict bounds, at a rate of its own: a cell that is late by two samples and a half is lost."""
    loop_hz = Random(f"rate {seed}").choice(RATES_HZ)
    bounds = {"sample_timeout_s": max(0.05, 2.5 / loop_hz), "output_timeout_s": max(0.1, 3.0 / loop_hz)}
    rig = with_supervision(strict(), lease_s=LEASE_S, stall_s=STALL_S, **bounds)
    output, load_cell = replace(rig.output, port="output"), replace(rig.load_cell, port="load_cell")
    return replace(rig, seed=seed, loop_hz=loop_hz, output=output, load_cell=load_cell)


class Simulation:
    """A gateway, its world and its masters."""

    def __init__(self, seed: int, folder: Path) -> None:
        rig = simulated_rig(seed)
        self.period_s = 1.0 / rig.loop_hz
        self.clock, self.chance = VirtualClock(), Random(~seed)
        supervision, limits = rig.control.supervision, rig.control.limits
        bounds = Bounds(
            limits.voltage_max_v,
            limits.voltage_slew_v_per_s,
            supervision.sample_timeout_s,
            supervision.stall_s,
            LEASE_S,
            self.period_s,
        )
        self.observer = Observer(bounds)
        self.outside = VirtualLoop(self.clock)
        self.outside.set_exception_handler(self._on_error)
        self.log = Log(self.clock)
        self.world = SimulatedRig(
            rig,
            send_output=lambda data: CABLES["output"].send_to_host(data),
            send_cell=lambda data: CABLES["load_cell"].send_to_host(data),
            now_s=self.clock.now_s,
        )
        lay_cables(self.outside, rig, self._on_output, self.world.on_cell_bytes)
        SimulatedDisk.is_full = False
        SimulatedDisk.delay_s = staticmethod(lambda: self.chance.uniform(0.001, 0.08))
        self.service = SimulatedService(rig, folder, self.outside, self.log, self.clock)
        self.service.on_death = self._on_death
        self.masters = {
            name: Master(
                f"10.0.0.{place}",
                self.outside,
                lambda: self.service.inside,
                self._on_accepted,
                self.chance.choice(BEATS_S),
            )
            for place, name in enumerate(("worker", "rival", "fool", "villain", "healer"), start=1)
        }
        self.reader = Master("10.0.0.9", self.outside, lambda: self.service.inside, lambda *_: None)
        self.outside.call_later(0.3 * self.period_s, self._stream)
        self.outside.call_later(LOOK_S, self._look)
        self.outside.call_later(READ_S, self._read_status)

    def run(self, events: Iterable[Event], duration_s: float) -> Outcome:
        """Run the events, then heal everything, reset, and see the force come back."""
        self._run_for(1.0)
        self._happen_next(iter(events))
        self._run_for(duration_s)
        self._heal()
        for master in (*self.masters.values(), self.reader):
            self.observer.broken += master.complaints
        self.observer.broken += self.log.internal_errors
        self.observer.fingerprint.update("\n".join(self.observer.broken).encode())
        return Outcome(
            tuple(self.observer.broken),
            self.observer.fingerprint.hexdigest(),
            self.observer.settings,
            self.observer.largest_v,
        )

    def close(self) -> None:
        self.service.close()
        self.outside.close()

    def _on_error(self, loop: object, context: dict[str, Any]) -> None:
        """A mistake of the simulation itself: nothing that it says counts then."""
        self.observer.broken.append(f"simulation: {context.get('exception')!r}")

    # -- what happens

    def _happen_next(self, events: Iterator[Event]) -> None:
        if event := next(events, None):
            self.outside.call_at(BEGIN_S + 1.0 + event.at_s, self._happen_then, event, events)

    def _happen_then(self, event: Event, events: Iterator[Event]) -> None:
        self._happen(event)
        self._happen_next(events)

    def _happen(self, event: Event) -> None:
        if event.whom in self.masters:
            self._command(self.masters[event.whom], event)
        elif event.whom == "world":
            self._set_fault(event.what, on=bool(event.numbers[0]))
        elif event.whom == "machine":
            self._shake(event)
        elif event.what == "pull":
            self._pull(event.whom)
        else:
            self._push(event.whom)

    def _command(self, master: Master, event: Event) -> None:
        if event.what in ("hold", "take"):
            master.hold(event.numbers[0], ENABLE if event.what == "hold" else ENABLE | TAKE)
        elif event.data:
            getattr(master, event.what)(event.data)
        else:
            getattr(master, event.what)()

    def _shake(self, event: Event) -> None:
        if event.what == "kill":
            self.service.kill_control()
        elif event.what == "kill_guardian":
            self._kill_guardian()
        elif event.what == "terminate":
            self.service.terminate()
        elif event.what == "stop" and self.service.is_guarded:
            self.service.stop_control(event.numbers[0])
            if event.numbers[0] > self.observer.bounds.stall_s:
                self._lose_control()
        elif event.what == "clock_jump":
            self.clock.jump_s += event.numbers[1]
        else:
            SimulatedDisk.is_full = event.what == "disk_full"

    def _kill_guardian(self) -> None:
        """Control learns of it at once, and ends with the safe voltage. Where it stands still itself that is two faults at a
        time, for which the device has its watchdog."""
        if self.service.is_serving:
            self.service.kill_guardian()
            self.observer.note_disabled(self.clock.now_s)

    def _set_fault(self, name: str, *, on: bool) -> None:
        self.world.fault({"do": "fault", "name": name, "on": on})
        if name == "cell-cut":
            self._judge_cell(is_cut=on)

    def _pull(self, line: str) -> None:
        CABLES[line].pull()
        if line == "output":
            self.observer.note_cut(self.clock.now_s)
            self.observer.output_lost_s = self.clock.now_s
        else:
            self._judge_cell(is_cut=None)

    def _push(self, line: str) -> None:
        CABLES[line].push()
        if line == "load_cell":
            self._judge_cell(is_cut=None)

    _is_cell_cut = False

    def _judge_cell(self, *, is_cut: bool | None) -> None:
        self._is_cell_cut = self._is_cell_cut if is_cut is None else is_cut
        is_heard = not self._is_cell_cut and CABLES["load_cell"].is_plugged
        lost_s = self.observer.cell_lost_s
        self.observer.cell_lost_s = None if is_heard else self.clock.now_s if lost_s is None else lost_s

    # -- what goes on

    def _on_output(self, chunk: bytes, now_s: float) -> None:
        self.observer.hear(chunk, now_s)
        self.observer.output_lost_s = None
        self.world.on_output_bytes(chunk, now_s)

    def _on_accepted(self, control: int | None, pdu: bytes) -> None:
        self.observer.note_accepted(control, self.clock.now_s)

    def _on_death(self) -> None:
        self.observer.note_death(self.clock.now_s, CABLES["output"].through_s)
        self._lose_control()
        for master in (*self.masters.values(), self.reader):
            master.lose()
        self.reader.heard.clear()

    def _lose_control(self) -> None:
        if self.observer.control_lost_s is None:
            self.observer.control_lost_s = self.clock.now_s

    def _stream(self) -> None:
        if CABLES["load_cell"].backlog_s < 0.01:
            self.world.stream(self.clock.now_s)
        self.outside.call_later(self.period_s, self._stream)

    def _look(self) -> None:
        if self.service.is_serving:
            self.observer.control_lost_s = None
        self.observer.look(self.clock.now_s)
        self.outside.call_later(LOOK_S, self._look)

    def _read_status(self) -> None:
        for at_s, pdu in self.reader.heard:
            if pdu[0] == 3:
                self.observer.note_status(pdu, at_s)
        self.reader.heard.clear()
        self.reader.ask(read_pdu(STATUS_FIRST, STATUS_WORDS))
        self.outside.call_later(READ_S, self._read_status)

    def _run_for(self, duration_s: float) -> None:
        self.clock.run_until(self.clock.now_s + duration_s)

    # -- healing (I13)

    def _heal(self) -> None:
        for name in FAULTS:
            self._set_fault(name, on=False)
        for line in ("output", "load_cell"):
            self._push(line)
        SimulatedDisk.is_full = False
        for master in self.masters.values():
            master.fall_silent()
            master.disconnect()
        self._run_for(3.0)  # what is plugged in is looked for, and a guardian started again, every 2 s at the most
        healer = self.masters["healer"]
        healer.reset(take=True)
        self._run_for(0.1)
        healer.hold(HELD_N)
        self._run_for(HEAL_S)
        error_n = self._read_force_n() - HELD_N
        if not abs(error_n) <= IN_BAND_N:
            self.observer.broken.append(
                f"I13: {error_n:+.2f} N off {HEAL_S:g} s after healing; {list(self.log.lines)[-4:]}"
            )

    def _read_force_n(self) -> float:
        """The force that the gateway shows, N; not a number where nobody answers."""
        self.masters["healer"].ask(read_pdu(102, 1))
        self._run_for(0.02)
        answers = [pdu for _, pdu in self.masters["healer"].heard if pdu[:2] == b"\x03\x02"]
        return float(struct.unpack(">h", answers[-1][2:4])[0]) * 0.01 if answers else nan


def run_schedule(seed: int, events: Sequence[Event], duration_s: float) -> Outcome:
    """Run one schedule by itself, in a directory of its own."""
    base: Any = "/dev/shm" if Path("/dev/shm").is_dir() else None
    with tempfile.TemporaryDirectory(dir=base) as folder, simulated_edges():
        simulation = Simulation(seed, Path(folder))
        with simulation.clock.as_the_kernels():
            try:
                return simulation.run(events, duration_s)
            finally:
                simulation.close()


def shrink(events: Sequence[Event], is_broken: Callable[[Sequence[Event]], bool]) -> list[Event]:
    """Return a shorter list that is still broken: halves, quarters ... down to single events are left out (ddmin)."""
    kept, size = list(events), max(1, len(events) // 2)
    while True:
        at = 0
        while at < len(kept):
            shorter = kept[:at] + kept[at + size :]
            if is_broken(shorter):
                kept = shorter
            else:
                at += size
        if size == 1:
            return kept
        size = max(1, size // 2)
