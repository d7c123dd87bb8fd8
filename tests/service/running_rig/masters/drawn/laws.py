"""The laws for drawn programs, written without code of the product's.

What hangs begins, raises, takes over and tares nothing behind one length of the lease since its heartbeat has moved last; what
goes on is told that it stands still in no more than two cycles in a row, and that it keeps a bit up no more than twice.

Where nobody can know who hung: behind a power cut each host may begin for one lease, anew in a process that begins before that
is over; so may a host whose own 0, within 0.8 s before the end of a process, was of another one of its programs. A certificate
that writes by lasting connections from two addresses may be two programs that tare beside each other: its last tare counts of
each, and so it is with the connections of a pool.
"""

from gateway.control import ControlSettings, LeaseAction
from gateway.registers import Refusal
from gateway.registers.words import State
from tests.service.running_rig.masters.drawn.programs import RUN_COIL_AND_ENABLE_COIL, Frame, Program
from tests.service.running_rig.simulated_rig import ENABLE, TARE, TICK_S, SmallRig

LEASE_S = 0.35
PRESSING = State.RAMPING, State.HOLDING, State.READY, State.CALIBRATING
COUNT = 0.011
MOST_STALE = 2
"""Cycles in a row in which a program whose heartbeat moves may be told that it stands still. Not counted is one in which
another host has switched the output off, or anybody has ended a run, between its heartbeat and its start: the frames of a
program that has just hung are the same, and nothing of that one begins behind a stop. There safety wins."""
DOWN_S = 4.1  # of any force, of a ladder say (wide seed 68897)


class Laws:
    """Sends the frames of programs to a rig, and judges what comes of it. told: what has happened, for whoever reads why."""

    control: ControlSettings
    rig: SmallRig
    lease_s = LEASE_S

    def __init__(self) -> None:
        self.programs: list[Program] = []
        self.told: list[str] = []
        self.moved_s: dict[str, float] = {}  # by a heartbeat that came for the first time, not by a frame that flows
        self.begun_s: dict[str, float] = {}
        self.excused: dict[str, float] = {}  # until when the frames of a host may begin, for nobody knows who had hung
        self.tared: set[tuple[str, tuple[str, int]]] = set()  # of which host, by which connection of a pool
        self.zero_s: dict[str, float] = {}
        self.ownerless_s: float | None = None
        self.writes = 0
        self.stopped_at: dict[str, int] = {}  # of each host the write that has switched the output off last

    def longest_period(self) -> int:
        """Return the ticks of a cycle that is short enough to keep the lease up."""
        return max(2, round(0.57 * self.lease_s / TICK_S))

    def longest_s(self, host: str) -> float:
        """Return the time in which each frame of a host comes once, and a lease is over, s."""
        return max((self.lease_s, *(p.period * TICK_S for p in self.programs if p.identity == host))) + TICK_S

    def meant(self, host: str) -> None:
        self.moved_s[host] = self.rig.now()
        self.forget_tares(host)

    def forget_tares(self, host: str) -> None:
        self.tared = {tared for tared in self.tared if tared[0] != host}

    def send(self, program: Program, frame: Frame) -> None:
        rig, host, now_s = self.rig, program.identity, self.rig.now()
        asks = program.asks
        if asks is None:
            return
        if program.note_beat(frame):
            self.meant(host)
        elif program.is_live:  # its first cycle has not come to its heartbeat yet
            self.moved_s.setdefault(host, now_s)
        state, owner, accepted = rig.loop.decision.state, rig.bank.owner, rig.loop.decision.force_accepted_n
        self.writes += 1
        stopped_at = max((at for other, at in self.stopped_at.items() if other != host), default=-1)
        peer = program.peer()
        refused = program.write(rig, frame, peer, self.writes, stopped_at)
        is_begun_and_stopped = frame is RUN_COIL_AND_ENABLE_COIL and not asks[0] & ENABLE
        if (state in PRESSING or is_begun_and_stopped) and rig.loop.decision.state not in PRESSING:
            self.stopped_at["" if state is State.CALIBRATING else host] = self.writes
            if owner == host:
                self.zero_s[host] = now_s
        is_begun = state not in PRESSING and rig.loop.decision.state in PRESSING
        is_local = rig.controller.active_run.is_local  # begun at a terminal, in the step that this write has woken
        is_begun = is_begun and not is_local
        is_run = state is not State.CALIBRATING and rig.loop.decision.state is State.CALIBRATING and not is_local
        rises = (
            not is_local
            and rig.loop.decision.state in PRESSING
            and rig.loop.decision.force_accepted_n > accepted + COUNT
        )
        takes = rig.bank.owner == host and owner not in (None, host)
        tares = (
            refused is None
            and bool(asks[0] & TARE)
            and rig.bank.command.peer == host
            and bool(int(rig.bank.command.control_word) & TARE)
        )
        way = peer.host, peer.port if program.pools else 0
        about = f"{program} {asks}: {'; '.join(self.told[-14:])}"
        self.note_sent(program, asks, refused)
        if is_begun or is_run or takes:
            self.begun_s[host] = now_s
        is_hung = not any(p.is_live and p.asks for p in self.programs if p.identity == host) and (
            now_s - self.moved_s.get(host, -99.0) > self.longest_s(host)
        )
        if is_hung:
            if host in self.excused and (is_begun or is_run or takes or rises or tares):
                self.excused[host] = min(self.excused[host], now_s + self.longest_s(host))
            if now_s > self.excused.get(host, -99.0):
                assert not is_begun, f"hung begins: {about}"
                assert not is_run, f"hung begins a run: {about}"
                is_begun_now = now_s - self.begun_s.get(host, -99.0) <= self.lease_s
                assert not rises or is_begun_now, f"hung raises: {about}"
                assert not takes, f"hung takes over: {about}"
                assert not (tares and (host, way) in self.tared), f"hung tares again: {about}"
        if tares:
            self.tared.add((host, way))
        is_alone = not any(p.is_mistaken_for(program) for p in self.programs if p is not program and p.identity == host)
        if program.is_live and program.period <= self.longest_period() and program.cycles > 1 and is_alone:
            assert program.stale <= self.most_stale(program), f"honest is told stale: {about}"
            assert program.held <= 2, f"honest is told held: {about}"

    def note_sent(self, program: Program, asks: tuple[int, int], refused: Refusal | None) -> None:
        what = f"{self.programs.index(program)} {asks} {refused.reason.name if refused else 'taken'}"
        if what not in (told.partition(" ")[2] for told in self.told[-3:]):
            self.told.append(f"{self.rig.now():.2f} {what}")

    def most_stale(self, program: Program) -> int:
        """Return how often in a row a program that goes on may be told that it stands still: once more beside another one on
        its host that tares as well (seed 64932)."""
        beside = (other for other in self.programs if other is not program and other.identity == program.identity)
        return MOST_STALE + any(other.asks and other.asks[0] & TARE for other in beside)

    # -- who presses?

    def judge_presence(self) -> None:
        rig, now_s = self.rig, self.rig.now()
        if rig.loop.decision.state not in PRESSING or rig.controller.active_run.is_local:
            self.ownerless_s = None
            return
        owner = rig.bank.owner
        about = f"{owner}: {'; '.join(self.told[-14:])}"
        if owner is None:
            self.ownerless_s = now_s if self.ownerless_s is None else self.ownerless_s
            is_held = self.control.supervision.lease_action is LeaseAction.HOLD
            assert is_held or now_s - self.ownerless_s < DOWN_S, f"pressed for nobody {about}"
            return
        self.ownerless_s, since_s = None, max(self.moved_s.get(owner, -99.0), self.begun_s.get(owner, -99.0))
        assert now_s - since_s < self.lease_s + DOWN_S, f"presses without a beat {about}"
