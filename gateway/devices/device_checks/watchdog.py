"""A device's own watchdog, as its profile describes it: the second level, for when this machine itself is gone.

The first level is the guardian, which writes the safe voltage when the control process dies or stalls. When the guardian
dies with it, or the power does, only the device is left: it goes to its safe value when the host has been silent too long.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Final

from annotated_types import Gt, Le, MinLen

from gateway.defaults import STRICT
from gateway.devices.fields import Choice, HexNumber, TemplateError, ValueRefused, WholeNumber
from gateway.devices.template import compile_template, quote

TIME, STATE = "time", "state"
FEEDS_PER_TIME: Final = 4  # so that three may be lost
LONGEST_S: Final = 60.0


class WatchdogState(StrEnum):
    """State of a device's watchdog."""

    OFF = "off"
    ARMED = "armed"
    TRIPPED = "tripped"  # and latched: it obeys no setting until it is cleared


@dataclass(frozen=True, slots=True, kw_only=True)
class WatchdogExchange:
    """A sentence of the watchdog and its answer. {time:...} in either counts ticks."""

    __pydantic_config__ = STRICT
    ask: Annotated[str, MinLen(1)]  # template of the sentence
    answer: Annotated[str, MinLen(1)]  # template of the answer that says: done
    or_answer: str = ""  # the same in other firmware

    def __post_init__(self) -> None:
        for text in self.texts():
            compile_template(text)

    def texts(self) -> tuple[str, ...]:
        """Return the templates."""
        return tuple(filter(None, (self.ask, self.answer, self.or_answer)))


@dataclass(frozen=True, slots=True, kw_only=True)
class WatchdogQuestion:
    """The question for the watchdog's state; {state:...} in the answer is one of the words."""

    __pydantic_config__ = STRICT
    ask: Annotated[str, MinLen(1)]  # template of the question
    answer: Annotated[str, MinLen(1)]  # template of the answer, with {state:WORD|WORD}
    words: Mapping[str, WatchdogState]  # what each word means: off, armed, tripped

    def __post_init__(self) -> None:
        compile_template(self.ask)
        state = compile_template(self.answer).field(STATE)
        if not isinstance(state, Choice) or set(state.words) != set(self.words):
            raise TemplateError(f"{quote(self.answer)}: words must name each word of {{state:...}}, and no other")

    def word(self, state: WatchdogState) -> str | None:
        """Return the first word that means this, None where the device has none."""
        return next((word for word, meaning in self.words.items() if meaning is state), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Watchdog:
    """How a device's watchdog is armed, fed, read and cleared. The gateway arms it before the first voltage that is not the
    safe one, reads it back, and switches it off when it ends in order. Of a Modbus RTU device a sentence is its PDU in
    hexadecimal digits."""

    __pydantic_config__ = STRICT
    time_s: Annotated[float, Gt(0), Le(LONGEST_S)]  # silence of the host after which it trips; a rig may say another
    tick_s: Annotated[float, Gt(0)]  # one count of {time:...}, s; firmware may differ: a rig may say another
    set_time: WatchdogExchange | None = None  # {time:...} in ask, where it is set by a sentence of its own before arm
    arm: WatchdogExchange  # {time:...} in ask, where it arms by that
    disarm: WatchdogExchange  # what switches it off
    verify: WatchdogExchange | None = None  # reads {time:...} back
    status: WatchdogQuestion | None = None  # off, armed or tripped
    clear: WatchdogExchange | None = None  # lets a tripped one obey again
    feed: str = ""  # says that the host is alive, unanswered; empty: any sentence does
    refusal: str = ""  # its answer to a setting while it is tripped

    def __post_init__(self) -> None:
        if not isinstance(compile_template(self.timing.ask).field(TIME), WholeNumber | HexNumber):
            raise TemplateError(f"{quote(self.timing.ask)} has no whole number {{time:...}}, such as {{time:04X}}")
        if self.set_time and self.status is None:
            raise ValueError(
                "a watchdog whose time is set apart from its arming needs status: the time alone does not say that it watches"
            )
        if self.verify is None and self.status is None:
            raise ValueError("a watchdog needs verify or status: one that cannot be read back is none to rely on")
        if self.verify and compile_template(self.verify.answer).field(TIME) is None:
            raise TemplateError(f"{quote(self.verify.answer)} has no {{time:...}}")
        if self.feed:
            compile_template(self.feed)
        self.arming_text_fits()

    @property
    def timing(self) -> WatchdogExchange:
        """Return the exchange that carries the time."""
        return self.set_time or self.arm

    @property
    def ticks(self) -> int:
        """Counts that are sent: never a longer time than was asked for, at least one."""
        return max(1, int(self.time_s / self.tick_s + 1e-9))

    @property
    def feed_period_s(self) -> float:
        """Time between two signs of life, s."""
        return self.ticks * self.tick_s / FEEDS_PER_TIME

    def arming_text_fits(self) -> None:
        """Raise ValueError where the time is less than one count, or does not fit into the device's field."""
        field = compile_template(self.timing.ask).field(TIME)
        assert isinstance(field, WholeNumber | HexNumber)
        if self.ticks * self.tick_s > self.time_s * (1.0 + 1e-9):
            raise ValueError(
                f"{self.time_s:g} s is less than one count of the watchdog, {self.tick_s:g} s: it would trip later"
            )
        try:
            field.encode(self.ticks)
        except ValueRefused:
            most = (16 if isinstance(field, HexNumber) else 10) ** field.width - 1
            reason = f"{self.ticks} counts of {self.tick_s:g} s, and its sentence has room for {most}"
            raise ValueError(f"{self.time_s:g} s is {reason}: {most * self.tick_s:g} s at most") from None
