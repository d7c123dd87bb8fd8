"""The sentence that sets a voltage: everything in it but the number is spelled out before the first setpoint comes.

A setpoint passes here on its way to the wire, mostly after milliseconds of rest: then each object that has to be fetched costs
more than what is done with it. So all that does not depend on the voltage is worked out once.
"""

from math import isfinite

from gateway.devices.fields import Field, ValueRefused
from gateway.devices.grammar import Grammar
from gateway.devices.template import compile_template


class VoltageSentence:
    """Spells settings of one device."""

    def __init__(self, grammar: Grammar) -> None:
        exchange = grammar.set_voltage
        self._grammar, self._template = grammar, exchange.ask
        scale, self._range_v = exchange.range.scale, exchange.range.voltage_v
        self._number, self._decimals = grammar.number_in(exchange.ask)
        half_step = 0.5 * 10.0**-self._decimals
        self._first, self._first_v, self._v_per_number = scale.device[0], scale.physical[0], scale.physical_per_number
        self._least, self._most = scale.device[0] - half_step, scale.device[1] + half_step
        self._per_unit: int = 10**self._decimals
        self._lowest, self._highest = scale.grid(self._decimals)
        self._is_bare, self._terminator = grammar.is_bare, grammar.profile.question_terminator_bytes
        self._around: tuple[str, str] | None = None  # before and behind the number, from the first setting on

    def spell(self, voltage_v: float) -> bytes:
        """Return the sentence with the nearest number that the device knows, as it goes on the wire. ValueRefused for nan, inf,
        and outside the device's range."""
        number = self._first + (voltage_v - self._first_v) / self._v_per_number
        if not isfinite(number) or not self._least <= round(number, self._decimals) <= self._most:
            low_v, high_v = self._range_v
            raise ValueRefused(f"{voltage_v} V, {self._grammar.profile.name} takes {low_v:g} .. {high_v:g} V")
        steps = min(self._highest, max(self._lowest, round(number * self._per_unit)))
        number = float(steps) / self._per_unit
        if self._number is None:
            return self._grammar.question_line(self._grammar.number_body(self._template, number))
        before, behind = self._around or self._spell_around(self._number)
        body = f"{before}{self._number.encode(round(number, self._decimals))}{behind}".encode("ascii")
        return body + self._terminator if self._is_bare else self._grammar.question_line(body)

    def _spell_around(self, number: Field) -> tuple[str, str]:
        self._around = compile_template(self._template).around(number, self._grammar.fill(self._template))
        return self._around
