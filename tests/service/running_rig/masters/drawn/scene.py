"""A rig with programs on two hosts, some of which hang, and with people, as a seed draws them: deaths, ends, power cuts."""

from collections.abc import Iterator
from dataclasses import replace
from math import inf
from random import Random
from typing import Any

from gateway.codes.faults import FaultCode
from gateway.control import LeaseAction
from gateway.control.runs.ladder_stairs import CalibrationPlan
from gateway.control.settings import Defaults, SafeDirection, SelfTestSettings, ValveControl
from gateway.modbus import Peer
from gateway.registers import Refusal
from gateway.registers.words import State
from gateway.service.running_rig.handover import Handover, left_of
from tests.control.bench import settings
from tests.control.valve.valve_bench import SHARE
from tests.service.running_rig.masters.drawn.laws import LEASE_S, PRESSING, Laws
from tests.service.running_rig.masters.drawn.programs import SPELLINGS, Program, is_serial, zeros_by_each_function
from tests.service.running_rig.simulated_rig import (
    CALIBRATE,
    ENABLE,
    RESET,
    SELF_TEST,
    TAKE,
    TARE,
    TICK_S,
    VALVE,
    SmallRig,
)

PAGE = Peer("web")
HELD_S = 1.0
"""Who has its force for so long, and for two leases, has it."""
HAPPENINGS = (
    *("hang",) * 4,
    *("go on",) * 2,
    *("ask",) * 5,
    *("rest", "zeros", "0 here", "0 here", "reset here", "stop", "reset", "5 N", "take", "tare", "run here"),
    *("cell", "cell", "output", "death", "death", "end", "power cut"),
)


class Scene(Laws):
    """Draws; the laws judge."""

    hosts: tuple[str, ...] = ("10.0.0.5", "10.0.0.6", "plc")
    counts: tuple[int, ...] = (1, 2)
    spellings = SPELLINGS
    happenings: tuple[str, ...] = HAPPENINGS

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.draw = draw = Random(seed)
        control = settings(lease_s=self.lease_s, lease_action=draw.choice(tuple(LeaseAction)))
        valve = ValveControl(pull_area_share=SHARE, safe=draw.choice(tuple(SafeDirection)))
        ramp = Defaults(force_ramp_n_per_s=draw.choice((5.0, 30.0, 200.0)))
        self.control = replace(
            control, defaults=ramp, self_test=SelfTestSettings(), valve=valve if draw.random() < 0.2 else None
        )
        self.needs_proof = draw.random() < 0.2
        hosts = draw.sample(self.hosts, draw.choice(self.counts))
        super().__init__()
        for place, host in enumerate(self.hosts_of_programs(hosts)):
            program = Program(draw, host, place, self.spellings)
            while any(other.identity == program.identity and program.is_like(other) for other in self.programs):
                program = Program(draw, host, place, self.spellings)
            self.programs.append(program)
        self.kept, self.left = dict[str, Any](), dict[str, Any]()
        self.told = [f"{seed}: {self.control.supervision.lease_action.name}, {', '.join(map(str, self.programs))}"]
        self.rig = SmallRig(self.control, needs_proof=self.needs_proof)
        self.begin_process(None, self.rig)

    def hosts_of_programs(self, hosts: list[str]) -> Iterator[str]:
        for host in hosts:
            for _ in range(1 if is_serial(host) else self.draw.choice((1, 1, 2))):  # a bus has one master
                yield host

    # -- processes

    def begin_process(self, left_beats: list[int] | None, rig: SmallRig) -> None:
        self.rig, rig.beats = rig, False
        hand = Handover(dict(self.kept), record=False)
        hand.restore_held(rig.bank, rig.now(), lambda **facts: self.kept.update(facts), left_beats)
        self.last_told: tuple[str | None, list[int]] = None, [0]
        self.is_cell_silent = rig.is_cell_silent
        self.ownerless_s = None

    def end_process(self, how: str) -> None:
        rig, (owner, beats) = self.rig, self.last_told
        if how == "end":
            rig.controller.stop()
            rig.bank.held_enables.note_lost(rig.bank.owner, rig.bank.command.heartbeat)
            for _ in range(450):
                if rig.controller.has_stopped:
                    break
                self.tick()
            self.kept = self.left = left_of(self.kept)
        elif how == "power cut":
            self.kept = dict(self.left)
            self.excused = dict.fromkeys((program.identity for program in self.programs), inf)
            self.tared.clear()
        else:
            self.kept["owner"] = owner
        for host, until_s in self.excused.items():
            if rig.now() <= until_s:  # this process has known it for less than a lease
                self.excused[host] = inf
        for host, zero_s in self.zero_s.items():
            if rig.now() - zero_s < 0.8:
                self.excused[host] = inf
        again = SmallRig(
            self.control, is_restarted=how != "end", needs_proof=self.needs_proof, began_s=rig.now(), seed=self.seed
        )
        for program in self.programs:
            program.begin_anew()  # of what each has brought the new process knows what was told last, and no more
        self.moved_s = {host: moved_s + again.now() - rig.now() for host, moved_s in self.moved_s.items()}
        self.begin_process(beats if how == "death" else None, again)

    # -- what happens

    def happen(self) -> None:
        draw, rig, program = self.draw, self.rig, self.draw.choice(self.programs)
        name = draw.choice(self.happenings)
        self.told.append(f"{rig.now():.2f} {self.programs.index(program)} {name}")
        if name in ("hang", "go on"):
            program.is_live = name == "go on"
            program.begin_anew()
        elif name == "ask" and program.is_live:
            valve = draw.choice((0, VALVE)) if self.control.valve else 0
            program.wants = draw.choice(
                (
                    (ENABLE | valve | draw.choice((0, 0, TAKE)), draw.choice((300, 800, 1200))),
                    (ENABLE | valve | draw.choice((0, 0, TAKE)), draw.choice((300, 800, 1200))),
                    (draw.choice((TARE, CALIBRATE, SELF_TEST)) | draw.choice((0, 0, TAKE)), 0),
                )
            )
            self.told[-1] += f" {program.wants}"
        elif name in ("rest", "zeros") and program.is_live:
            program.wants = None
        elif name in ("0 here", "reset here"):
            self.write_here(program, name)
        elif name in ("death", "end", "power cut"):
            self.end_process(name)
        else:
            self.happen_elsewhere(name)

    def happen_elsewhere(self, name: str) -> None:
        draw, rig = self.draw, self.rig
        beat = draw.randrange(1, 65536)
        if name == "stop":
            self.answer(lambda: rig.write(0, 0, peer=PAGE))
        elif name == "reset":
            self.answer(lambda: rig.write(0, RESET, 0, 0, 0, beat, peer=PAGE))
        elif name == "5 N":
            self.answer(lambda: rig.write(1, 500, peer=PAGE))
        elif name == "take":
            self.meant(PAGE.identity)
            self.answer(lambda: rig.write(0, ENABLE | TAKE, 500, 0, 0, beat, peer=PAGE))
        elif name == "tare":
            self.answer(lambda: rig.write(0, TARE, peer=PAGE))
        elif name == "cell":
            rig.is_cell_silent = not rig.is_cell_silent
        elif name == "output":
            rig.wire.fault = FaultCode.OUTPUT_LOST if rig.wire.fault is FaultCode.NONE else FaultCode.NONE
        elif name == "run here":
            rig.controller.active_run.ask(CalibrationPlan())

    def write_here(self, program: Program, name: str) -> None:
        """Somebody on the host of a program."""
        rig, draw, host = self.rig, self.draw, program.identity
        peer = replace(program.peer(), port=999)
        if name == "reset here":
            self.meant(host)
            self.answer(lambda: rig.write(0, RESET, 0, 0, 0, draw.randrange(1, 65536), peer=peer))
            return
        ways = zeros_by_each_function(rig, peer)
        way = draw.choice(tuple(ways))
        self.told[-1] += f" {way}"
        if way == "block":
            self.meant(host)  # with a heartbeat that may be another one
        self.forget_tares(host)
        self.zero_s[host] = rig.now()
        self.answer(ways[way])

    def answer(self, act: Any) -> None:
        try:
            act()
        except Refusal as refusal:
            self.told[-1] += f" {refusal.reason.name}"

    # -- programs

    def tick(self) -> None:
        rig = self.rig
        for program in self.programs:
            for frame in program.due(rig.ticks):
                self.send(program, frame)
        rig.run(TICK_S)
        self.last_told = rig.bank.owner, rig.loop.owner_beats
        self.judge_presence()

    # -- the end

    def play(self, steps: int) -> None:
        for _ in range(steps):
            self.happen()
            for _ in range(self.draw.choice((1, 3, 10, 20, 45))):
                self.tick()
        self.calm()

    def calm(self) -> None:
        """Nothing happens any more that stands against the last program, and it has its force."""
        rig, honest = self.rig, self.draw.choice(self.programs)
        rivals = [p for p in self.programs if p.identity != honest.identity]
        others = [p for p in self.programs if p.identity == honest.identity and p is not honest]
        for p in rivals:
            p.is_live = False
            if p.asks and not p.asks[0] & ENABLE:
                p.asks = None  # whose 0 would be another one's stop
        for p in others:
            if p.asks and not p.asks[0] & ENABLE:
                p.asks = None
            p.is_live = False
        honest.period = min(honest.period, self.longest_period())
        honest.is_live, honest.wants = True, (ENABLE, 900)
        honest.begin_anew()
        honest.takes_if_told = honest.resets = True
        rig.is_cell_silent, rig.wire.fault = False, FaultCode.NONE
        self.told.append(f"{rig.now():.2f} calm {self.programs.index(honest)}")
        if rig.controller.active_run.is_local:
            self.answer(lambda: rig.write(0, 0, peer=PAGE))
        held = 0
        for _ in range(400 + round(2.0 * (self.lease_s - LEASE_S) / TICK_S)):
            for p in others if rig.loop.decision.state is State.FAULT else ():
                p.asks = None  # its setpoint would be in the way of a reset
            self.tick()
            has_force = rig.loop.decision.state in PRESSING and rig.bank.owner == honest.identity
            held = held + 1 if has_force else 0
            if held * TICK_S > HELD_S + 2.0 * self.lease_s:
                break
        assert rig.loop.decision.state in PRESSING, f"honest has no force {honest}: {'; '.join(self.told[-14:])}"
        assert rig.bank.owner == honest.identity, f"honest owns not: {honest}: {'; '.join(self.told[-14:])}"
