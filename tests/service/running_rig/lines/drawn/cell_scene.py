"""One load cell's line under drawn faults: a reading is one that the cell has sent, and of no later moment than it came."""

from math import inf
from random import Random

from gateway.devices import DeviceProfile, cell_device, cell_host
from gateway.devices.messages import ForceSample
from gateway.service.running_rig.lines.load_cell_line import CellExchange
from tests.service.running_rig.lines.drawn.draws import CELLS, LEAD_S, Line, draw_line, draw_spoil, draw_times
from tests.service.running_rig.lines.drawn.wire import Clock, Wire

SETTLING_S, PEACE_S, STALL_S = 1.6, 1.0, 0.2
LONGEST_BYTES = 40
WHOLE = "hbm-aed", "laumas-tlb", "stream-st-gs"
"""Those whose readings have a checksum or a fixed width: none of them is taken for whole that is not."""
TEARING = {"cut_front", "cut_end", "torn"}
FORGING = {"altered", "digit", "replaced", "followed"}


def unit_of(profile: DeviceProfile) -> str | None:
    """What a rig says of a cell that does not say its unit."""
    reading = profile.reading
    return None if reading.newton_per_unit or reading.template.field("unit") else "N"


class CellScene:
    """broken: the laws that did not hold, in words; seed tells all of it."""

    def __init__(self, seed: int, profile: DeviceProfile | None = None) -> None:
        rng = self.rng = Random(seed)
        self.line: Line = draw_line(rng, profile or rng.choice(CELLS), LONGEST_BYTES)
        self.profile = self.line.profile
        self.clock, self.broken = Clock(), list[str]()
        self.began_s = self.clock.now_s
        self.wire = Wire(self.clock, self.profile.serial.character_s, self.line.adapter_s)
        self.host = cell_host(self.profile, unit=unit_of(self.profile))
        self.device = cell_device(self.profile, unit_of(self.profile))
        self.exchange = CellExchange(self.host, self._write, self.profile, STALL_S)
        self.wire.on_device, self.wire.on_host = self._reach_device, self._hear
        self.is_open, self.dark_until_s, self.stalled_until_s, self.slow_until_s = True, -inf, -inf, -inf
        self.stalled_since_s = inf
        self.waiting: list[tuple[float, bytes]] = []
        self.sent: list[tuple[float, float]] = []  # when, N
        self.samples: list[tuple[float, ForceSample]] = []
        wire_s = LONGEST_BYTES * self.profile.serial.character_s
        self.period_s = max(1.0 / self.profile.rate_hz, wire_s) if self.profile.rate_hz else 0.0
        self._next_free_s = -inf
        self.times = draw_times(rng)
        self.ended_s = self.began_s + max(self.times)

    def _write(self, data: bytes) -> None:
        if self.is_open:
            self.wire.to_device.put(data)

    def _reach_device(self, data: bytes) -> None:
        now_s = self.clock.now_s
        if now_s < self.dark_until_s:
            return
        count = self.device.receive(data, now_s)
        if answers := self.device.take_answers():
            self._answer(answers)
        for _ in range(count):
            self._answer(self._frame())

    def _frame(self) -> bytes:
        force_n = self.rng.choice([-1.0, 1.0]) * self.rng.uniform(1.0, 90.0)
        self.sent.append((self.clock.now_s, force_n))
        return self.device.frame(force_n)

    def _answer(self, data: bytes) -> None:
        low_s, high_s = self.line.delay_s
        timeout_s = self.profile.reply_timeout_s
        is_slow = self.clock.now_s < self.slow_until_s
        late_s = self.rng.uniform(0.9, 1.5) * timeout_s if is_slow else self.rng.uniform(low_s, high_s)
        self._next_free_s = max(self.clock.now_s + late_s, self._next_free_s)
        self.clock.at(self._next_free_s, self.wire.answer, data)

    def _stream(self) -> None:
        if self.clock.now_s >= self.dark_until_s:
            self.wire.answer(self._frame())
        self.clock.at(self.clock.now_s + self.period_s, self._stream)

    def _hear(self, data: bytes) -> None:
        if self.is_open:
            self.waiting.append((self.clock.now_s, data))
            self._read()

    def _read(self) -> None:
        now_s = self.clock.now_s
        if now_s < self.stalled_until_s or not self.waiting:
            return
        came_s = self.waiting[-1][0]
        chunk = b"".join(data for _, data in self.waiting)
        self.waiting.clear()
        for message in self.exchange.receive(chunk, now_s):
            if isinstance(message, ForceSample):
                self.samples.append((now_s, message))
                self._judge(message, came_s)

    def _tick(self) -> None:
        now_s = self.clock.now_s
        self.clock.at(now_s + self.rng.uniform(0.95, 1.05) / self.line.tick_hz, self._tick)
        if now_s >= self.stalled_until_s:
            self._read()
            if self.is_open:
                self.exchange.tick(now_s)
                if now_s > self.ended_s:  # somebody resets
                    self.exchange.clear_faults()

    def _befall(self) -> None:
        rng, now_s = self.rng, self.clock.now_s
        length_s = rng.choice([0.01, 0.1, 0.5, 2.0]) * rng.uniform(0.5, 1.0)
        match rng.choice([*6 * ["spoil"], "power", "stall", "slow", "reopen"]):
            case "spoil":
                others = [self.device.frame(rng.uniform(-90.0, 90.0)) for _ in range(3)]
                self.wire.spoil(draw_spoil(rng, self.profile, others, self.profile.reply_timeout_s))
                return
            case "power":
                self.dark_until_s = now_s + length_s
            case "stall":
                self.stalled_since_s = min(now_s, self.stalled_since_s) if now_s < self.stalled_until_s else now_s
                self.stalled_until_s = now_s + length_s
            case "slow":
                self.slow_until_s = now_s + length_s
            case "reopen":
                self.wire.to_device.cut()
                self.wire.to_host.cut()
                self.waiting.clear()
                self.is_open = False
                self.clock.at(now_s + 0.05, self._open)
        self.ended_s = max(self.ended_s, now_s + length_s)

    def _open(self) -> None:
        if self.clock.now_s < self.stalled_until_s:  # the process that would open it stands still
            self.clock.at(self.stalled_until_s, self._open)
            return
        self.exchange.reset()
        self.is_open = True

    def complain(self, words: str) -> None:
        """Note a law that did not hold."""
        self.broken.append(f"{self.clock.now_s - self.began_s:.4f} {words}")

    def _judge(self, sample: ForceSample, came_s: float) -> None:
        now_s = self.clock.now_s
        if sample.time_s > came_s + 1e-6 and came_s < now_s - STALL_S - 0.06:
            self.complain(f"a reading that came {now_s - came_s:.3f} s ago is {now_s - sample.time_s:.3f} s old")
        if sample.time_s < now_s - 1e-6 and now_s > self.stalled_until_s + 0.15 and now_s - sample.time_s > STALL_S:
            self.complain(f"a reading of now is {now_s - sample.time_s:.3f} s old")
        kinds = {kind for at_s, kind in self.wire.spoiled if now_s - at_s < 3.0}
        if kinds & FORGING or (kinds & TEARING and self.profile.name not in WHOLE):
            return
        tolerance_n = 0.51 * self.host.resolution_n + 1e-6
        sent = [at_s for at_s, force_n in self.sent[-400:] if abs(force_n - sample.force_n) <= tolerance_n]
        if not sent and not kinds & TEARING and self._is_first():
            return
        if not sent:
            self.complain(f"a reading of {sample.force_n:.3f} N was never sent")
        elif sample.time_s < min(min(sent) - STALL_S, self.stalled_since_s - 0.06):
            self.complain(
                "a reading is older than the cell's word, and than the standstill that it may have waited for"
            )

    def _is_first(self) -> bool:
        """Of an open number the first sentence behind an opening may be the rest of one."""
        return self.profile.name not in WHOLE

    def run(self) -> "CellScene":
        """Play it to its end."""
        for at_s in self.times:
            self.clock.at(self.began_s + at_s, self._befall)
        if self.period_s:
            self._stream()
        self._tick()
        self.clock.run(self.began_s + LEAD_S)
        before = len(self.samples)
        self.clock.run(self.began_s + max(self.times) + 1e-6)
        self.clock.run(self.ended_s + 0.05)
        self.wire.heal()
        self.clock.run(self.ended_s + SETTLING_S)
        count, asked = len(self.samples), self.exchange.counts.asked
        self.clock.run(self.ended_s + SETTLING_S + PEACE_S)
        rate_hz = before / LEAD_S
        if len(self.samples) - count < 0.5 * rate_hz * PEACE_S - 2:
            self.complain(f"{len(self.samples) - count} readings in a second, {rate_hz:.0f} before")
        if (
            self.exchange.counts.asked - asked > 1.3 * (len(self.samples) - count) + 3
            and self.profile.name != "adam-4016"
        ):
            self.complain(f"{self.exchange.counts.asked - asked} questions for {len(self.samples) - count} readings")
        return self
