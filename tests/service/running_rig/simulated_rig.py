"""Bank, gateway and controller around a small plant, in virtual time and without wires: a thousand times faster than real.

Masters write through the bank's own faces (FC05, FC06, FC16, FC22, floats), so that an answer is what a master would get.
Two rigs with the same past live the same next seconds: what a refused write changes all the same shows.
"""

from dataclasses import replace
from math import nan
from random import Random
from struct import pack
from types import SimpleNamespace

from gateway.codes.faults import FaultCode
from gateway.control import CalibrationInUse, Controller, ControlSettings
from gateway.control.inputs import ValveStatus, WireCounts
from gateway.devices.messages import ForceSample, Quality
from gateway.devices.valve_profile import ValveDirection
from gateway.modbus import Peer
from gateway.profiles import load_register_map
from gateway.registers import BankRules, Refusal, RegisterBank
from gateway.registers.rig_rules import BASIC_BITS
from gateway.registers.words import ControlBit, State
from gateway.service.running_rig.control_loop import ControlLoop, LoopProcess
from gateway.service.running_rig.lines.output_line import LineState
from tests.control.bench import SmallPlant, bsfm, settings
from tests.control.valve.valve_bench import MOVES_S, SHARE

OWNER, OTHER = Peer("10.0.0.5", 4001), Peer("10.0.0.6", 4002)
TICK_S = 0.01
LOOK_TICKS = 10
"""Between two looks at the register of the state: to read it at each tick has the whole status packed each time."""
MAP = load_register_map("force-v1")
ENABLE, RESET, TARE, TAKE, VALVE, CALIBRATE, SELF_TEST = (int(bit) for bit in ControlBit)


class Wire:
    """Stands for the output line: every voltage is acknowledged at once."""

    def __init__(self) -> None:
        self.voltage_v = self.acknowledged_v = 0.0
        self.unanswered_since_s: float | None = None
        self.fault = FaultCode.NONE
        self.said = ""
        self.pressure_pa = self.round_trip_s = nan
        self.answer_late_s = 0.0
        self.counts = WireCounts()

    @property
    def confirmed_v(self) -> float:
        return self.acknowledged_v

    standing_v = confirmed_v

    def clear_faults(self) -> None:
        """There are none that only a reset clears."""

    @property
    def sent_v(self) -> float:
        return self.voltage_v

    @property
    def line(self) -> LineState:
        return LineState(nan, self.voltage_v, nan)

    def set_voltage(self, voltage_v: float, now_s: float) -> None:
        self.voltage_v = self.acknowledged_v = voltage_v

    def tick(self, now_s: float) -> None: ...


class Samples:
    """Stands for the load cell's line: what is put here comes out at the next bytes."""

    identity = SimpleNamespace(fault=FaultCode.NONE, said="")
    unread = SimpleNamespace(explain=lambda line: "")
    is_stream = True

    def __init__(self) -> None:
        self.next: ForceSample | None = None
        self.counts = WireCounts()

    def receive(self, chunk: bytes, now_s: float) -> list[ForceSample | None]:
        return [self.next]

    def says(self, now_s: float) -> str:
        return ""

    def tick(self, now_s: float) -> None:
        """A stream is not asked."""

    def clear_faults(self) -> None:
        """Nobody doubts what is behind the port."""


class Relay:
    """Stands for the valve's line: the valve stands a twentieth of a second later where it is told to, and the plant turns."""

    lost, said = False, ""

    def __init__(self, plant: SmallPlant) -> None:
        self.stands, self._plant, self._push_n_per_v = ValveDirection.PUSH, plant, plant.gain_n_per_v
        self._order: ValveDirection | None = None
        self._told_s = 0.0

    @property
    def status(self) -> ValveStatus:
        return ValveStatus(self.stands)

    def set_direction(self, order: ValveDirection | None, now_s: float) -> None:
        if order is not self._order:
            self._order, self._told_s = order, now_s

    def tick(self, now_s: float) -> None:
        if self._order not in (None, self.stands) and now_s - self._told_s >= MOVES_S:
            self.stands = self._order
            is_pull = self.stands is ValveDirection.PULL
            self._plant.sign = -1.0 if is_pull else 1.0
            self._plant.gain_n_per_v = self._push_n_per_v * (SHARE if is_pull else 1.0)


class SmallRig:
    """Times are virtual seconds. beats: the owner's heartbeat changes every tenth of a second, where there is a lease.
    is_restarted: the process before has ended without a word; needs_proof: of its byte order, of each master; began_s: when
    this process is begun."""

    def __init__(
        self,
        control: ControlSettings | None = None,
        *,
        seed: int = 1,
        is_restarted: bool = False,
        needs_proof: bool = False,
        began_s: float = 0.0,
        **plant: float,
    ) -> None:
        self.settings = control or settings()
        self.ticks, self.needs_proof = round(began_s / TICK_S), needs_proof
        self.is_cell_silent = False
        self.suspended_s = 0.0
        self.beats = self.settings.supervision.lease_s is not None
        self.beat = 0
        self.log: list[str] = []
        self.trace: list[tuple[State, float, float]] = []
        self.plant = SmallPlant(Random(seed), **plant)  # type: ignore[arg-type]
        self.start(is_restarted=is_restarted)
        self.run(0.5)

    def start(self, *, is_restarted: bool = False) -> None:
        """A fresh control process beside the same machine."""
        self.wire, self.samples = self.new_wire(), Samples()
        rules = BankRules(
            rig_name="rig",
            force_max_n=self.settings.limits.force_max_n,
            has_lease=self.settings.supervision.lease_s is not None,
            require_byte_order_echo=self.needs_proof,
            supported_bits=BASIC_BITS
            | ControlBit.START_CALIBRATION
            | (ControlBit.START_SELF_TEST if self.settings.self_test else ControlBit(0))
            | (ControlBit.VALVE_PULL if self.settings.valve else ControlBit(0)),
        )
        self.bank = RegisterBank(MAP, rules, now=self.now)
        self.controller = Controller(self.settings, CalibrationInUse(bsfm(), 1), unclean_restart=is_restarted)
        process = LoopProcess(self.now, self.note, suspended_s=lambda: self.suspended_s)
        self.loop = ControlLoop(self.bank, self.controller, self.wire, self.samples, process)  # type: ignore[arg-type]
        if self.settings.valve:
            self.loop.valve = Relay(self.plant)  # type: ignore[assignment]

    def new_wire(self) -> Wire:
        return Wire()

    def now(self) -> float:
        return self.ticks * TICK_S

    def note(self, cause: str, sentence: str) -> None:
        self.log.append(sentence)

    # -- time

    def run(self, seconds: float) -> "SmallRig":
        for _ in range(round(seconds / TICK_S)):
            self._tick()
        return self

    def until(self, state: State, within_s: float = 5.0) -> "SmallRig":
        for _ in range(round(within_s / TICK_S)):
            if self.loop.decision.state is state:
                assert self.state is state, "the registers show another one"
                return self
            self._tick()
        raise AssertionError(f"{self.state.name}, not {state.name}, within {within_s} s: {self.log[-3:]}")

    def _tick(self) -> None:
        self.ticks += 1
        self.plant.advance(self.wire.voltage_v, 10)
        if not self.is_cell_silent:
            force_n = self.plant.reading_n()
            self.samples.next = ForceSample(force_n, force_n, Quality.OK, self.now())
            self.loop.on_cell_bytes(b"", self.now())
        if self.beats and self.ticks % 10 == 0 and self.bank.owner == OWNER.host:
            self.beat += 1
            self.write(4, self.beat)
        self.loop.on_tick(1, 0.0)
        decided = self.loop.decision.state
        if self.ticks % LOOK_TICKS == 0:
            assert self.state is decided, "the registers show another state"
        self.trace.append((decided, self.wire.voltage_v, self.plant.force_n))

    # -- masters

    def write(self, address: int, *words: int, peer: Peer = OWNER) -> None:
        """FC06 or FC16; a Refusal comes through."""
        self.bank.write_registers(address, pack(f">{len(words)}H", *(word & 0xFFFF for word in words)), peer)

    def answer(self, address: int, *words: int, peer: Peer = OWNER) -> Refusal | None:
        try:
            self.write(address, *words, peer=peer)
        except Refusal as refusal:
            return refusal
        return None

    def block(self, word: int, force_n: float | None = None, *, beat: int | None = None) -> tuple[int, ...]:
        """The whole command block as it stands, with this control word, for a cyclic master."""
        words = list(self.words(0, 13))
        words[0] = word
        words[1] = words[1] if force_n is None else round(100 * force_n)
        words[4] = words[4] if beat is None else beat
        return tuple(words)

    def words(self, address: int, count: int) -> tuple[int, ...]:
        data = self.bank.read_registers(address, count)
        return tuple(data[2 * k] << 8 | data[2 * k + 1] for k in range(count))

    def word(self, name: str) -> int:
        return self.words(MAP.find(name).address, 1)[0]

    @property
    def state(self) -> State:
        return State(self.word("state"))

    # -- where it may stand

    def holding(self, force_n: float = 12.0) -> "SmallRig":
        self.write(0, ENABLE, round(100 * force_n))
        return self.until(State.HOLDING)

    def faulted(self) -> "SmallRig":
        self.holding().is_cell_silent = True
        self.until(State.FAULT)
        self.is_cell_silent = False
        return self.run(1.5)

    def calibrating(self, word: int = CALIBRATE) -> "SmallRig":
        self.write(0, word)
        return self.until(State.CALIBRATING).run(2.5)


def with_limits(control: ControlSettings, **limits: float) -> ControlSettings:
    return replace(control, limits=replace(control.limits, **limits))  # type: ignore[arg-type]
