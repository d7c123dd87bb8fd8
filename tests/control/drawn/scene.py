"""One scene of force control: what a master asks for, and what befalls machine, air, cell and output, from one seed."""

from collections.abc import Callable
from math import inf, pi, radians, sin
from random import Random

from gateway.control import Output
from gateway.registers.words import ControlBit, LimitedBy, Mode, State, StatusBit
from tests.control.drawn.judge import Judge
from tests.control.drawn.rig import DrawnRig, draw_response

SHORT_S = 0.05, 0.2, 0.6, 2.0
PAUSES_S = 0.0, 0.0, 0.1, 0.4, 1.0
OVERSHOOT_SHARE = 0.1
BUMP_V = 0.05  # a trim's step and noise


class WatchedRig(DrawnRig):
    """Shows each step to its judge."""

    judge: Judge | None = None

    def step(self) -> Output:
        output = super().step()
        if self.judge:
            self.judge.look(self.history[-1])
            if len(self.history) > 50:
                del self.history[:-2]
        return output


class Scene:
    """told: what has happened, for who reads of a law that did not hold."""

    lengths_s: tuple[float, ...] = 6.0, 10.0, 15.0

    def __init__(self, seed: int) -> None:
        self.seed, self.draw = seed, Random(f"scene {seed}")
        self.build(seed)
        machine, settings = self.rig.machine, self.rig.settings
        self.told = [f"{machine}", f"{settings}", f"{self.rig.response}, {self.rig.tick_ms} ms, {self.rig.cell_ms} ms"]
        if settings.supervision.lease_s:
            self.rig.heartbeat_every_ms = 100
        self.is_calm = self.draw.random() < 0.4

    def build(self, seed: int) -> None:
        """Draw the rig, and give it its judge."""
        self.rig = WatchedRig(seed)
        self.rig.judge = self.judge = Judge(self.rig)

    def note(self, words: str) -> None:
        self.told.append(f"{self.rig.now_s:.2f} {words}")

    def play(self) -> "Scene":
        """Play it to its end, or to the first law that does not hold."""
        rig, draw = self.rig, self.draw
        until_s = draw.choice(self.lengths_s)
        self._run(0.3)
        self._write("payload told", payload_kg=rig.machine.payload_kg)
        while rig.now_s < until_s and not self.judge.broken:
            self._act()
        return self

    def _run(self, seconds: float) -> None:
        left_s = seconds
        while left_s > 0.0 and not self.judge.broken:
            self.rig.run(min(0.1, left_s))
            left_s -= 0.1

    def _write(self, words: str, **changes: object) -> bool:
        rig = self.rig
        self.judge.changed()
        rig.write(**changes)
        self.note(f"{words} {changes}: {rig.refused or 'taken'}"[:200])
        return rig.refused is None

    def _act(self) -> None:
        state = self.rig.last.state
        if state is State.FAULT:
            self._mend()
            return
        if state is State.OFF:
            self._enable()
            return
        self.draw.choice(self.acts())()
        self._run(self.draw.choice(PAUSES_S))

    def acts(self) -> list[Callable[[], None]]:
        """What may happen to an enabled output, as often as it is in the list."""
        acts: list[Callable[[], None]] = [self._go, self._go, self._go, self._hold, self._hold]
        acts += [self._go, self._go, self._change, self._sine, self.draw.choice((self._volts, self._switch_off))]
        if not self.is_calm:
            acts += [self._befall, self._befall, self._befall, self._swap]
        return acts

    @property
    def enabling(self) -> ControlBit:
        """The word that enables."""
        return ControlBit.ENABLE

    def _force_n(self) -> float:
        most_n = self.rig.settings.limits.force_max_n
        return round(self.draw.choice((0.0, 1.0, most_n, *(self.draw.uniform(0.5, most_n) for _ in range(8)))), 2)

    # -- what a master does

    def _mend(self) -> None:
        rig = self.rig
        self._heal()
        self._run(1.5 + 6.0 * rig.whole_s)
        self._write("off", control_word=ControlBit(0), force_setpoint_n=0.0, mode=Mode.FORCE)
        self._write("reset", control_word=ControlBit.RESET_FAULT, heartbeat=(rig.command.heartbeat + 1) % 1000)
        if rig.last.state is State.FAULT:
            self.judge.complain(f"no reset behind healing: {rig.refused}")

    def _heal(self) -> None:
        rig = self.rig
        rig.machine.air, rig.machine.push_n = True, 0.0
        rig.cell_silent = rig.cell_frozen = rig.output_silent = False
        rig.cell_late_ms, rig.false_n = 0, 0.0
        rig.line = rig.line._replace(unanswered_since_s=None)
        self.judge.disturbed.clear()

    def _enable(self) -> None:
        rig = self.rig
        if rig.machine.force_n > 0.5:
            self._run(3.0 * rig.whole_s)
        if self.draw.random() < 0.1:
            self._tare()
        self.judge.is_spoilt = bool(self.judge.disturbed)
        force_n = self.draw.choice((0.0, self._force_n()))
        self._write(
            "enable", control_word=self.enabling, force_setpoint_n=force_n, mode=Mode.FORCE,
            heartbeat=(rig.command.heartbeat + 1) % 1000,
        )  # fmt: skip
        self._run(self.draw.choice((0.2, 0.6, 1.5)))

    def _tare(self) -> None:
        """In the air, where nothing presses."""
        rig = self.rig
        rig.machine.gap_s = inf
        self._run(1.0 + 6.0 * rig.machine.cell_lag_s)
        self._write("tare", control_word=ControlBit.TARE)
        rig.machine.gap_s = 0.2

    def _go(self) -> None:
        """To another force; long enough, mostly, that it must have arrived."""
        rig, judge, was_n = self.rig, self.judge, self.rig.command.force_setpoint_n
        force_n = self._force_n()
        has_come = rig.now_s - judge.calm_since_s > 0.5 + 5.0 * rig.whole_s  # and does not only pass by
        is_held = has_come and rig.last.status & StatusBit.IN_BAND and rig.command.mode is Mode.FORCE
        trim_v, before_n, top_n = rig.last.trim_v, rig.machine.force_n, max((n for _, n in judge.recent), default=0.0)
        if not self._write("force", force_setpoint_n=force_n):
            return
        if is_held and rig.machine.touches:
            if force_n < was_n - 1.0:
                judge.bound(top_n + judge.slip_n, "a lowered setpoint")
            elif force_n > was_n + 2.0:
                standing_n = max(force_n - judge.bias_n, judge.standing_n(force_n, max(0.0, trim_v)))
                lead = self._lead_share()
                top_n = standing_n + (OVERSHOOT_SHARE + lead) * (standing_n - min(before_n, was_n)) + judge.slip_n
                judge.bound(top_n, "an overshoot")
        self._run(self.draw.choice((0.3, 1.0, 1.0, 2.0, 2.0, judge.settling_s() + 0.5)))

    def _lead_share(self) -> float:
        """How much too strong a lead is that was measured on a slower machine than this one."""
        rig = self.rig
        if rig.response is None:
            return 0.0
        return max(0.0, rig.response.lag_s / rig.machine.lag_s - 1.0)

    def _hold(self) -> None:
        self._run(self.draw.choice((1.0, 1.0, 1.0, self.judge.settling_s() + 4.0)))

    def _change(self) -> None:
        draw, least_n = self.draw, self.rig.settings.defaults.in_band_tolerance_n
        changes = draw.choice(
            (
                {"force_ramp_n_per_s": draw.choice((5.0, 20.0, 100.0, 1000.0))},
                {"in_band_tolerance_n": least_n * draw.choice((1.0, 1.5, 3.0))},
                {"in_band_time_s": draw.choice((0.05, 0.3, 1.0))},
                {"precontact_force_n": draw.choice((1.0, 3.0, 6.0))},
                {"contact_ramp_s": draw.choice((0.1, 1.0))},
            )
        )
        before = self.rig.last
        self._write("changes", **changes)
        after, held = self.rig.last, StatusBit.IN_BAND | StatusBit.ENABLED
        is_rising = before.limited_by is LimitedBy.VOLTAGE_SLEW  # for what was asked for before
        if (
            before.status & after.status & held == held
            and not is_rising
            and abs(after.voltage_v - before.voltage_v) > BUMP_V
        ):
            self.judge.complain(f"{before.voltage_v:.3f} V become {after.voltage_v:.3f} V by {changes}")

    def _sine(self) -> None:
        """A master that writes a path."""
        rig, draw = self.rig, self.draw
        every_s, hertz = draw.choice((0.02, 0.05, 0.2)), draw.choice((0.2, 1.0, 3.0))
        most_n = rig.settings.limits.force_max_n
        mean_n, size_n = draw.uniform(0.2, 0.8) * most_n, draw.uniform(0.05, 0.2) * most_n
        self.note(f"sine of {size_n:.1f} N about {mean_n:.1f} N, {hertz} Hz, every {every_s} s")
        for k in range(round(1.5 / every_s)):
            self.judge.changed()
            rig.write(force_setpoint_n=round(mean_n + size_n * sin(2.0 * pi * hertz * k * every_s), 2))
            self._run(every_s)
            if rig.last.state in (State.OFF, State.FAULT):
                return

    def _volts(self) -> None:
        rig, draw = self.rig, self.draw
        gain = max(7.4, rig.machine.gain_n_per_v) * 1.2
        voltage_v = round(draw.uniform(0.0, 0.8) * rig.settings.limits.force_max_n / gain, 3)
        self.judge.is_spoilt = True
        if self._write("volts", mode=Mode.VOLTAGE, voltage_setpoint_v=voltage_v):
            self._run(draw.choice((0.3, 1.0, 3.0)))
            self._write("newtons", mode=Mode.FORCE, force_setpoint_n=self._force_n())

    def _switch_off(self) -> None:
        self._write("off", control_word=ControlBit(0), force_setpoint_n=0.0)
        if self.rig.last.status & StatusBit.ENABLED:
            self.judge.complain("on behind a disable")
        self._run(self.draw.choice((0.1, 0.1, 1.0)))

    # -- what befalls

    def _swap(self) -> None:
        """Another calibration, or the same."""
        rig, draw, judge = self.rig, self.draw, self.judge
        before_v, was_slewing = (
            rig.last.voltage_v,
            rig.command.mode is Mode.VOLTAGE or not rig.last.status & StatusBit.IN_BAND,
        )
        scale = rig.scale * draw.choice((1.0, 0.9, 1.1, 1.2))
        response = rig.response if draw.random() < 0.5 else draw_response(draw, rig.machine, rig.cell_ms)
        judge.changed()
        judge.is_spoilt = True
        rig.use(min(1.3, max(0.8, scale)), response)
        self.note(f"calibration {rig.scale:.2f}, {response}")
        after_v = rig.step().voltage_v
        if not was_slewing and abs(after_v - before_v) > 0.1:
            judge.complain(f"{before_v:.3f} V become {after_v:.3f} V by another calibration")

    def _befall(self) -> None:
        rig, draw, judge, machine = self.rig, self.draw, self.judge, self.rig.machine
        judge.changed()
        judge.is_spoilt = True
        name = draw.choice(
            (
                "air",
                "air",
                "air",
                "contact",
                "push",
                "gain",
                "false",
                "silent",
                "frozen",
                "late",
                "output",
                "tilt",
                "payload",
            )
        )
        self.note(name)
        judge.disturbed.add(name)
        for_s = draw.choice(SHORT_S)
        if name == "air":
            machine.air = False
            for_s = draw.choice((0.2, 2.0, 6.0))
        elif name == "contact":
            machine.gap_s, for_s = draw.choice((0.1, 0.5, 1.5)), 2.5
        elif name == "push":
            machine.push_n = draw.choice((-6.0, 3.0, 10.0, 40.0))
        elif name == "gain":
            machine.gain_n_per_v *= draw.choice((0.85, 1.15))
        elif name == "false":
            rig.false_n, for_s = draw.choice((-60.0, -9.0, 9.0, 60.0)), 1e-3 * rig.cell_ms
        elif name == "late":
            rig.cell_late_ms = draw.choice((10, 50, 100))
        elif name in ("silent", "frozen"):
            setattr(rig, f"cell_{name}", True)
        elif name == "output":
            rig.line = rig.line._replace(unanswered_since_s=rig.now_s)
            for_s = draw.choice((0.05, 0.3))
        elif name == "tilt":
            machine.tilt_rad = radians(draw.choice((0.0, 40.0, 90.0, 150.0)))
            self._write("tilt", tilt_angle_rad=machine.tilt_rad)
            for_s = 0.5
        elif name == "payload":
            machine.payload_kg = draw.choice((0.2, 0.6, 1.2))
            self._write("payload", payload_kg=machine.payload_kg)
            for_s = 0.5
        self._run(for_s)
        judge.changed()
        self._heal()
        self.note(f"{name} is over")
        if name == "air" and rig.last.status & StatusBit.ENABLED and rig.command.mode is Mode.FORCE and machine.touches:
            force_n = rig.command.force_setpoint_n
            standing_n = max(force_n, judge.standing_n(force_n, rig.settings.trim.limit_v))
            judge.bound(
                standing_n * (1.0 + OVERSHOOT_SHARE + self._lead_share()) + judge.noise_n + 0.5, "air that came back"
            )
        self._run(draw.choice((0.1, 1.0, 2.0, judge.settling_s() + 0.5)))
