"""The generated C, operation by operation, in numpy.float32: what tests compare it with bit for bit.

Not a second curve for use in Python (gateway.bsfm.curve is faster and exact to 1e-11): it exists to prove the C and to
measure, at export, how far float32 is from the double model. Each line here is a line of templates/, in the same order of
operations; change both or neither. It holds for compilers that round every operation to float32 (no fused
multiply-add, no x87).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import isfinite
from typing import Final

import numpy as np

from gateway.bsfm.c_export.tables import BranchTable, Tables

CLOSE: Final = 1.0e-4
"""Newton stops after a step of this share of r: it converges quadratically, so the next one would be rounding."""
ROUNDS_MAX: Final = 48

Float32 = np.float32
Answer = tuple[Float32, "Code"]
_ONE, _TWO, _HALF, _ZERO = Float32(1), Float32(2), Float32(0.5), Float32(0)


class Code(IntEnum):
    """The status codes of the C."""

    OK = 0
    LOW = 1
    HIGH = 2
    INVALID = 3


class _Branch:
    def __init__(self, table: BranchTable) -> None:
        self.handles = _float32s(table.handles_n)
        self.weights = _float32s(table.weights)
        self.totals = _float32s(table.totals)
        self.products = _float32s(table.products)
        self.half = Float32(table.half_n)


@dataclass(slots=True)
class CommandState:
    """The caller-owned struct of the C."""

    force_n: Float32
    memory: list[Float32]  # the blend, or the places of the slip stops
    voltage_v: Float32


class Float32Model:
    """The functions of the generated C, under the same names; forces and voltages are numpy.float32."""

    def __init__(self, tables: Tables) -> None:
        self.order = tables.order
        self.x0, self.x1, self.x_span = Float32(tables.x0_v), Float32(tables.x1_v), Float32(tables.x_span_v)
        self.lowest, self.highest = _float32s(tables.reached_n)
        self.blend_span = Float32(tables.blend_span_n)
        self.radii, self.shares = _float32s(tables.radii_v), _float32s(tables.shares)
        self.stiffness = Float32(tables.stiffness_per_v)
        self.rising, self.falling = _Branch(tables.rising), _Branch(tables.falling)
        self.rounds_max = 0  # most Newton rounds that any call has taken

    def rising_force(self, voltage_v: Float32) -> Answer:
        """Return the force of the rising branch at this voltage, N, and the code, as the C does."""
        return self._force_of(self.rising, voltage_v)

    def falling_force(self, voltage_v: Float32) -> Answer:
        """Return the force of the falling branch at this voltage, N, and the code, as the C does."""
        return self._force_of(self.falling, voltage_v)

    def rising_voltage(self, force_n: Float32) -> Answer:
        """Return the voltage of the rising branch for this force, V, and the code, as the C does."""
        return self._voltage_of(self.rising, force_n)

    def falling_voltage(self, force_n: Float32) -> Answer:
        """Return the voltage of the falling branch for this force, V, and the code, as the C does."""
        return self._voltage_of(self.falling, force_n)

    def blend(self, blend: Float32, delta_n: Float32) -> Float32:
        """Return the blend after the force has moved by delta_n, in [-1, 1], as the C does."""
        if isfinite(delta_n) and delta_n != 0:
            if abs(delta_n) >= self.blend_span:
                return _ONE if delta_n > 0 else -_ONE
            blend = blend + _TWO * delta_n / self.blend_span
        return _clip(blend, -_ONE, _ONE)

    def voltage(self, force_n: Float32, blend: Float32) -> Answer:
        """Return the voltage for a force between the branches, V, and the code, as the C does."""
        if not _is_blend(blend):
            return self.x0, Code.INVALID
        share = _HALF + _HALF * blend
        if share >= 1:
            return self._voltage_of(self.rising, force_n)
        if share <= 0:
            return self._voltage_of(self.falling, force_n)
        falling_v, falling = self._voltage_of(self.falling, force_n)
        rising_v, rising = self._voltage_of(self.rising, force_n)
        return falling_v + share * (rising_v - falling_v), falling if rising is Code.OK else rising

    def force(self, voltage_v: Float32, blend: Float32) -> Answer:
        """Return the force at a voltage between the branches, N, and the code, as the C does."""
        if not _is_blend(blend):
            return self.falling.handles[0], Code.INVALID
        falling_n, status = self._force_of(self.falling, voltage_v)
        rising_n, _ = self._force_of(self.rising, voltage_v)
        return falling_n + (_HALF + _HALF * blend) * (rising_n - falling_n), status

    def branch_share(self, state: CommandState) -> Float32:
        """Return s in [-1, 1] of the memory, as the C does."""
        if not self.radii:
            return state.memory[0]
        total = _ZERO
        for share, place in zip(self.shares, state.memory, strict=True):
            total = total + share * place
        return _clip(total, -_ONE, _ONE)

    def reset(self) -> CommandState:
        """Return the memory of a vented tool, where the calibration ladder starts."""
        return CommandState(self.lowest, [-_ONE] * len(self.radii) or [_ONE], self.x0)

    def command(self, state: CommandState, force_n: Float32) -> Answer:
        """Move the memory to a force and return its voltage, V, and the code, as the C does."""
        if self._is_damaged(state):
            return self.x0, Code.INVALID
        if not isfinite(force_n):
            return state.voltage_v, Code.INVALID
        reached_n = _clip(force_n, self.lowest, self.highest)
        self._move_to(state, reached_n)
        state.force_n = reached_n
        state.voltage_v, status = self.voltage(force_n, self.branch_share(state))
        return state.voltage_v, status

    def _is_damaged(self, state: CommandState) -> bool:
        inside = self.lowest <= state.force_n <= self.highest and self.x0 <= state.voltage_v <= self.x1
        return not (inside and all(map(_is_blend, state.memory)))

    def _move_to(self, state: CommandState, force_n: Float32) -> None:
        if not self.radii:
            state.memory[0] = self.blend(state.memory[0], force_n - state.force_n)
            return
        if force_n == state.force_n:
            return
        from_middle_v, from_half_v = self._middle_and_half(state.force_n)
        middle_v, half_v = self._middle_and_half(force_n)
        stuck_v = middle_v - from_middle_v + self.branch_share(state) * (half_v - from_half_v)
        travel_v = self._travel(state, stuck_v, half_v)
        state.memory = [
            _clip(place + travel_v / radius, -_ONE, _ONE)
            for place, radius in zip(state.memory, self.radii, strict=True)
        ]

    def _middle_and_half(self, force_n: Float32) -> tuple[Float32, Float32]:
        rising_v, _ = self._voltage_of(self.rising, force_n)
        falling_v, _ = self._voltage_of(self.falling, force_n)
        return _HALF * (rising_v + falling_v), _HALF * (rising_v - falling_v)

    def _travel(self, state: CommandState, stuck_v: Float32, half_v: Float32) -> Float32:
        way = _ONE if stuck_v > 0 else -_ONE
        distance_v, stiffness = abs(stuck_v), half_v * self.stiffness
        travel_v = distance_v / (_ONE - stiffness)
        for radius, share, place in zip(self.radii, self.shares, state.memory, strict=True):
            free = _ONE - way * place
            if travel_v <= radius * free:
                break
            distance_v = distance_v + half_v * share * free
            stiffness = stiffness - half_v * share / radius
            travel_v = distance_v / (_ONE - stiffness)
        return way * travel_v

    def _force_of(self, branch: _Branch, voltage_v: Float32) -> Answer:
        if not isfinite(voltage_v):
            return branch.handles[0], Code.INVALID
        up, down = voltage_v - self.x0, self.x1 - voltage_v
        if up <= 0:
            return branch.handles[0], Code.LOW if up < 0 else Code.OK
        if down <= 0:
            return branch.handles[-1], Code.HIGH if down < 0 else Code.OK
        below = up <= down
        r = up / down if below else down / up
        products, totals = (
            (branch.products[::-1], branch.totals[::-1]) if below else (branch.products, branch.totals)
        )  # highest power of r first
        product, total = products[0], totals[0]
        for next_product, next_total in zip(products[1:], totals[1:], strict=True):
            product = product * r + next_product
            total = total * r + next_total
        return product / total, Code.OK

    def _voltage_of(self, branch: _Branch, force_n: Float32) -> Answer:
        if not isfinite(force_n):
            return self.x0, Code.INVALID
        up, down = force_n - branch.handles[0], branch.handles[-1] - force_n
        if up <= 0:
            return self.x0, Code.LOW if up < 0 else Code.OK
        if down <= 0:
            return self.x1, Code.HIGH if down < 0 else Code.OK
        if self.order > 2:
            return self._inside_n(branch, force_n, up, down), Code.OK
        return self._inside_closed(branch, force_n, up, down), Code.OK

    def _inside_closed(self, branch: _Branch, force_n: Float32, up: Float32, down: Float32) -> Float32:
        up = branch.weights[0] * up
        down = branch.weights[-1] * down
        if self.order == 2:
            m = branch.weights[1] * (branch.handles[1] - force_n)
            root = np.sqrt(m * m + up * down)
            if m >= 0:
                down = m + root
            else:
                up = root - m
        if up <= down:
            return self.x0 + self.x_span * (up / (up + down))
        return self.x1 - self.x_span * (down / (up + down))

    def _inside_n(self, branch: _Branch, force_n: Float32, up: Float32, down: Float32) -> Float32:
        terms = list(zip(branch.totals, branch.handles, strict=True))
        if force_n <= branch.half:
            gaps = [total * (handle - force_n) for total, handle in terms]
            return self.x0 + self.x_span * self._near_share(gaps, branch.totals, up / (branch.half - branch.handles[0]))
        gaps = [total * (force_n - handle) for total, handle in reversed(terms)]
        share = down / (branch.handles[-1] - branch.half)
        return self.x1 - self.x_span * self._near_share(gaps, branch.totals[::-1], share)

    def _near_share(self, gaps: Sequence[Float32], totals: Sequence[Float32], share: Float32) -> Float32:
        low, high, shrink, last_step = _ZERO, _TWO, Float32(0.25), Float32(8)
        r = share / (_TWO - share)
        pairs = tuple(zip(reversed(gaps), reversed(totals), strict=True))
        for rounds in range(ROUNDS_MAX):
            self.rounds_max = max(self.rounds_max, rounds + 1)
            gap, new = _newton(pairs, r)
            if gap == 0:
                break
            low, high = (r, high) if gap < 0 else (low, r)
            if abs(new - r) <= Float32(CLOSE) * r:
                r = new
                break
            if not low < new < high or abs(new - r) > _HALF * last_step:
                new = np.sqrt(low) * np.sqrt(high) if low > 0 else high * shrink
                shrink = shrink if low > 0 else shrink * shrink
            last_step, r = abs(new - r), new
        return r / (_ONE + r)


def _newton(pairs: Sequence[tuple[Float32, Float32]], r: Float32) -> tuple[Float32, Float32]:
    """The gap at r, and the next r (-1 where the step leads nowhere). pairs: gap and total, highest power first."""
    gap, total = pairs[0]
    gap_slope = total_slope = _ZERO
    for next_gap, next_total in pairs[1:]:
        gap_slope = gap_slope * r + gap
        gap = gap * r + next_gap
        total_slope = total_slope * r + total
        total = total * r + next_total
    rise = gap_slope * total - gap * total_slope
    if not rise > 0:
        return gap, -_ONE
    step = -gap * total / rise
    return gap, (r * (_ONE + r) + step) / (_ONE + r - step) if step < _ONE + r else -_ONE


def _float32s(values: Sequence[float]) -> tuple[Float32, ...]:
    return tuple(map(Float32, values))


def _is_blend(blend: Float32) -> bool:
    return bool(-1 <= blend <= 1)


def _clip(value: Float32, low: Float32, high: Float32) -> Float32:
    return low if value < low else high if value > high else value
