"""What happens between the branches when the force turns round: reversal policies.

The paper switches branches, which costs up to 0.9 V at once and doubles the error under chatter. Here the branch share s
in [-1, 1] says where between the branches the plant is: +1 on the rising one, -1 on the falling one. A play operator moves
it: s += 2 df / span, clipped. An exponential blend was rejected: it drifts under chatter.

Policies have one interface (`Reversal`), so that model and control know none of them: a memory moves with the force, and
tells the branch share s. LinearBlend remembers s alone, gateway.bsfm.slip.slip_stops one number per stop. `start` is where
the calibration
ladder starts, because that is where the policy's branches are true: for two branches that a ladder was fitted to, on the
rising one.
"""

from dataclasses import dataclass
from math import isfinite
from typing import Protocol, TypeAlias

from gateway.bsfm.branches import Branches

RISING, FALLING = 1.0, -1.0
Memory: TypeAlias = tuple[float, ...]
"""What a policy remembers of past reversals; made and read by the policy alone."""


class Reversal(Protocol):
    """What happens between the branches. All methods are pure; the memory is immutable."""

    def start(self) -> Memory:
        """Return the memory of a vented tool, where the calibration ladder starts."""

    def at(self, branch_share: float) -> Memory:
        """Return a memory with this branch share; +1 and -1 are the branches, whatever came before."""

    def branch_share(self, memory: Memory) -> float:
        """Return s in [-1, 1]: +1 on the rising branch, -1 on the falling one."""

    def memory_after(self, branches: Branches, memory: Memory, from_n: float, to_n: float) -> Memory:
        """Return the memory after the force has gone from one value to another without turning round in between."""

    def check(self, branches: Branches) -> None:
        """Raise ValueError with a sentence where this policy and these branches make no unique voltage."""


@dataclass(frozen=True, slots=True)
class LinearBlend:
    """Leads linearly from one branch to the other. span_n: change of force that leads from one branch to the other. 0
    switches at once, as the paper does.
    """

    span_n: float

    def __post_init__(self) -> None:
        if not (isfinite(self.span_n) and self.span_n >= 0.0):
            raise ValueError(f"blend span {self.span_n!r} N: 0 or more is needed")

    def start(self) -> Memory:
        """Return the memory of a vented tool: on the rising branch."""
        return (RISING,)

    def at(self, branch_share: float) -> Memory:
        """Return a memory with this branch share."""
        return (branch_share,)

    def branch_share(self, memory: Memory) -> float:
        """Return s in [-1, 1]."""
        return memory[0]

    def memory_after(self, branches: Branches, memory: Memory, from_n: float, to_n: float) -> Memory:
        """Return the memory after the force has gone from one value to another."""
        return (self.advance(memory[0], to_n - from_n),)

    def check(self, branches: Branches) -> None:
        """Accept any branches that increase: the voltage is explicit."""

    def advance(self, branch_share: float, delta_n: float) -> float:
        """Return the branch share, -1 .. 1, after the force has moved by delta_n. ValueError unless both are finite."""
        if not (isfinite(branch_share) and isfinite(delta_n)):
            raise ValueError(f"branch share {branch_share!r}, change {delta_n!r} N: not finite")
        if delta_n == 0.0:
            return _clip(branch_share)
        if abs(delta_n) >= self.span_n:  # all the way; also keeps 2 df / span finite
            return RISING if delta_n > 0.0 else FALLING
        return _clip(branch_share + 2.0 * delta_n / self.span_n)


def _clip(branch_share: float) -> float:
    return max(-1.0, min(1.0, branch_share))
