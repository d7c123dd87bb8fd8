"""One valve's line under drawn faults: it is never believed to stand where it has not been read back."""

from math import inf
from random import Random

from gateway.devices import DeviceProfile, ValveDevice, ValveDirection, ValveHost
from gateway.devices.messages import Garbage
from gateway.service.running_rig.lines.valve_line import ValveExchange
from tests.service.running_rig.lines.drawn.draws import VALVES, draw_line, draw_spoil, draw_times
from tests.service.running_rig.lines.drawn.wire import Clock, Wire

SETTLING_S, PEACE_S = 0.8, 1.0
LONGEST_BYTES = 24
FORGING = {"altered", "digit", "replaced", "followed", "cut_front", "cut_end", "torn"}


class ValveScene:
    """broken: the laws that did not hold, in words; seed tells all of it."""

    def __init__(self, seed: int, profile: DeviceProfile | None = None) -> None:
        rng = self.rng = Random(seed)
        self.line = draw_line(rng, profile or rng.choice(VALVES), LONGEST_BYTES)
        self.profile = self.line.profile
        self.clock, self.broken = Clock(), list[str]()
        self.began_s = self.clock.now_s
        self.wire = Wire(self.clock, self.profile.serial.character_s, self.line.adapter_s)
        self.device = ValveDevice(self.profile)
        self.exchange = ValveExchange(ValveHost(self.profile), self.wire.to_device.put, self.profile.reply_timeout_s)
        self.wire.on_device, self.wire.on_host = self._reach_device, self._hear
        self.dark_until_s = self.stuck_until_s = self.slow_until_s = self._free_s = -inf
        self.stands = rng.choice(list(ValveDirection))
        self.stood: list[tuple[float, ValveDirection]] = [(self.began_s, self.stands)]
        self.order: ValveDirection | None = None
        self.shown: ValveDirection | None = None
        self.times = draw_times(rng)
        self.ended_s = self.began_s + max(self.times)

    def complain(self, words: str) -> None:
        """Note a law that did not hold."""
        self.broken.append(f"{self.clock.now_s - self.began_s:.4f} {words}")

    def _move(self, direction: ValveDirection) -> None:
        if direction is not self.stands:
            self.stands = direction
            self.stood.append((self.clock.now_s, direction))

    def _reach_device(self, data: bytes) -> None:
        now_s = self.clock.now_s
        if now_s < self.dark_until_s:
            return
        for question in self.device.receive(data):
            if isinstance(question, Garbage):
                continue
            if question is not None and now_s >= self.stuck_until_s:
                self._move(question)
            low_s, high_s = self.line.delay_s
            timeout_s = self.profile.reply_timeout_s
            is_slow = now_s < self.slow_until_s
            late_s = self.rng.uniform(0.9, 1.5) * timeout_s if is_slow else self.rng.uniform(low_s, high_s)
            self._free_s = max(now_s + late_s, self._free_s)
            self.clock.at(self._free_s, self.wire.answer, self.device.reply(question, self.stands))

    def _hear(self, data: bytes) -> None:
        self.exchange.on_bytes(data, self.clock.now_s)
        self._judge()

    def _tick(self) -> None:
        now_s = self.clock.now_s
        self.clock.at(now_s + self.rng.uniform(0.95, 1.05) / self.line.tick_hz, self._tick)
        self.exchange.set_direction(self.order, now_s)
        self.exchange.tick(now_s)
        self._judge()

    def _judge(self) -> None:
        """Where it is believed to stand it stood when it said so: a wire and an answer's time ago at most."""
        shown = self.exchange.status.stands
        if shown is None or shown is self.shown:
            self.shown = shown
            return
        self.shown, now_s = shown, self.clock.now_s
        since_s = now_s - self.profile.reply_timeout_s - 0.05
        kinds = {kind for at_s, kind in self.wire.spoiled if now_s - at_s < 2.0}
        if kinds & FORGING:
            return
        recent = [direction for at_s, direction in self.stood if at_s >= since_s]
        before = [direction for at_s, direction in self.stood if at_s < since_s][-1:]
        if shown not in (*recent, *before):
            self.complain(f"{shown} is believed, {self.stands} stands")

    def _befall(self) -> None:
        rng, now_s = self.rng, self.clock.now_s
        length_s = rng.choice([0.02, 0.1, 0.5, 1.5]) * rng.uniform(0.5, 1.0)
        match rng.choice([*5 * ["spoil"], "power", "stuck", "slow", *4 * ["order"], "reopen"]):
            case "spoil":
                others = [self.device.reply(None, one) for one in ValveDirection] + [
                    self.device.reply(ValveDirection.PUSH, self.stands)
                ]
                self.wire.spoil(draw_spoil(rng, self.profile, others, self.profile.reply_timeout_s))
                return
            case "power":
                self.dark_until_s = now_s + length_s
                self._move(ValveDirection.PUSH)
            case "stuck":
                self.stuck_until_s = now_s + length_s
            case "slow":
                self.slow_until_s = now_s + length_s
            case "order":
                self.order = rng.choice([*ValveDirection, None])
                return
            case "reopen":
                self.wire.to_device.cut()
                self.wire.to_host.cut()
                self.exchange.reset()
        self.ended_s = max(self.ended_s, now_s + length_s)

    def run(self) -> "ValveScene":
        """Play it to its end."""
        for at_s in self.times:
            self.clock.at(self.began_s + at_s, self._befall)
        self._tick()
        self.clock.run(self.began_s + max(self.times) + 1e-6)
        self.clock.run(self.ended_s + 0.05)
        self.wire.heal()
        self.clock.run(self.ended_s + SETTLING_S + 6.0 * self.profile.reply_timeout_s)
        asked, now_s = self.exchange.counts.asked, self.clock.now_s
        if self.order is not None and self.stands is not self.order:
            self.complain(f"it stands at {self.stands}, {self.order} is ordered")
        self.clock.run(now_s + PEACE_S)
        if self.exchange.status.stands is not self.stands:
            self.complain(f"{self.exchange.status.stands} is shown, {self.stands} stands")
        least = min(5, 0.8 / (1.1 * self.profile.reply_timeout_s))
        if not least <= self.exchange.counts.asked - asked <= 12:
            self.complain(f"{self.exchange.counts.asked - asked} questions in a second")
        return self
