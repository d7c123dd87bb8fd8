"""Three masters who command, take over, stop, beat and hang as a seed draws it, beside a valve and a workpiece that comes and
goes: nothing is pressed that its own master has not asked for.

Who becomes responsible for the output, by a takeover, by a beat beside what is held for a lost master, or by a setpoint of its
own, has asked for what it writes, and goes on with what is pressed at that moment, in its mode and direction; nothing else.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from random import Random
from struct import pack

import pytest

from gateway.control import LeaseAction
from gateway.control.settings import Defaults, SafeDirection, ValveControl
from gateway.modbus import Peer
from gateway.registers import Refusal
from gateway.registers.words import Mode, State, StatusBit
from tests.control.bench import settings
from tests.control.valve.valve_bench import SHARE
from tests.service.running_rig.simulated_rig import ENABLE, OTHER, OWNER, RESET, TAKE, VALVE, SmallRig

MASTERS = OWNER, OTHER, Peer("10.0.0.7", 4003)
FORCES, VOLTAGES_MV, RAMPS = (0, 300, 1200, 3000), (0, 1000, 3000, 6000), (5.0, 30.0, 200.0)
STEPS, PAUSES, BEAT_TICKS = 120, (1, 1, 5, 20, 60), 10
COUNT = 0.011
SEEDS = 5, 18, 30, 44
"""What was pressed so once is seen by these."""


@dataclass
class Shown:
    """What a look at the registers tells."""

    mode: int = 0
    accepted_n: float = 0.0
    asked_mv: int = 0
    pulls: bool = False
    valve_bit: int = 0


@dataclass
class Asked:
    """What the master that is responsible has asked for: host, force, voltage; pulls: the direction of what it only goes on
    with, None once it has said something about it."""

    host: str | None = None
    force_n: float = 0.0
    voltage_mv: int = 0
    pulls: bool | None = None


class Scene:
    """A rig with its masters; `play` draws and judges."""

    def __init__(self, seed: int) -> None:
        self.draw = draw = Random(seed)
        control = settings(lease_s=draw.choice((None, 0.35, 0.35)), lease_action=draw.choice(tuple(LeaseAction)))
        valve = ValveControl(pull_area_share=SHARE, safe=draw.choice(tuple(SafeDirection)))
        ramp = Defaults(force_ramp_n_per_s=draw.choice(RAMPS))
        self.rig = SmallRig(replace(control, defaults=ramp, valve=draw.choice((None, valve))), seed=seed)
        self.rig.beats = False
        self.beats = dict.fromkeys((master.host for master in MASTERS), 0)
        self.beating: set[str] = set()
        self.shown, self.asked = Shown(), Asked()
        self.told: list[str] = []

    def play(self) -> None:
        for _ in range(STEPS):
            self._act(self.draw.choice(MASTERS))
            for _ in range(self.draw.choice(PAUSES)):
                self._beat()
                self.rig.run(0.01)
                self._judge()

    # -- masters

    def _act(self, master: Peer) -> None:
        rig, draw = self.rig, self.draw
        bits = ENABLE | draw.choice((0, 0, TAKE)) | (draw.choice((0, 0, VALVE)) if rig.settings.valve else 0)
        force, volts_mv, mode = draw.choice(FORCES), draw.choice(VOLTAGES_MV), draw.choice((0, 0, 1))
        acts: tuple[tuple[str, Callable[[], None]], ...] = (
            ("block", lambda: rig.write(0, bits, force, 0, mode, self._next_beat(master), peer=master)),
            ("word", lambda: rig.write(0, bits, peer=master)),
            ("force", lambda: rig.write(1, force, peer=master)),
            ("float", lambda: rig.bank.write_registers(202, pack(">f", force / 100), master)),
            ("coil 3", lambda: rig.bank.write_bits(3, [True], master)),
            ("voltage", lambda: rig.write(5, volts_mv, peer=master)),
            ("mode", lambda: rig.write(3, mode, peer=master)),
            ("coil 4", lambda: rig.bank.write_bits(4, [bool(bits & VALVE)], master)),
            ("stop", lambda: rig.write(0, draw.choice((0, TAKE)), peer=master)),
            ("reset", lambda: rig.write(0, RESET, 0, 0, 0, self._next_beat(master), peer=master)),
            ("band", lambda: rig.write(11, 100, peer=master)),
        )
        self.told.append(f"{rig.now():.2f} s {master.host} ")
        if draw.random() < 0.15:
            self.beating ^= {master.host}
            self.told[-1] += "beats" if master.host in self.beating else "hangs"
        elif draw.random() < 0.07:
            rig.plant.contact = not rig.plant.contact
            self.told[-1] += f"sees contact {rig.plant.contact}"
        else:
            name, act = draw.choice(acts)
            self.told[-1] += name
            self._write(
                master, act, brings_force=name in ("block", "force", "float", "reset"), brings_voltage=name == "voltage"
            )

    def _beat(self) -> None:
        for master in MASTERS if self.rig.ticks % BEAT_TICKS == 0 else ():
            if master.host in self.beating:
                self._write(master, lambda master=master: self.rig.write(4, self._next_beat(master), peer=master))  # type: ignore[misc]

    def _next_beat(self, master: Peer) -> int:
        self.beats[master.host] += 1
        return self.beats[master.host]

    def _write(
        self, master: Peer, act: Callable[[], None], *, brings_force: bool = False, brings_voltage: bool = False
    ) -> None:
        self._look()
        try:
            act()
        except Refusal as refusal:
            self.told[-1] += f", {refusal.reason.name}"
            return
        rig, asked, shown = self.rig, self.asked, self.shown
        if asked.host != master.host and (rig.bank.owner == master.host or brings_force or brings_voltage):
            goes_on_n = min(asked.force_n, shown.accepted_n) if shown.mode == Mode.FORCE else 0.0
            goes_on_mv = shown.asked_mv if shown.mode == Mode.VOLTAGE else 0
            self.asked = asked = Asked(master.host, goes_on_n, goes_on_mv, shown.pulls)
        elif asked.host == master.host and rig.word("control_word") & VALVE != shown.valve_bit:
            asked.pulls = None
        if asked.host == master.host and brings_force:
            asked.force_n, asked.pulls = rig.word("force_setpoint") / 100, None
        if asked.host == master.host and brings_voltage:
            asked.voltage_mv, asked.pulls = rig.word("voltage_setpoint"), None

    # -- who has asked for it?

    def _look(self) -> int:
        word, rig = self.rig.word("status_word"), self.rig
        self.shown = Shown(
            rig.word("mode"),
            rig.word("force_accepted") / 100,
            rig.word("voltage_setpoint"),
            bool(word & StatusBit.PULLING),
            rig.word("control_word") & VALVE,
        )
        return word

    def _judge(self) -> None:
        if not self._look() & StatusBit.ENABLED:
            return
        rig, shown, asked = self.rig, self.shown, self.asked
        about = f"{shown}, {asked}: {'; '.join(self.told[-12:])}"
        if shown.mode == Mode.VOLTAGE:
            assert rig.state is State.RAMPING or rig.wire.voltage_v * 1000 <= asked.voltage_mv + COUNT, about
            return
        assert shown.accepted_n <= asked.force_n + COUNT, about
        assert asked.pulls in (None, shown.pulls) or shown.accepted_n <= COUNT, about


@pytest.mark.parametrize("first", SEEDS)
def test_nothing_is_pressed_that_its_own_master_has_not_asked_for(first: int, budget: int) -> None:
    for seed in (first, *range(1000 * first, 1000 * first + 5 * (budget - 1))):
        scene = Scene(seed)
        scene.play()
        assert scene.rig.trace
