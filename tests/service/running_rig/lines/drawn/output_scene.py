"""One output line under drawn faults: the laws that it must keep whatever befalls it.

The witness knows the device and what was asked; of the product it reads what control reads.
"""

from gateway.codes.faults import FaultCode
from gateway.devices.messages import ReadVoltage, SetVoltage
from tests.service.running_rig.lines.drawn.output_world import SAFE_V, OutputWorld

UNWATCHED_S = 2.0
"""In which a device's watchdog that is not armed is looked at, and armed; a spoiled answer costs another look."""
SETTLING_S, PEACE_S = 3.0, 1.0
"""Behind the last fault, until all is as it was; and in which that is looked at."""


class OutputScene(OutputWorld):
    """Judges what happens in it."""

    def _judge_setting(self, voltage_v: float) -> None:
        if voltage_v > self.wanted_v + self.host.resolution_v:
            self.complain(f"{voltage_v:.3f} V goes out, {self.wanted_v:.3f} V is wanted")
        if self.is_strange and voltage_v > SAFE_V + self.host.resolution_v:
            self.complain(f"a wrong device is told {voltage_v:.3f} V")

    def _judge_tick(self, now_s: float) -> None:
        self._judge_fall(now_s)
        self._judge_watch(now_s)

    def _judge_fall(self, now_s: float) -> None:
        """The safe voltage goes out within one reply time, and a device that can obey obeys."""
        if self.fall_s is None:
            return
        bound_s = self.profile.reply_timeout_s + 1.1 / self.line.tick_hz + self.host.gap_s + 0.006
        if now_s - self.fall_s < bound_s:
            return
        has_gone = any(
            isinstance(said, SetVoltage) and said.voltage_v <= SAFE_V + 1e-9 and at_s >= self.fall_s
            for at_s, said in self.written[-12:]
        )
        if not has_gone and not self.exchange._is_confirmed(SAFE_V):
            self.complain(f"no safe voltage has gone out for {now_s - self.fall_s:.3f} s")
            self.fall_s = None
            return
        reach_s = 40 * self.profile.serial.character_s
        if now_s - self.fall_s < bound_s + reach_s:
            return
        player = self.player
        if player.disturbed_s < self.fall_s - 0.2 and player.stands_v > SAFE_V + 1e-6 and not player.is_dark:
            self.complain(f"the device stands at {player.stands_v:.3f} V {now_s - self.fall_s:.3f} s behind a fall")
        self.fall_s = None

    def _judge_watch(self, now_s: float) -> None:
        player = self.player
        presses = self.wanted_v > SAFE_V and player.stands_v > SAFE_V and not player.is_dark
        if not (player.is_unwatched and presses):
            self.unwatched_s = None
            return
        if self.unwatched_s is None:
            self.unwatched_s = now_s
        spoiled = sum(at_s >= self.unwatched_s - 1.0 for at_s, _ in self.wire.spoiled)
        if now_s - self.unwatched_s > UNWATCHED_S + (1 + spoiled) * self.profile.reply_timeout_s:
            self.complain(f"it presses {player.stands_v:.2f} V unwatched for {now_s - self.unwatched_s:.2f} s")
            self.unwatched_s = now_s

    def _judge_standing(self) -> None:
        """What is said to stand stands, a moment later at the latest."""
        standing_v = self.exchange.standing_v
        if standing_v == self.last_standing_v:
            return
        self.last_standing_v = standing_v
        self.standing_turn += 1
        if standing_v is None:
            return
        now_s = self.clock.now_s
        self.note(f"stands {standing_v:.3f}")
        self.clock.at(
            now_s + 30 * self.profile.serial.character_s + 0.002,
            self._judge_truth,
            standing_v,
            now_s,
            self.standing_turn,
        )

    def _judge_truth(self, standing_v: float, told_s: float, turn: int) -> None:
        now_s, player = self.clock.now_s, self.player
        if not self.is_open or self.standing_turn != turn:
            return
        window_s = 5.0 * self.profile.reply_timeout_s
        is_forged = any(now_s - at_s < window_s and kind in self.forging for at_s, kind in self.wire.spoiled)
        if is_forged or player.disturbed_s > told_s - window_s:
            return
        tolerance_v = 1.3 * self.host._tolerance_v[SetVoltage] + self.host.resolution_v
        if abs(player.stands_v - standing_v) > tolerance_v:
            self.complain(f"said to stand at {standing_v:.3f} V, it stands at {player.stands_v:.3f} V")

    @property
    def forging(self) -> set[str]:
        """Kinds that may make another true answer of one, in a grammar without a checksum."""
        of_any = {"replaced", "followed"}
        if self.profile.is_modbus or self.profile.checksum != "none":
            return of_any
        return of_any | {"cut_front", "cut_end", "torn", "altered", "digit"}

    # -- the scene

    def run(self) -> "OutputScene":
        """Play it to its end."""
        for fault in self.faults:
            self.clock.at(self.began_s + fault.at_s, self._befall, fault)
        self._tick()
        self.clock.run(self.ended_s + 0.05)
        self.wire.heal()
        self.lost_questions = 0
        self.clock.run(self.ended_s + SETTLING_S)
        self._judge_settled("behind the settling time")
        asked = self.exchange.counts.asked
        settings = len([1 for _, one in self.written if isinstance(one, SetVoltage)])
        garbled = self.exchange.counts.garbled
        self.clock.run(self.ended_s + SETTLING_S + PEACE_S)
        self._judge_settled("a second later")
        if self.exchange.counts.garbled > garbled:
            self.complain("garbage on a wire that is well")
        self._judge_pace(self.exchange.counts.asked - asked, settings)
        return self

    def _judge_settled(self, when: str) -> None:
        exchange, player, now_s = self.exchange, self.player, self.clock.now_s
        if exchange.fault is not FaultCode.NONE:
            self.complain(f"{when}: {exchange.fault!r} {exchange.said}")
        if not exchange.checks.is_done:
            self.complain(f"{when}: its checks are not through: {exchange.checks._waiting}")
        if exchange.checks.has_watchdog and not (exchange.checks.is_armed and not player.is_unwatched):
            self.complain(f"{when}: its watchdog does not watch")
        since_s = exchange.unanswered_since_s
        if since_s is not None and now_s - since_s > 1.1 * self.profile.reply_timeout_s + 1.0 / self.line.tick_hz:
            self.complain(f"{when}: silent for {now_s - since_s:.3f} s")
        if not self.is_enabled:
            self.complain(f"{when}: not enabled")
        is_blind = self.last_way == "press" and ReadVoltage() not in self.host.idle_questions
        if self.last_way == "sine" or (is_blind and any(one.kind in ("power", "panel") for one in self.faults)):
            return
        if abs(player.stands_v - self.wanted_v) > self.host.resolution_v:
            self.complain(f"{when}: it stands at {player.stands_v:.3f} V, {self.wanted_v:.3f} V is wanted")
        if exchange.standing_v is None and since_s is None:
            self.complain(f"{when}: nobody knows what stands")

    def _judge_pace(self, asked: int, settings: int) -> None:
        if self.last_way == "sine":
            return
        sets = len([1 for _, one in self.written if isinstance(one, SetVoltage)]) - settings
        least = min(6, 0.8 / (1.2 * self.profile.reply_timeout_s))
        if not least <= asked <= 13 or sets > (3 if self.host.idle_questions else 13):
            self.complain(f"at rest {asked} questions in a second, {sets} of them settings")
