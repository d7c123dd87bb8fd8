"""Which device is behind the port? The question of a profile that has one, and the answers that are right."""

from dataclasses import dataclass
from typing import Annotated, Final

from annotated_types import MinLen

from gateway.defaults import STRICT
from gateway.devices.binary.register_access import VALUE, RegisterAccess, check_direction, templates_of
from gateway.devices.fields import TemplateError, Value
from gateway.devices.template import compile_template, quote

MODEL: Final = "model"


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """A question that changes nothing and whose answer tells what the device is, in the field {model:...}.

    Asked when the port has been opened, and anew after each reopening; an answer that is not in `models` is a fault (A333).
    """

    __pydantic_config__ = STRICT
    ask: str = ""  # template of the question, without terminator
    answer: str = ""  # template of the answer; {model:s} is what the device says that it is
    modbus: RegisterAccess | None = None  # of a Modbus device instead: the register that tells it
    models: Annotated[tuple[str | int, ...], MinLen(1)]  # what this profile is for

    def __post_init__(self) -> None:
        check_direction(self.modbus, reads=True)
        ask, answer = templates_of(self.modbus, self.ask, self.answer)
        object.__setattr__(self, "ask", ask)
        object.__setattr__(self, "answer", answer)
        compile_template(ask)
        if self.modbus and not all(isinstance(model, int) for model in self.models):
            raise ValueError("models: a register tells a number: write it without quotes, 4024 or 0x4024")
        if compile_template(answer).field(self._field) is None:
            raise TemplateError(f"{quote(answer)} has no {{model:...}}: what the device says that it is")

    @property
    def _field(self) -> str:
        return VALUE if self.modbus else MODEL

    def said(self, values: dict[str, Value]) -> str:
        """Return what the device says that it is."""
        return str(values[self._field])

    def is_right(self, said: str) -> bool:
        """Decide whether this profile is for such a device."""
        return said in map(str, self.models)

    @property
    def example(self) -> dict[str, Value]:
        """Values of a right answer, for the simulated device."""
        return {self._field: self.models[0]}
