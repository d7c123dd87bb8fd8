"""What a device profile says of a directional valve behind a switched output: a relay, or a digital output.

Two directions and nothing between. The direction that stands is read back by a question of its own. Of a Modbus RTU device a
sentence is its PDU in hexadecimal digits (`05 0000 FF00`, without the blanks), of one that speaks in raw bytes these bytes:
two settings and one question need no other words.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Final

from annotated_types import MinLen

from gateway.defaults import STRICT
from gateway.devices.fields import Choice, TemplateError
from gateway.devices.template import compile_template, quote

STATE: Final = "state"


class ValveDirection(StrEnum):
    """Chamber that has the regulator's pressure: the tool is pushed out, or pulled in."""

    PUSH = "push"
    PULL = "pull"


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveSetting:
    """One direction: what is said, and what the device answers when it has obeyed. One that says nothing is asked how it
    stands in the same breath."""

    __pydantic_config__ = STRICT
    ask: Annotated[str, MinLen(1)]  # the sentence that switches; of a Modbus device its PDU in hexadecimal digits
    answer: str = ""  # what the device answers; empty: nothing

    def __post_init__(self) -> None:
        for text in filter(None, (self.ask, self.answer)):
            compile_template(text)


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveSettings:
    """Both directions."""

    __pydantic_config__ = STRICT
    push: ValveSetting
    pull: ValveSetting

    def __post_init__(self) -> None:
        if self.push.ask == self.pull.ask:
            raise ValueError(f"push and pull both say {quote(self.push.ask)}")

    def of(self, direction: ValveDirection) -> ValveSetting:
        """Return how this direction is set."""
        return self.pull if direction is ValveDirection.PULL else self.push


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveReading:
    """The question for the direction that stands. answer carries {state:WORD|WORD}; words says what each means."""

    __pydantic_config__ = STRICT
    ask: Annotated[str, MinLen(1)]
    answer: Annotated[str, MinLen(1)]  # with one field {state:...} of two words or more
    words: Mapping[str, ValveDirection]  # the device's word -> push or pull

    def __post_init__(self) -> None:
        compile_template(self.ask)
        field = compile_template(self.answer).field(STATE)
        if not isinstance(field, Choice):
            raise TemplateError(f"{quote(self.answer)} needs a field {{{STATE}:A|B}} with the device's words")
        if unknown := set(self.words) - set(field.words):
            raise ValueError(f"words names {', '.join(sorted(unknown))}, which {quote(self.answer)} does not have")
        if set(self.words.values()) != set(ValveDirection):
            raise ValueError("words must say which word means push and which one means pull")

    def word_of(self, direction: ValveDirection) -> str:
        """Return the device's first word for a direction."""
        return next(word for word, meant in self.words.items() if meant is direction)
