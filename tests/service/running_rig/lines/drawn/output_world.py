"""An output line in virtual time: its device, its wire, a host that wants voltages as control does, and what befalls them."""

from abc import ABC, abstractmethod
from dataclasses import replace
from math import inf, pi, sin
from random import Random

from gateway.devices import DeviceProfile, output_host
from gateway.devices.messages import SetVoltage
from gateway.service.running_rig.lines.output_line import OutputExchange
from tests.service.running_rig.lines.drawn.draws import (
    OUTPUTS,
    Fault,
    Line,
    draw_line,
    draw_spoil,
    draw_times,
    lines_of,
)
from tests.service.running_rig.lines.drawn.output_player import OutputPlayer
from tests.service.running_rig.lines.drawn.wire import Clock, Wire

SAFE_V = 0.0
KINDS = (
    *10 * ("spoil",),
    *4 * ("power",),
    "refuse",
    "trip",
    "forget",
    "panel",
    "slow",
    *2 * ("reopen",),
    "stranger",
    *3 * ("safe",),
    "question_lost",
)
WAYS = "rest", "rise", "fall", "descent", "sine", "steps", "press"


def draw_faults(rng: Random, line: Line) -> list[Fault]:
    """What befalls the line and its device, in its order."""
    profile, timeout_s = line.profile, line.profile.reply_timeout_s
    others = lines_of(profile, [0.0, 2.5, 5.0])
    faults = []
    for at_s in draw_times(rng):
        kind = rng.choice(KINDS)
        if kind == "spoil":
            faults.append(Fault(at_s, kind, spoil=draw_spoil(rng, profile, others, timeout_s)))
            continue
        length_s = rng.choice([0.01, 0.05, 0.2, 0.7, 3.0]) * rng.uniform(0.5, 1.0)
        start_v = rng.choice([0.0, 0.0, 3.0])
        faults.append(Fault(at_s, kind, (length_s, start_v, rng.uniform(0.9, 1.5) * timeout_s)))
    return faults


class OutputWorld(ABC):
    """broken: the laws that did not hold, in words; seed tells all of it. Who judges them is told of all that matters."""

    def __init__(self, seed: int, profile: DeviceProfile | None = None) -> None:
        rng = self.rng = Random(seed)
        profile = profile or rng.choice(OUTPUTS)
        host = output_host(profile)
        longest, longest_answer = 0, max(map(len, lines_of(profile, [9.0])))
        for question in (SetVoltage(9.999), *host.idle_questions):
            longest = max(longest, len(host.request(question)) + longest_answer)
        self.line = draw_line(rng, profile, longest)
        self.profile = self.line.profile
        self.faults = draw_faults(rng, self.line)
        self.way, self.last_way = rng.choice(WAYS), rng.choice(["rest", "sine", "press"])
        self.pressed_v = rng.uniform(1.0, 9.0)
        self.broken: list[str] = []
        self._build()

    def _build(self) -> None:
        self.clock = Clock()
        self.began_s = self.clock.now_s
        self.wire = Wire(self.clock, self.profile.serial.character_s, self.line.adapter_s)
        low_s, high_s = self.line.delay_s
        self.slow_until_s, self.slow_s = -inf, 0.0
        self.player = OutputPlayer(
            self.profile,
            self.clock,
            self.wire.answer,
            lambda: self.slow_s if self.clock.now_s < self.slow_until_s else self.rng.uniform(low_s, high_s),
        )
        self.host = output_host(self.profile)
        self.exchange = OutputExchange(self.host, self._write, self.profile.reply_timeout_s)
        self.exchange.drop_unsent = self.wire.to_device.drop_unsent
        self.ear = OutputPlayer(self.profile, self.clock, lambda data: None, lambda: 0.0)  # reads what the host writes
        self.wire.on_device, self.wire.on_host = self._reach_device, self._hear
        self.is_open, self.is_enabled, self.enable_s = True, False, 0.0
        self.safe_until_s = self.stranger_until_s = -inf
        self.is_strange = False
        self.lost_questions = 0
        self.wanted_v = SAFE_V
        self.fall_s: float | None = None
        self.unwatched_s: float | None = None
        self.written: list[tuple[float, object]] = []
        self.trace: list[str] = []
        self.is_traced = False
        self.output_timeout_s = max(0.1, self.profile.reply_timeout_s)
        self.last_standing_v: float | None = None
        self.told_v = SAFE_V
        self.standing_turn = 0
        self.ended_s = self.began_s + max(self._end_of(fault) for fault in self.faults)

    def _end_of(self, fault: Fault) -> float:
        lasts = fault.kind in ("power", "refuse", "slow", "stranger", "safe")
        return fault.at_s + (fault.numbers[0] if lasts else 0.0)

    # -- what goes over the wire

    def note(self, words: str) -> None:
        if self.is_traced:
            self.trace.append(f"{self.clock.now_s - self.began_s:8.4f} {words}")

    def complain(self, words: str) -> None:
        self.note(f"BROKEN {words}")
        self.broken.append(f"{self.clock.now_s - self.began_s:.4f} {words}")

    def _write(self, data: bytes) -> None:
        self.note(f"> {data!r}")
        for request in self.ear.codec.receive(data, self.clock.now_s):
            self.written.append((self.clock.now_s, request))
            if isinstance(request, SetVoltage):
                self.told_v = request.voltage_v
                self._judge_setting(request.voltage_v)
        if not self.is_open:
            return
        self.wire.to_device.put(data)

    def _reach_device(self, data: bytes) -> None:
        if self.lost_questions:
            self.lost_questions -= 1
            self.player.disturbed_s = self.clock.now_s
            self.wire.spoiled.append((self.clock.now_s, "lost"))
            return
        self.player.hear(data)

    def _hear(self, data: bytes) -> None:
        if not self.is_open:
            return
        self.note(f"< {data!r}")
        self.exchange.on_bytes(data, self.clock.now_s)
        self._judge_standing()

    # -- the host

    def _tick(self) -> None:
        now_s, exchange = self.clock.now_s, self.exchange
        self.clock.at(now_s + self.rng.uniform(0.95, 1.05) / self.line.tick_hz, self._tick)
        self.player.elapse()
        if not self.is_open:
            return
        wanted_v = self._decide(now_s)
        if wanted_v != self.wanted_v:
            self.note(f"wants {wanted_v:.3f}")
        if wanted_v == SAFE_V and self.wanted_v > SAFE_V and self.told_v > SAFE_V:
            self.fall_s = now_s
        elif wanted_v > SAFE_V:
            self.fall_s = None
        self.wanted_v = wanted_v
        exchange.set_voltage(wanted_v, now_s)
        exchange.tick(now_s)
        self._judge_standing()
        self._judge_tick(now_s)

    def _decide(self, now_s: float) -> float:
        """As control does: a fault or a silence ends it, and a person resets and enables anew."""
        exchange = self.exchange
        since_s = exchange.unanswered_since_s
        is_bad = bool(exchange.fault) or (since_s is not None and now_s - since_s > self.output_timeout_s)
        if is_bad and self.is_enabled:
            self.note(f"off: {exchange.fault!r} {exchange.said} silent since {since_s}")
            self.is_enabled, self.enable_s = False, now_s + 0.3
        elif not self.is_enabled and now_s >= self.enable_s:
            if exchange.fault:
                self.note(f"reset of {exchange.fault!r} {exchange.said}")
                exchange.clear_faults()
                self.enable_s = now_s + 0.3
            elif not is_bad and exchange.confirmed_v is not None:
                self.note("on")
                self.is_enabled = True
        if not self.is_enabled or now_s < self.safe_until_s:
            return SAFE_V
        return self._setpoint(now_s)

    def _setpoint(self, now_s: float) -> float:
        since_s = now_s - self.began_s
        way = self.way if now_s < self.ended_s + 0.5 else self.last_way
        step = int(since_s * 50.0)
        match way:
            case "rest":
                return SAFE_V
            case "press":
                return self.pressed_v
            case "rise":
                return min(9.5, 0.2 + 0.04 * step)
            case "fall":
                return max(0.2, 9.5 - 0.04 * step)
            case "descent":
                return max(0.2, 9.5 - 0.02 * step)
            case "sine":
                return 5.0 + 4.0 * sin(2.0 * pi * 0.7 * step / 50.0)
        return [2.0, 7.0, 0.0, 4.0][int(since_s / 0.37) % 4]

    # -- what befalls

    def _befall(self, fault: Fault) -> None:
        now_s, player = self.clock.now_s, self.player
        self.note(f"* {fault}")
        length_s, start_v, slow_s = fault.numbers or (0.0, 0.0, 0.0)
        match fault.kind:
            case "spoil":
                assert fault.spoil
                self.wire.spoil(fault.spoil)
            case "power":
                player.lose_power(length_s, start_v)
            case "refuse":
                player.refuses_until_s = now_s + length_s
            case "trip":
                player.trip()
            case "forget":
                player.forget_arming()
            case "panel":
                player.move(start_v)
            case "slow":
                self.slow_until_s, self.slow_s = now_s + length_s, slow_s
            case "reopen":
                self._close(min(length_s, 0.2))
            case "stranger":
                self._exchange_device(length_s)
            case "safe":
                self.safe_until_s = now_s + length_s
            case "question_lost":
                self.lost_questions = 1 + int(3 * start_v) % 3

    def _close(self, length_s: float) -> None:
        self.is_open = False
        self.wire.to_device.cut()
        self.wire.to_host.cut()
        self.exchange.reset()
        self.is_enabled, self.enable_s, self.fall_s, self.wanted_v = False, self.clock.now_s + length_s, None, SAFE_V
        self.player.disturbed_s = self.clock.now_s
        self.last_standing_v = None
        self.clock.at(self.clock.now_s + length_s, self._open)

    def _open(self) -> None:
        self.note("opened")
        self.exchange.reset()
        self.ear = OutputPlayer(self.profile, self.clock, lambda data: None, lambda: 0.0)
        self.is_open = True

    def _exchange_device(self, length_s: float) -> None:
        """Another model of the maker behind the plug, until somebody notices."""
        identity = self.profile.own_identity
        if identity is None:
            return
        self._close(0.05)
        self.is_strange = True
        self.player.become(replace(self.profile, identity=replace(identity, models=("9",))))
        self.clock.at(self.clock.now_s + length_s, self._put_back)

    def _put_back(self) -> None:
        self._close(0.05)
        self.is_strange = False
        self.player.become(self.profile)

    # -- who judges

    @abstractmethod
    def _judge_setting(self, voltage_v: float) -> None: ...

    @abstractmethod
    def _judge_standing(self) -> None: ...

    @abstractmethod
    def _judge_tick(self, now_s: float) -> None: ...
