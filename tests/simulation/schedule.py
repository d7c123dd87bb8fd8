"""One schedule: what masters, people and fate do to a gateway (draws/events.py), run in virtual time and judged."""

import struct
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import takewhile
from math import nan
from pathlib import Path
from random import Random
from typing import Any

from tests.simulation.draws.event import Event
from tests.simulation.draws.rigs import DEMO_CELL, draw_badges, draw_rig, store_documents
from tests.simulation.happening import happen
from tests.simulation.healing import ANSWER_S, RATE_S, count_answers, heal
from tests.simulation.judges.audit_judge import judge_audit
from tests.simulation.judges.command_witness import WORDS, CommandWitness, Counted
from tests.simulation.judges.explained_force import ExplainedForce
from tests.simulation.judges.held_force import HeldForce
from tests.simulation.judges.lease_judge import LeaseJudge
from tests.simulation.judges.lying_cell import LyingCell
from tests.simulation.judges.observer import DOWN_S, STATUS_FIRST, STATUS_WORDS
from tests.simulation.judges.reason_judge import MACHINE, ReasonJudge
from tests.simulation.judges.recording_judge import judge_recordings
from tests.simulation.judges.status_witness import SCALES, StatusWitness
from tests.simulation.judges.target_witness import TargetWitness
from tests.simulation.judges.zero_witness import ZeroWitness
from tests.simulation.kernel.cables import CABLES
from tests.simulation.kernel.edges import DISK_S, Log, SimulatedDisk, simulated_edges
from tests.simulation.kernel.fits import SimulatedFit
from tests.simulation.kernel.garbage import garbage_left_alone
from tests.simulation.kernel.network import DELAY_S
from tests.simulation.kernel.processes import SimulatedService
from tests.simulation.kernel.virtual_time import BEGIN_S, VirtualClock, VirtualLoop
from tests.simulation.masters.bus_master import make_master
from tests.simulation.masters.crowd import Crowd
from tests.simulation.masters.integrator import Integrator, Sets
from tests.simulation.masters.socket_user import SocketUser
from tests.simulation.masters.spelling import (
    BITS,
    DISABLED_BY_BIT,
    ENABLE,
    MODE,
    control_of,
    hangs_payload,
    read_pdu,
    takes_set,
    tells_weight,
    word_of,
)
from tests.simulation.masters.tcp_master import BEATS_S, RESET, RUNS, TARE, Master
from tests.simulation.surroundings import Surroundings

RUN_BIT, SELF_TEST = RUNS.values()
RECORDED_EVERY, RECORDED = 8, 1
"""Of so many gateways one records from its start."""
LOOK_S, READ_S = 0.02, 0.1
FIRST_LOOK_S = 0.5
"""When the gateway serves, and nothing has happened yet: at which calibration it begins with."""
COMMAND_EVERY, FLOATS_EVERY, MOST_UNHEARD = 6, 16, 4
FLOAT_STATUS = 232
COMMAND_BLOCK, FLOAT_BLOCK = bytes((3, 2 * WORDS)), bytes((3, 4 * len(SCALES)))


@dataclass(frozen=True)
class Outcome:
    """What was broken, and a fingerprint of everything that was on the output's wire; commits: uploads that went through."""

    broken: tuple[str, ...]
    fingerprint: str
    settings: int
    largest_v: float
    commits: int


class Simulation:
    """A gateway, its world and its masters. rest_n: force that a healthy cell reads at rest, None where nobody has looked;
    rates: how many answers each healthy device gives in RATE_S, the same."""

    rest_n: float | None = None
    _looks = _unheard = 0

    def __init__(self, seed: int, folder: Path) -> None:
        self._folder = folder
        drawn = draw_rig(seed)
        rig = drawn.rig
        self.period_s = 1.0 / rig.loop_hz
        self.rates: dict[str, int] = {}
        self.clock, self.chance = VirtualClock(), Random(~seed)
        self.observer = drawn.observer()
        self.observer.history.is_plain = rig.load_cell.device.name == DEMO_CELL and not rig.compensation.cell
        self.observer.history.has_valve = rig.valve is not None or rig.load_cell.sign < 0
        self.outside = VirtualLoop(self.clock, has_tasks=False)
        self.outside.set_exception_handler(self._on_error)
        self.log = Log(self.clock)
        self.around = Surroundings(rig, self.outside, self.observer, drawn.cell_s)
        SimulatedDisk.is_gone = SimulatedDisk.is_hung = False
        SimulatedDisk.fails = ""
        SimulatedDisk.folder, SimulatedDisk.chance = folder, Random(f"torn {seed}")
        SimulatedDisk.working.clear()
        SimulatedDisk.delay_s = staticmethod(lambda: self.chance.uniform(*DISK_S))
        self.sets = Sets(store_documents(seed, rig, folder))
        SimulatedFit.outside, SimulatedFit.chance, SimulatedFit.built_in = (
            self.outside,
            Random(f"fit {seed}"),
            rig.calibration,
        )
        SimulatedFit.on_stored, SimulatedFit.ended = staticmethod(lambda mark: self.sets.expect_mark(mark)), []
        self.status = StatusWitness(self.observer, lambda: CABLES["load_cell"].heard_s)
        self.commands, self.tares = CommandWitness(self.observer), Counted("a zero was taken")
        self.lease = LeaseJudge(self.observer)
        self.cell = LyingCell(self.observer)
        self.reasons = ReasonJudge(self.observer)
        self.explained = ExplainedForce(self.observer)
        self.target = TargetWitness(self.observer)
        self.held_force = HeldForce(self.observer, BEGIN_S + 2.0)
        self.zeros = ZeroWitness(self.observer, self.around.pressing_n, lambda: CABLES["output"].falsified_s)
        self.log.on_zero = self._note_zero  # type: ignore[method-assign]
        self.service = SimulatedService(
            rig, folder, self.outside, self.log, self.clock, records=seed % RECORDED_EVERY == RECORDED
        )
        self.service.on_death = self._on_death
        self.masters = {
            name: make_master(name)(
                f"10.0.0.{place}",
                self.outside,
                lambda: self.service.inside,
                self._on_write,
                self.chance.choice(BEATS_S),
            )
            for place, name in enumerate(("worker", "rival", "fool", "villain", "healer"), start=1)
        }
        self.reader = Master("10.0.0.9", self.outside, lambda: self.service.inside, lambda *_: None)
        self.integrators = {
            name: Integrator(f"10.0.0.{place}", self.outside, lambda: self.service.inside, lambda *_: None)
            for place, name in ((8, "integrator"), (7, "designer"))
        }
        for one in self.integrators.values():
            one.sets, one.on_model = self.sets, self._expect_any_model
        self.integrator = self.integrators["integrator"]
        self.crowd = Crowd(self.outside, lambda: self.service.inside)
        self.person = SocketUser(lambda: self.service.inside, self.service.answer_socket)
        self.person.on_write = lambda control: self._on_write(control, True)
        self.person.on_model = self._expect_any_model
        self.person.on_tare = self._note_run_tare
        for master in self.masters.values():
            master.on_start = partial(self._note_start, master.name)
            master.on_refusal = lambda: self.status.note_refusal(self.clock.now_s)
        for client in (*self.masters.values(), self.person):
            client.on_pdu = partial(self._note_pdu, client.name if type(client) is Master else "")
        self.clients = (*self.masters.values(), self.reader, *self.integrators.values())
        for name, badge in draw_badges(seed).items():
            ({"reader": self.reader} | self.masters | self.integrators)[name].badge = badge
        self.outside.call_later(LOOK_S, self._look)
        self.outside.call_later(READ_S, self._read_status)
        self.outside.call_later(FIRST_LOOK_S, self.integrator.watch)

    def run(self, events: Iterable[Event], duration_s: float) -> Outcome:
        """Run the events, then heal everything, reset, and see the force come back."""
        self._run_for(1.0 - RATE_S)
        self.rates = count_answers(self)
        self.rest_n = self._read_force_n()
        self.zeros.rest_n = self.around.pressing_n()
        self._happen_next(takewhile(lambda event: event.at_s < duration_s, events))
        self._run_for(duration_s)
        self.held_force.end()
        heal(self)
        self.observer.broken += judge_audit(self._folder, self.masters["healer"].name)
        self.observer.history.cuts.append(self.clock.now_s)  # what is on the wire now comes no more
        if self.observer.history.is_whole:
            self.observer.broken += judge_recordings(self._folder, self.observer.history)
        for client in (*self.clients, self.person):
            self.observer.broken += client.complaints
        self.observer.broken += self.log.internal_errors
        if "bus" not in CABLES:  # what was doubled on its way is asked for twice
            self.observer.broken += self.tares.judge()
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
        if event.what == "terminate":
            self.lease.note_ending()
            self.reasons.note(MACHINE, max(self.clock.now_s, self.service.thaws_s) + DOWN_S)
        self._happen_next(events)

    def _expect_any_model(self) -> None:
        self.sets.expect_any()
        self.explained.note_change(self.clock.now_s)
        for one in self.integrators.values():
            one.forget()

    # -- what goes on

    def _note_pdu(self, host: str, pdu: bytes, is_answered: bool) -> None:
        self.status.note_write(host if is_answered else "", pdu, self._done_s(is_answered))
        self.explained.note_write(host, self.clock.now_s)
        self.target.note_write(host, pdu, self._done_s(is_answered))
        self.cell.note_mode(word_of(pdu, MODE))
        self.lease.note_write(pdu, self._done_s(is_answered), is_answered=is_answered, host=host)
        self.commands.note_write(pdu, self._done_s(is_answered))
        if (control := control_of(pdu)) is not None and control & TARE:
            self._note_tare()
            self.tares.note_asked(is_sure=is_answered and control > 0)
        if tells_weight(pdu):
            self._note_weight(pdu)
        if takes_set(pdu):
            self._expect_any_model()

    def _note_start(self, host: str, pdu: bytes, is_taken: bool) -> None:
        self.lease.note_start(pdu, self.clock.now_s, is_taken=is_taken, host=host)

    def _note_weight(self, pdu: bytes) -> None:
        self.explained.note_change(self.clock.now_s)
        if hangs_payload(pdu):
            self.observer.history.weighed_s = min(self.observer.history.weighed_s, self.clock.now_s)
            self.reasons.has_payload = True

    def _note_zero(self, now_s: float) -> None:
        self.zeros.note_zero(now_s)
        self.tares.note_done()

    def _note_run_tare(self) -> None:
        self._note_tare()
        self.tares.note_asked(is_sure=False)

    def _note_tare(self) -> None:
        self.observer.history.tares.append(self.clock.now_s)

    def _on_write(self, control: int | None, is_answered: bool) -> None:
        if control == DISABLED_BY_BIT:  # which ends no run; a reset may be among the other bits
            control = BITS if self.observer.is_run else RESET
        was_enabled = self._begun_enabled if self._was_watched else self.observer.disabled_s is None
        excluded = RUN_BIT | SELF_TEST | (0 if was_enabled else ENABLE)
        if control is not None and control & excluded and control > 0 and is_answered:
            self.person.lose()  # a run that was asked for at the machine excludes that
            self._was_watched = False
        self._has_set_bits |= control == BITS and is_answered
        if is_answered:
            self.observer.note_serving(self.clock.now_s)
        note = self.observer.note_accepted if is_answered else self.observer.note_unanswered
        note(control, self._done_s(is_answered))

    def _done_s(self, is_answered: bool) -> float:
        """When a write has been executed at the latest: whose master has hung up is, when a machine goes on that stands."""
        return self.clock.now_s if is_answered else max(self.clock.now_s, self.service.thaws_s)

    def _on_death(self) -> None:
        self.status.forget_owner()
        self.lease.forget(self.clock.now_s, is_all=not self.service.is_guarded)
        self.target.forget()
        self.observer.note_death(self.clock.now_s, CABLES["output"].through_s)
        self._lose_control()
        self.person.lose()
        self._was_watched = False
        for master in self.clients:
            master.lose()
        self.reader.heard.clear()

    def _lose_control(self) -> None:
        if self.observer.control_lost_s is None:
            self.observer.control_lost_s = max(self.clock.now_s, self.service.thaws_s)

    _was_watched = _has_set_bits = _begun_enabled = False

    def _follow_person(self, is_watched: bool) -> None:
        """A run that somebody has started at the machine presses without a master, as long as that person looks at it."""
        self._has_set_bits &= self._was_watched
        if is_watched:
            if not self._was_watched:  # by a master that holds 0 N, and writes its 1 on
                self._begun_enabled = self.observer.disabled_s is None
            self.observer.note_accepted(RUN_BIT, self.clock.now_s)
        elif self._was_watched and self.observer.is_run:
            self.observer.note_accepted(0, self.clock.now_s)
            if self._has_set_bits:  # by a master that perhaps enables, since the run is over: that person sees it later
                self.observer.note_accepted(BITS, self.clock.now_s)
        self._was_watched = is_watched

    def _look(self) -> None:
        now_s, settings = self.clock.now_s, self.around.world.settings.values
        is_watched = self.person.watched_s is not None
        if is_watched or self._was_watched:
            self._follow_person(is_watched)
            self.lease.renew(now_s)  # that person is there
        if self.service.is_serving:
            self.observer.note_serving(now_s)
        else:
            self.reasons.note(MACHINE, now_s)
        self.around.look()
        self.around.tell_reasons(self.reasons)
        if settings:
            self.reasons.note_settings(settings, now_s)
            self.zeros.note_settings(settings, now_s)
        if not self.observer.is_safe:
            self.observer.look(now_s)
            self.lease.look(now_s)
        is_whole = bool(settings) and self.observer.control_lost_s is None and self.around.is_whole
        self.cell.look(settings, now_s, is_whole=is_whole)
        self.outside.call_later(LOOK_S, self._look)

    def _read_status(self) -> None:
        self._judge_unheard()
        for at_s, pdu in self.reader.heard:
            if pdu[:2] == COMMAND_BLOCK:
                self.commands.note(pdu[2:], at_s - DELAY_S)
                *_, band, band_ms = struct.unpack(f">{WORDS}h", pdu[2:])
                self.target.note_band(band, band_ms, at_s - DELAY_S)
                self.status.note_control_word(int.from_bytes(pdu[2:4]), at_s - DELAY_S)
            if pdu[:2] == FLOAT_BLOCK:
                self.status.note_floats(pdu[2:], at_s - DELAY_S)
            if pdu[0] == 3 and len(pdu) == 2 + 2 * STATUS_WORDS:
                self.observer.note_status(pdu, at_s)
                self.status.note(pdu[2:], at_s - DELAY_S)
                self.reasons.judge(pdu[2:], at_s - DELAY_S)
                self.held_force.note(pdu[2:], at_s - DELAY_S, CABLES["load_cell"].spoiled_s)
                self.explained.note(pdu[2:], at_s - DELAY_S, self.reasons.disturbed_s)
                self.target.note(pdu[2:], at_s - DELAY_S)
        self.reader.heard.clear()
        self.reader.ask(read_pdu(STATUS_FIRST, STATUS_WORDS))
        self._looks += 1
        if self._looks % COMMAND_EVERY == 0:
            self.reader.ask(read_pdu(0, WORDS))
        if self._looks % FLOATS_EVERY == 0:
            self.reader.ask(read_pdu(FLOAT_STATUS, 2 * len(SCALES)))
        self.outside.call_later(READ_S, self._read_status)

    def _judge_unheard(self) -> None:
        """Who only reads is answered at once, whatever the others do, as long as the process stands still for nobody."""
        self._unheard = 0 if self.reader.heard or not self.service.is_serving else self._unheard + 1
        if self._unheard > MOST_UNHEARD:
            self.observer.complain("I12", "a master that only reads is not answered", self.clock.now_s)
            self._unheard = 0

    def _run_for(self, duration_s: float) -> None:
        self.clock.run_until(self.clock.now_s + duration_s)

    def _read_force_n(self) -> float:
        """The force that the gateway shows, N; not a number where nobody answers."""
        self.masters["healer"].ask(read_pdu(102, 1))
        self._run_for(ANSWER_S)
        answers = [pdu for _, pdu in self.masters["healer"].heard if pdu[:2] == b"\x03\x02"]
        return float(struct.unpack(">h", answers[-1][2:4])[0]) * 0.01 if answers else nan


@garbage_left_alone()
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
