"""What the libraries of several controllers share: routines of their arguments' values."""

from collections.abc import Callable
from typing import Any

from tests.clients.programs.machine import Frame, Machine
from tests.clients.programs.syntax.parser import Node


def values(act: Callable[..., Any]) -> Callable[[Machine, list[Node], Frame], Any]:
    """Return a library routine that gets its arguments' values in their order. Who has them already calls `act` itself."""

    def call(machine: Machine, arguments: list[Node], frame: Frame) -> Any:
        return act(*machine.values(arguments, frame))

    call.act = act  # type: ignore[attr-defined]
    return call


def real_to_int(number: float) -> int:
    """TwinCAT: "outside the integer's range of values, you get an undefined result. An exception error is also possible!"""
    if not -32768.5 < number < 32767.5:
        raise OverflowError(f"REAL_TO_INT({number})")
    return round(number)


def nothing(*_: Any) -> None:
    """Do what no client can see."""
