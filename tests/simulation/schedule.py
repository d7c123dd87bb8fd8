"""One schedule: what masters, people and fate do to a gateway (events.py), run in virtual time and judged."""

import json
import struct
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import inf, nan
from pathlib import Path
from random import Random
from typing import Any

from gateway.control import LeaseAction
from gateway.devices import output_device
from gateway.profiles import Rig
from gateway.service.simulation.world import SimulatedRig
from tests.simulation.event import Event
from tests.simulation.happening import happen
from tests.simulation.healing import ANSWER_S, heal
from tests.simulation.kernel.cables import CABLES, lay_cables
from tests.simulation.kernel.edges import DISK_S, Log, SimulatedDisk, simulated_edges
from tests.simulation.kernel.fits import SimulatedFit
from tests.simulation.kernel.network import DELAY_S
from tests.simulation.kernel.processes import SimulatedService
from tests.simulation.kernel.virtual_time import BEGIN_S, VirtualClock, VirtualLoop
from tests.simulation.masters.bus_master import make_master
from tests.simulation.masters.integrator import Integrator, Sets
from tests.simulation.masters.socket_user import SocketUser
from tests.simulation.masters.spelling import BITS, DISABLED_BY_BIT, ENABLE, read_pdu
from tests.simulation.masters.tcp_master import BEATS_S, RESET, RUNS, Master
from tests.simulation.observer import DOWN_S, STATUS_FIRST, STATUS_WORDS, Bounds
from tests.simulation.rigs import LEASE_S, draw_badges, draw_rig, store_plants
from tests.simulation.status_witness import StatusWitness

RUN_BIT, SELF_TEST = RUNS.values()
PLANTS_EVERY = 8
"""Of so many rigs one has numbered plants stored, which somebody may take into use."""
FIRST_SETTING_S = 0.3
"""On a line that is back: a watchdog is fed before the safe voltage goes out."""
LOOK_S = 0.02
READ_S = 0.1


@dataclass(frozen=True)
class Outcome:
    """What was broken, and a fingerprint of everything that was on the output's wire; commits: uploads that went through."""

    broken: tuple[str, ...]
    fingerprint: str
    settings: int
    largest_v: float
    commits: int


class Simulation:
    """A gateway, its world and its masters. rest_n: force that a healthy cell reads at rest, None where nobody has looked."""

    rest_n: float | None = None

    def __init__(self, seed: int, folder: Path) -> None:
        drawn = draw_rig(seed)
        rig = drawn.rig
        self.period_s, self.cell_s = 1.0 / rig.loop_hz, drawn.cell_s
        self.clock, self.chance = VirtualClock(), Random(~seed)
        self.observer = drawn.observer(self._bounds_of(rig))
        self.outside = VirtualLoop(self.clock)
        self.outside.set_exception_handler(self._on_error)
        self.log = Log(self.clock)
        self.world = SimulatedRig(
            rig,
            send_output=lambda data: CABLES["output"].send_to_host(data),
            send_cell=lambda data: CABLES["load_cell"].send_to_host(data),
            now_s=self.clock.now_s,
        )
        self._move_valve, self.world.valve.move = self.world.valve.move, self._judge_valve  # type: ignore[method-assign]
        lay_cables(self.outside, rig, self._on_output, self.world.on_cell_bytes, self._on_valve)
        SimulatedDisk.is_gone = SimulatedDisk.is_hung = False
        SimulatedDisk.fails = ""
        SimulatedDisk.folder = folder
        SimulatedDisk.delay_s = staticmethod(lambda: self.chance.uniform(*DISK_S))
        if seed % PLANTS_EVERY == 0:
            store_plants(rig, folder)
        SimulatedFit.outside, SimulatedFit.chance, SimulatedFit.built_in = (
            self.outside,
            Random(f"fit {seed}"),
            rig.calibration,
        )
        SimulatedFit.on_stored, SimulatedFit.ended = staticmethod(lambda mark: self.sets.expect_mark(mark)), []
        self.status = StatusWitness(self.observer, lambda: CABLES["load_cell"].heard_s)
        self.service = SimulatedService(rig, folder, self.outside, self.log, self.clock)
        self.service.on_death = self._on_death
        self.masters = {
            name: make_master(name, "bus" in CABLES)(
                f"10.0.0.{place}",
                self.outside,
                lambda: self.service.inside,
                self._on_write,
                self.chance.choice(BEATS_S),
            )
            for place, name in enumerate(("worker", "rival", "fool", "villain", "healer"), start=1)
        }
        self.reader = Master("10.0.0.9", self.outside, lambda: self.service.inside, lambda *_: None)
        self.sets = Sets()
        self.integrators = {
            name: Integrator(f"10.0.0.{place}", self.outside, lambda: self.service.inside, lambda *_: None)
            for place, name in ((8, "integrator"), (7, "designer"))
        }
        for one in self.integrators.values():
            one.sets = self.sets
        self.integrator = self.integrators["integrator"]
        self.person = SocketUser(lambda: self.service.inside, self.service.answer_socket)
        self.person.on_write = lambda control: self._on_write(control, True)
        self.person.on_model = self._expect_any_model
        for client in (*self.masters.values(), self.person):
            client.on_setpoint = lambda pdu, who=client.name: self.status.note_write(who, pdu, self.clock.now_s)
        self.clients = (*self.masters.values(), self.reader, *self.integrators.values())
        for name, badge in draw_badges(seed).items():
            ({"reader": self.reader} | self.masters | self.integrators)[name].badge = badge
        if self.cell_s:
            self.outside.call_later(0.3 * self.cell_s, self._stream)
        self.outside.call_later(LOOK_S, self._look)
        self.outside.call_later(READ_S, self._read_status)
        self.outside.call_later(READ_S, self.integrator.watch)

    def _bounds_of(self, rig: Rig) -> Bounds:
        supervision, limits = rig.control.supervision, rig.control.limits
        return Bounds(
            limits.voltage_max_v,
            limits.voltage_slew_v_per_s,
            supervision.sample_timeout_s,
            supervision.stall_s,
            LEASE_S if supervision.lease_s and supervision.lease_action is not LeaseAction.HOLD else inf,
            self.period_s,
            DOWN_S if supervision.lease_action is LeaseAction.RAMP else 0.0,
            supervision.output_timeout_s + rig.output.device.reply_timeout_s,
        )

    def run(self, events: Iterable[Event], duration_s: float) -> Outcome:
        """Run the events, then heal everything, reset, and see the force come back."""
        self._run_for(1.0)
        self.rest_n = self._read_force_n()
        self._happen_next(iter(events))
        self._run_for(duration_s)
        self._heal()
        for client in (*self.clients, self.person):
            self.observer.broken += client.complaints
        self.observer.broken += self.log.internal_errors
        self.observer.fingerprint.update("\n".join(self.observer.broken).encode())
        return Outcome(
            tuple(self.observer.broken),
            self.observer.fingerprint.hexdigest(),
            self.observer.settings,
            self.observer.largest_v,
            sum(one.committed for one in self.integrators.values()),
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
        happen(self, event)
        self._happen_next(events)

    def _set_fault(self, name: str, *, on: bool) -> None:
        self.world.fault({"do": "fault", "name": name, "on": on})
        if name == "cell-cut":
            self._judge_cell(is_cut=on)
        self._judge_answers()

    def set_in_world(self, line: bytes) -> None:
        """As the verb `sim` does: control is asked first, then the simulated rig."""
        if self.service.is_serving:
            self.person.say(line)
            self._simulate(json.loads(line))

    def _simulate(self, request: dict[str, Any]) -> None:
        with suppress(ValueError):
            self.world.simulate(request)
        self._judge_cell(is_cut=self.world.settings.is_on("cell.silent"))
        self._judge_answers()

    def _judge_answers(self) -> None:
        """The output device has stopped answering, or begins to answer again."""
        is_silent = self.world.settings.is_on("output.silent") or self.clock.now_s < self._dark_until_s
        lost_s = self.observer.answers_lost_s
        self.observer.answers_lost_s = (self.clock.now_s if lost_s is None else lost_s) if is_silent else None

    def lose_power(self, dark_s: float, power_on_v: float) -> None:
        """The output device alone goes dark, and comes back as one that has just been switched on."""
        self.world.advance(self.clock.now_s)
        self.world._output = output_device(self.world._rig.output.device)
        self._dark_until_s = self.clock.now_s + dark_s
        self._set_output(0.0)
        self._judge_answers()
        self.outside.call_later(dark_s, self._return_power, power_on_v)

    _dark_until_s = 0.0

    def _return_power(self, voltage_v: float) -> None:
        self._set_output(voltage_v)
        self._judge_answers()

    def _set_output(self, voltage_v: float) -> None:
        self.world._setting_v = voltage_v
        self.world.twin.command(voltage_v)

    def _expect_any_model(self) -> None:
        self.sets.expect_any()
        for one in self.integrators.values():
            one.forget()

    def _pull(self, line: str) -> None:
        CABLES[line].pull()
        if line == "valve":
            return
        if line == "output":
            self.observer.note_cut(self.clock.now_s)
            self.observer.output_lost_s, self._back_s = self.clock.now_s, 0.0
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
        settings = self.observer.settings
        self.observer.hear(chunk, now_s)
        if self.observer.output_lost_s is not None:
            self._back_s = self._back_s or now_s
            if self.observer.settings > settings or now_s - self._back_s > FIRST_SETTING_S:
                self.observer.output_lost_s, self._back_s = None, 0.0
        if now_s > self._dark_until_s:
            self.world.on_output_bytes(chunk, now_s)

    _back_s = 0.0  # when a line that was lost has brought its first byte

    def _on_valve(self, chunk: bytes, now_s: float) -> None:
        CABLES["valve"].send_to_host(self.world.on_valve_bytes(chunk, now_s))

    def _judge_valve(self, now_s: float) -> bool:
        """The valve is moved without pressure, whatever its relay was told and when."""
        if (has_moved := self._move_valve(now_s)) and self.observer.voltage_v > 0.0:
            self.observer.broken.append(f"valve at {now_s:.4f}: it moves under {self.observer.voltage_v:.3f} V")
        return has_moved

    def _on_write(self, control: int | None, is_answered: bool) -> None:
        if control == DISABLED_BY_BIT:  # which ends no run; a reset may be among the other bits
            control = BITS if self.observer.is_run else RESET
        if control is not None and control & (ENABLE | RUN_BIT | SELF_TEST) and control > 0 and is_answered:
            self.person.lose()  # a run that was asked for at the machine excludes that
        note = self.observer.note_accepted if is_answered else self.observer.note_unanswered
        note(control, self.clock.now_s)

    def _on_death(self) -> None:
        self.observer.note_death(self.clock.now_s, CABLES["output"].through_s)
        self._lose_control()
        self.person.lose()
        self._was_watched = False
        for master in self.clients:
            master.lose()
        self.reader.heard.clear()

    def _lose_control(self) -> None:
        if self.observer.control_lost_s is None:
            self.observer.control_lost_s = self.clock.now_s

    cell_pace = 1.0

    def _stream(self) -> None:
        if CABLES["load_cell"].backlog_s < 0.01:
            self.world.stream(self.clock.now_s)
        self.outside.call_later(self.cell_pace * (self.cell_s or self.period_s), self._stream)

    _was_watched = False

    def _follow_person(self, is_watched: bool) -> None:
        """A run that somebody has started at the machine presses without a master, as long as that person looks at it."""
        if is_watched:
            self.observer.note_accepted(RUN_BIT, self.clock.now_s)
        elif self._was_watched and self.observer.is_run:
            self.observer.note_accepted(0, self.clock.now_s)
        self._was_watched = is_watched

    def _note_strange_words(self) -> None:
        """A sentence that fits is a sample, whoever says it: the cell is lost from then on."""
        lost_s, strange_s = self.observer.cell_lost_s, CABLES["load_cell"].strange_s
        if lost_s is not None and strange_s > lost_s:
            self.observer.cell_lost_s = strange_s
        lost_s, strange_s = self.observer.answers_lost_s, CABLES["output"].strange_s
        if lost_s is not None and strange_s > lost_s:
            self.observer.answers_lost_s = strange_s

    def _look(self) -> None:
        is_watched = self.person.watched_s is not None
        if is_watched or self._was_watched:
            self._follow_person(is_watched)
        if self.observer.cell_lost_s is not None or self.observer.answers_lost_s is not None:
            self._note_strange_words()
        if self.observer.control_lost_s is not None and self.service.is_serving:
            self.observer.control_lost_s = None
        self.observer.cell_heard_s = CABLES["load_cell"].heard_s
        self.observer.look(self.clock.now_s)
        self.outside.call_later(LOOK_S, self._look)

    def _read_status(self) -> None:
        for at_s, pdu in self.reader.heard:
            if pdu[0] == 3 and len(pdu) == 2 + 2 * STATUS_WORDS:
                self.observer.note_status(pdu, at_s)
                self.status.note(pdu[2:], at_s - DELAY_S)
        self.reader.heard.clear()
        self.reader.ask(read_pdu(STATUS_FIRST, STATUS_WORDS))
        self.outside.call_later(READ_S, self._read_status)

    def _run_for(self, duration_s: float) -> None:
        self.clock.run_until(self.clock.now_s + duration_s)

    # -- healing (I13)

    def _heal(self) -> None:
        heal(self)

    def _read_force_n(self) -> float:
        """The force that the gateway shows, N; not a number where nobody answers."""
        self.masters["healer"].ask(read_pdu(102, 1))
        self._run_for(ANSWER_S)
        answers = [pdu for _, pdu in self.masters["healer"].heard if pdu[:2] == b"\x03\x02"]
        return float(struct.unpack(">h", answers[-1][2:4])[0]) * 0.01 if answers else nan


def run_schedule(seed: int, events: Sequence[Event], duration_s: float) -> Outcome:
    """Run one schedule by itself, in a directory of its own."""
    base: Any = "/dev/shm" if Path("/dev/shm").is_dir() else None
    with tempfile.TemporaryDirectory(dir=base) as folder, simulated_edges(SimulatedFit):
        simulation = Simulation(seed, Path(folder))
        with simulation.clock.as_the_kernels():
            try:
                return simulation.run(events, duration_s)
            finally:
                simulation.close()
