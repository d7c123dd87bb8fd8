"""Two calibrations over the voltages that both cover: by how much their branches differ, B minus A."""

from dataclasses import dataclass
from math import sqrt
from typing import Any, Final

from gateway.bsfm import Calibration, RationalBezier

_POINTS: Final = 401
_SHOWN: Final = 9
_BRANCHES: Final = ("rising", "falling")

Forces = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class BranchDifference:
    """One branch of both, N, at the comparison's voltages."""

    a_n: Forces
    b_n: Forces

    @property
    def difference_n(self) -> Forces:
        """B minus A at each voltage, N."""
        return tuple(b - a for a, b in zip(self.a_n, self.b_n, strict=True))

    @property
    def rms_n(self) -> float:
        """RMS of the differences, N."""
        return sqrt(sum(gap * gap for gap in self.difference_n) / len(self.difference_n))

    @property
    def max_n(self) -> float:
        """The largest difference, with its sign."""
        return max(self.difference_n, key=abs)


@dataclass(frozen=True, slots=True)
class Comparison:
    """Both branches of two calibrations, side by side. voltage_v: evenly over the common range."""

    a: Calibration
    b: Calibration
    voltage_v: tuple[float, ...]
    branches: dict[str, BranchDifference]

    def facts(self) -> dict[str, Any]:
        """Return the comparison as a JSON object."""
        return {
            "a": {"number": self.a.number, "name": self.a.name},
            "b": {"number": self.b.number, "name": self.b.name},
            "voltage_range_v": [self.voltage_v[0], self.voltage_v[-1]],
            **{
                name: {"rms_n": difference.rms_n, "max_n": difference.max_n, "at_v": self.place_v(difference)}
                for name, difference in self.branches.items()
            },
            "reversal": [self.a.reversal_kind, self.b.reversal_kind],
            "blend_span_n": [self.a.blend_span_n, self.b.blend_span_n],
        }

    def place_v(self, branch: BranchDifference) -> float:
        """Return where the branch differs most."""
        return self.voltage_v[branch.difference_n.index(branch.max_n)]


def compare_calibrations(a: Calibration, b: Calibration) -> Comparison:
    """Compare the branches of two calibrations. ValueError when the two have no voltage in common."""
    low_v, high_v = max(a.x0_v, b.x0_v), min(a.x1_v, b.x1_v)
    if low_v >= high_v:
        raise ValueError(f"{title(a)} and {title(b)} have no voltage in common")
    voltage_v = tuple(low_v + (high_v - low_v) * k / (_POINTS - 1) for k in range(_POINTS))
    models = a.model().branches, b.model().branches
    branches = {
        name: BranchDifference(*(_forces(getattr(model, name), voltage_v) for model in models)) for name in _BRANCHES
    }
    return Comparison(a, b, voltage_v, branches)


def answer_sentence(comparison: Comparison) -> str:
    """Return the answer, for terminal and page: by how much, and where most."""
    name, worst = max(comparison.branches.items(), key=lambda item: abs(item[1].max_n))
    rms_n = sqrt(sum(branch.rms_n**2 for branch in comparison.branches.values()) / len(comparison.branches))
    if worst.max_n == 0.0:
        return "Both calibrations are the same over the voltages that both cover"
    way = "more" if worst.max_n > 0.0 else "less"
    return (
        f"B differs from A by {rms_n:.2f} N RMS, most at {comparison.place_v(worst):.2f} V {name}: "
        f"{abs(worst.max_n):.2f} N {way} than A"
    )


def table(comparison: Comparison) -> str:
    """Return text for the terminal: the figures, then the branches at a few voltages."""
    lines = [
        f"{name}  {title(each)}, {each.reversal_kind}" for name, each in (("A", comparison.a), ("B", comparison.b))
    ]
    lines += ["", f"{answer_sentence(comparison)}.", ""]
    for name, difference in comparison.branches.items():
        place_v = comparison.place_v(difference)
        lines.append(
            f"{name:<8} B - A  {difference.rms_n:7.3f} N RMS, at most {difference.max_n:+z.3f} N at {place_v:.2f} V"
        )
    lines += ["", "     V   rising A  rising B   B - A   falling A falling B   B - A"]
    for k in range(0, _POINTS, (_POINTS - 1) // (_SHOWN - 1)):
        forces = (
            f"{difference.a_n[k]:9.2f} {difference.b_n[k]:9.2f} {difference.difference_n[k]:+z8.3f}"
            for difference in comparison.branches.values()
        )
        lines.append(f"{comparison.voltage_v[k]:6.2f}  {'   '.join(forces)}")
    return "\n".join(lines)


def _forces(curve: RationalBezier, voltage_v: tuple[float, ...]) -> Forces:
    return tuple(float(curve.value(volts)) for volts in voltage_v)


def title(calibration: Calibration) -> str:
    """Return what a calibration is called."""
    return f"calibration {calibration.number} ({calibration.name}, {calibration.date_utc})"
