"""An output device as its wire knows it: it obeys, answers, loses its power, refuses, trips, and is set at its panel."""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf

from gateway.devices import DeviceProfile, output_device
from gateway.devices.device_checks.watchdog import WatchdogState
from gateway.devices.grammar import Grammar
from gateway.devices.messages import (
    Accepted,
    AskDevice,
    DeviceAnswer,
    Garbage,
    OutputRequest,
    Pressure,
    ReadPressure,
    ReadVoltage,
    Refused,
    SetVoltage,
)
from tests.service.running_rig.lines.drawn.wire import Clock

PA_PER_V = 0.5e5


@dataclass
class OutputPlayer:
    """stands_v: what is out; settings: what it was told and obeyed, and when; disturbed_s: when something besides the host has
    last moved it, or kept it from obeying; delay_s: of its next answer."""

    profile: DeviceProfile
    clock: Clock
    send: Callable[[bytes], None]
    delay_s: Callable[[], float]
    stands_v: float = 0.0
    disturbed_s: float = -inf
    dark_until_s: float = -inf
    refuses_until_s: float = -inf
    said: list[tuple[float, float]] = field(default_factory=list)
    off_since_s: float | None = None

    def __post_init__(self) -> None:
        self.codec = output_device(self.profile)
        self._free_s = -inf

    @property
    def is_dark(self) -> bool:
        return self.clock.now_s < self.dark_until_s

    @property
    def is_unwatched(self) -> bool:
        """Whether its watchdog, where it has one, does not watch."""
        watchdog = self.codec.watchdog
        return watchdog is not None and watchdog.state is WatchdogState.OFF

    def elapse(self) -> None:
        """Let its watchdog trip where it is due."""
        if self.codec.elapse(self.clock.now_s):
            self.stands_v, self.disturbed_s = 0.0, self.clock.now_s

    def lose_power(self, dark_s: float, start_v: float) -> None:
        """It goes dark, and comes back as one that has just been switched on."""
        self.codec = output_device(self.profile)
        self.dark_until_s = self.clock.now_s + dark_s
        self.move(0.0)
        self.clock.at(self.dark_until_s, self._start, start_v)

    def _start(self, start_v: float) -> None:
        if not self.is_dark:
            self.codec = output_device(self.profile)
            self.move(start_v)

    def move(self, voltage_v: float) -> None:
        """It stands elsewhere, without having been told on this line."""
        self.stands_v, self.disturbed_s = voltage_v, self.clock.now_s

    def trip(self) -> None:
        """Its watchdog trips, where it is armed."""
        if self.codec.watchdog and self.codec.watchdog.state is WatchdogState.ARMED:
            self.codec.watchdog.state = WatchdogState.TRIPPED
            self.move(0.0)

    def forget_arming(self) -> None:
        """Somebody switches its watchdog off."""
        own = self.profile.own_watchdog
        if self.codec.watchdog and own:
            self.codec.watchdog.state = WatchdogState.OFF
            if own.status is None:  # of which its time alone tells
                self.codec.watchdog.ticks = 0

    def become(self, profile: DeviceProfile) -> None:
        """Another device stands in its place."""
        self.profile, self.codec = profile, output_device(profile)
        self.move(0.0)

    def hear(self, chunk: bytes) -> None:
        """Obey at once and answer, in order, each after its time."""
        now_s = self.clock.now_s
        if self.is_dark:
            self.disturbed_s = now_s
            return
        self.elapse()
        for request in self.codec.receive(chunk, now_s):
            answer = self._answer(request)
            self._free_s = max(now_s + self.delay_s(), self._free_s)
            self.clock.at(self._free_s, self._say, answer, self.codec)

    def _say(self, answer: bytes, codec: object) -> None:
        if codec is self.codec:  # else it has lost its power meanwhile
            self.send(answer)

    def _answer(self, request: OutputRequest | Garbage) -> bytes:
        codec, now_s = self.codec, self.clock.now_s
        match request:
            case SetVoltage() if now_s < self.refuses_until_s:
                self.disturbed_s = now_s
                refusals = list(map(Grammar(self.profile).words, self.profile.refusals.texts()))
                words = "refused" if self.profile.is_modbus else next(iter(refusals), "")
                return codec.reply(Refused(words), to=request)
            case SetVoltage(voltage_v):
                self.stands_v = voltage_v
                self.said.append((now_s, voltage_v))
                return codec.reply(Accepted(voltage_v), to=request)
            case ReadVoltage():
                self.said.append((now_s, self.stands_v))
                return codec.reply(Accepted(self.stands_v), to=request)
            case ReadPressure():
                return codec.reply(Pressure(self.stands_v * PA_PER_V), to=request)
            case AskDevice(step):
                return codec.reply(DeviceAnswer(step, is_right=True), to=request)
            case Garbage():
                return codec.reply(codec.refusal(request))
        raise AssertionError(request)
