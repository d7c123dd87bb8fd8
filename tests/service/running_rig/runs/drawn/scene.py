"""One scene of runs: what masters, people at the machine, lines, devices and the tool do in half a minute, from one seed."""

from collections.abc import Callable
from pathlib import Path
from random import Random

from gateway.control import CalibrationInUse
from gateway.modbus import Peer
from gateway.registers import Refusal
from gateway.registers.words import State
from tests.control.bench import bsfm
from tests.service.running_rig.runs.drawn import acts, events
from tests.service.running_rig.runs.drawn.acts import MASTERS
from tests.service.running_rig.runs.drawn.draws import draw_rig
from tests.service.running_rig.runs.drawn.judge import Judge
from tests.service.running_rig.runs.drawn.recorded import Recorded
from tests.service.running_rig.runs.drawn.run_laws import Asked
from tests.service.running_rig.runs.drawn.run_rig import Fits
from tests.service.running_rig.simulated_rig import CALIBRATE, ENABLE, OWNER, RESET, SELF_TEST, TAKE, TARE

FOLLOWS_TICKS = 20
"""Between two questions of who follows a run at its terminal."""
PAUSES = 0.02, 0.1, 0.3, 0.8, 1.5, 4.0
RUNS = {CALIBRATE: "calibration", SELF_TEST: "self-test"}


class Scene:
    """told: what has happened, for who reads of a law that did not hold. is_quiet: one run after the other, nothing else."""

    def __init__(self, seed: int, folder: Path) -> None:
        self.seed, self.draw = seed, (draw := Random(seed))
        self.rig = draw_rig(draw, folder, seed)
        self.judge = Judge(self.rig)
        self.laws, self.recorded = self.judge.laws, Recorded(self)
        self.rig.on_tick = self._tick
        self.told: list[str] = []
        self.beats = {master.host: 5000 * number for number, master in enumerate(MASTERS)}
        self.beating = set(self.beats)
        self.is_followed, self.scale, self.calibration = False, 1.0, 1
        self.pace, self.is_quiet = draw.choice((0.5, 1.0, 4.0)), draw.random() < 0.25
        Fits.answer = None

    # -- time

    def _tick(self) -> None:
        self.judge.look()
        self.recorded.look()
        rig = self.rig
        if self.is_followed and rig.ticks % FOLLOWS_TICKS == 0:
            rig.runs.answer({})
            self.laws.followed_s = rig.now()
        if self.judge.is_disturbed and self.judge.is_over and self.is_well:
            self.judge.is_disturbed = False
        if rig.ticks % 10 == 0:
            for master in MASTERS:
                if master.host in self.beating and rig.bank.owner == master.host:
                    self.write(master, 4, self.next_beat(master), name="")

    def note(self, words: str) -> None:
        """Tell what happens now."""
        self.told.append(f"{self.rig.now():.2f} {words}")

    def next_beat(self, master: Peer) -> int:
        """A heartbeat that this master has not written yet."""
        self.beats[master.host] += 1
        return self.beats[master.host]

    def renew(self, *, is_restarted: bool) -> None:
        """Another process is there, which knows nothing of the one before."""
        self.is_followed, self.scale, self.calibration = False, 1.0, 1
        self.recorded.killed()
        self.rig.let_go()
        self.rig.start(is_restarted=is_restarted)
        self.judge.restarted()
        Fits.answer = None

    # -- what is asked of the gateway

    def write(self, master: Peer, address: int, *words: int, name: str) -> bool:
        """Write registers as this master."""
        rig, run, judge = self.rig, self.laws.run, self.judge
        word = words[0] if address == 0 else 0
        rises = word & ~rig.word("control_word")
        begins = next((kind for bit, kind in RUNS.items() if rises & bit), "force" if rises & ENABLE else "")
        before, judge.taken_by = judge.taken_by, master.host if word & TAKE else judge.taken_by
        asked = Asked(begins, master, with_enable=bool(word & ENABLE))
        if not self.ask(asked, name, lambda: rig.write(address, *words, peer=master)):
            judge.taken_by = before
            return False
        if address == 0 and run:
            acts.judge_stop(self, run, words)
        return True

    def ask(self, asked: Asked, name: str, act: Callable[[], object]) -> bool:
        """Ask, and judge what comes of it at once; return whether it was taken. A refusal changes nothing."""
        rig, judge, laws = self.rig, self.judge, self.laws
        before, since = (judge.state, rig.wire.voltage_v), len(rig.log)
        resting_v = max(rig.settings.limits.safe_voltage_v, rig.settings.limits.voltage_min_v)
        beat, owner, said = rig.word("heartbeat"), rig.bank.owner, f"{asked.by} {name}"
        try:
            act()
        except (Refusal, ValueError) as refusal:
            if name:
                self.note(f"{said}: {refusal}"[:160])
            if (judge.state, rig.wire.voltage_v) != before:
                judge.complain(f"{name} was refused, and {before} became {judge.state.name}, {rig.wire.voltage_v} V")
            if isinstance(refusal, Refusal) and rig.word("refusal_reason") != refusal.reason:
                judge.complain(f"refusal_reason is {rig.word('refusal_reason')} behind {refusal}")
            return False
        if name:
            self.note(said)
        if asked.master is None:
            laws.followed_s = rig.now()
        if rig.word("heartbeat") != beat or rig.bank.owner != owner:
            laws.beaten_s = rig.now()
        if judge.state is State.CALIBRATING and laws.run is None:
            if Fits.answer:
                judge.complain("a run begins while the last ladder is being fitted")
            if before[1] > resting_v:
                judge.complain(f"a run begins from {before[0].name} with {before[1]:.2f} V")
            laws.begin(asked, self.scale, since, is_odd=not self.is_whole)
        judge.begins = bool(asked.kind)
        judge.look(in_a_write=True)
        judge.begins = False
        return True

    @property
    def is_whole(self) -> bool:
        """Whether cell, valve and tool are as the rig file says."""
        rig, plant, relay = self.rig, self.rig.plant, self.rig.relay
        told = plant.contact, plant.air, plant.unit, rig.outside_n, rig.cell, rig.cell_late
        obeys = relay is None or (relay.is_stuck, relay.silent_s, relay.lost) == (False, None, False)
        is_zero = abs(rig.controller.zero_n) < 0.3 and rig.word("payload") == 0
        is_right = rig.relay is not None or plant.sign > 0.0
        return (
            told == (True, True, 1.0, 0.0, "well", 0)
            and plant.noise_n == rig.noise_n
            and is_zero
            and obeys
            and is_right
        )

    @property
    def is_well(self) -> bool:
        """Whether all is as it was made, and everybody is there."""
        return self.is_whole and self.rig.wire.how == "well" and len(self.beating) == len(MASTERS)

    # -- the scene

    def play(self) -> "Scene":
        """Play it to its end, or to the first law that does not hold."""
        until_s = self.rig.now() + self.draw.choice((10.0, 20.0, 30.0))
        while self.rig.now() < until_s and not self.judge.broken:
            self._act()
            self.rig.run(self.pace * self.draw.choice(PAUSES))
        if not self.judge.broken:
            self._end()
        self.rig.let_go()
        return self

    def _act(self) -> None:
        draw, state = self.draw, self.judge.state
        if self.is_quiet and state is not State.FAULT:
            acts.begin(self)
            while self.judge.state is State.CALIBRATING and not self.judge.broken:
                self.rig.run(0.5)
            acts.fit(self)
        elif state is State.FAULT and draw.random() < 0.7:
            events.heal(self)
            self.rig.run(1.5)
            if acts.reset(self):
                events.note_reset(self)
                self.judge.is_disturbed = not self.is_well
        elif state is State.CALIBRATING:
            draw.choice((acts.stop, acts.stop, acts.meddle, acts.press, events.befall, events.befall))(self)
        elif state is State.OFF and draw.random() < 0.7:
            acts.begin(self)
        else:
            draw.choice((acts.press, acts.press, acts.meddle, acts.stop, acts.begin, events.befall, acts.fit))(self)

    def _end(self) -> None:
        """Whatever was: healed and reset, what is asked then works."""
        rig, judge = self.rig, self.judge
        events.heal(self)
        self.is_followed, self.beating = False, set(self.beats)
        judge.note_end("hangs")
        self.write(OWNER, 0, 0, name="switches off")
        rig.run(5.0)
        self.write(OWNER, 0, TAKE, name="takes over")
        self.write(OWNER, 9, 0, name="has no payload")
        acts.fit(self)
        rig.controller.use(CalibrationInUse(bsfm(), 1))
        self.scale = 1.0
        rig.make_as_calibrated()
        self.write(OWNER, 0, RESET, 0, 0, 0, self.next_beat(OWNER), name="resets")
        rig.plant.contact = False  # where the safe voltage presses the tool is lifted first
        rig.run(2.5)
        if not self.write(OWNER, 0, TARE, 0, 0, 0, self.next_beat(OWNER), name="tares"):
            judge.complain("no tare behind healing and reset")
            return
        judge.is_disturbed, rig.plant.contact = False, True
        rig.run(1.0)
        if self.draw.random() < 0.3:
            self._end_with_a_test()
        else:
            self._end_with_a_force()

    def _end_with_a_test(self) -> None:
        if self.rig.relay:
            acts.push(self, OWNER)
        self.write(OWNER, 0, SELF_TEST, 0, 0, 0, self.next_beat(OWNER), name="tests")
        if self.judge.state is not State.CALIBRATING:
            self.judge.complain("no self-test behind healing and reset")
        self.rig.run(20.0)
        if self.judge.state is not State.OFF:
            self.judge.complain(f"{self.judge.state.name} 20 s behind the begin of a self-test")

    def _end_with_a_force(self) -> None:
        rig = self.rig
        if not self.write(OWNER, 0, ENABLE, 1000, 0, 0, self.next_beat(OWNER), name="enables"):
            self.judge.complain("no enable behind healing and reset")
            return
        ramp_s = 10.0 / rig.settings.defaults.force_ramp_n_per_s
        rig.run(2.0 + ramp_s + (1.0 if rig.relay else 0.0))
        if abs(rig.plant.force_n - 10.0) > 1.2:
            self.judge.complain(f"{rig.plant.force_n:.2f} N press where 10 N are asked for, {self.judge.state.name}")
