"""One strong example of each effect, in a machine that is otherwise what the base model can be.

Sizes leave 0.18 .. 0.35 N of residual after the base refit, two to three times the noise (a dead band or a coarse command
leaves what it leaves). Where an effect needs it, the machine around it differs too: only readings below zero can lose
their sign.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from gateway.diagnosis import Measurement
from tests.diagnosis.machine import Floats, recorded, times_s

Spoil = Callable[[Floats, np.random.Generator], Floats]


@dataclass(frozen=True, slots=True, kw_only=True)
class Hidden:
    """changes: the effect's fields, by path. around: fields that differ with and without it. told: what the answer must
    say of the parameters, within `factor`; empty where `changes` without the phases says it."""

    name: str
    changes: Mapping[str, float] = field(default_factory=dict)
    around: Mapping[str, float] = field(default_factory=dict)
    columns: tuple[str, ...] = ()
    rate_hz: float = 100.0
    without: str | None = None
    spoil: Spoil | None = None
    told: Mapping[str, float] = field(default_factory=dict)
    factor: float = 1.3

    def recording(self, *, hidden: bool = True, seed: int = 1) -> Measurement:
        """A minute of it; without the effect for hidden=False."""
        return recorded(
            {**self.around, **(self.changes if hidden else {})},
            self.columns,
            seed=seed,
            time_s=times_s(60.0, self.rate_hz),
            spoil=self.spoil if hidden else None,
        )

    @property
    def expected(self) -> Mapping[str, float]:
        """Parameter name -> value that the answer must come near."""
        named = {path.split(".")[1]: value for path, value in self.changes.items()}
        return self.told or {name: value for name, value in named.items() if not name.endswith(("_rad", "_deg"))}


def repeating(force_n: Floats, rng: np.random.Generator) -> Floats:
    """Every tenth reading, by chance, is the one before."""
    fresh = np.where(rng.random(force_n.size) < 0.1, 0, np.arange(force_n.size))
    return np.asarray(force_n[np.maximum.accumulate(fresh)])


def spiking(force_n: Floats, rng: np.random.Generator) -> Floats:
    """One reading in 200 is 5 N off."""
    return np.asarray(force_n + np.where(rng.random(force_n.size) < 0.005, 5.0, 0.0))


def rounding(force_n: Floats, rng: np.random.Generator) -> Floats:
    """Counts of half a newton."""
    return np.asarray(np.round(force_n / 0.5) * 0.5)


_FEED: Final = ("feed_mm_s",)
_PLACE: Final = ("position_mm",)

EXAMPLES: Final = (
    Hidden(name="transport-delay", changes={"regulator.delay_s": 0.014}),
    Hidden(name="extra-lag", changes={"regulator.second_lag_s": 0.028}),
    Hidden(name="dead-band", changes={"regulator.dead_band_pa": 1.0e4}),
    Hidden(name="regulator-hysteresis", changes={"regulator.hysteresis_pa": 3.0e4}),
    Hidden(name="command-quantisation", changes={"regulator.command_step_v": 0.25}),
    Hidden(name="command-nonlinearity", changes={"regulator.command_bow": 0.035}),
    Hidden(name="supply-saturation", changes={"regulator.supply_pa": 4.7e5}),
    Hidden(name="supply-droop", changes={"regulator.droop_pa_per_pa": 0.12}, columns=("supply_kpa",)),
    Hidden(name="leak", changes={"regulator.leak_per_s": 0.011}),
    Hidden(
        name="regulator-hunting",
        changes={"regulator.hunting_pa": 5.5e3, "regulator.hunting_hz": 6.3, "regulator.hunting_phase_rad": 1.0},
        rate_hz=200.0,
    ),
    Hidden(name="slew-limit", changes={"regulator.slew_pa_per_s": 3.8e6}),
    Hidden(name="coulomb-friction", changes={"friction.coulomb_n": 0.3}, around={"friction.coulomb_n": 0.0},
           without="coulomb-friction"),
    Hidden(name="stribeck-friction",  # which slips at few places: at many, each of them moves with the size (RATES.md: 1 of 4)
           changes={"friction.stribeck_n": 3.0, "friction.stribeck_speed_m_per_s": 5.0e-3}, factor=2.0),
    Hidden(name="viscous-friction", changes={"friction.viscous_n_s_per_m": 750.0}),
    Hidden(name="presliding", changes={"friction.presliding_m": 1.4e-4}),
    Hidden(name="load-dependent-friction", changes={"friction.load_dependent_n_per_n": 0.028}),
    Hidden(name="asymmetric-friction", changes={"friction.asymmetry_n_s_per_m": 500.0}),  # a constant one is the model's own
    Hidden(name="dwell-stiction", changes={"friction.dwell_stiction_n": 3.0, "friction.dwell_stiction_s": 3.0},
           factor=2.0),
    Hidden(name="position-dependent-friction",
           changes={"friction.place_n_per_mm": 0.03, "friction.place_n_per_mm2": 1.0e-3}, around={"friction.coulomb_n": 2.0},
           columns=_PLACE),
    Hidden(name="pressure-lag", changes={"cylinder.chamber_lag_s": 0.02}, columns=("pressure_kpa",)),
    Hidden(name="creep", changes={"contact.creep_share": 0.055, "contact.creep_s": 5.0}),
    Hidden(name="contact-nonlinearity", changes={"contact.hardening": 0.065}),
    Hidden(name="end-stop", changes={"cylinder.stroke_m": 1.0e-3}),
    Hidden(name="side-load", changes={"friction.side_load_n_s_per_mm": 0.05}, columns=_FEED),
    Hidden(name="tilt-gravity", changes={"contact.tilt_n": 0.6}, columns=("tilt_deg",)),
    Hidden(name="feed-drag", changes={"contact.feed_drag_n_s_per_mm": 0.028}, columns=_FEED),
    Hidden(name="spindle-vibration", changes={"contact.spindle_n": 0.37, "contact.spindle_phase_rad": 0.7},
           columns=("spindle_rpm",), rate_hz=200.0),
    Hidden(name="pad-wear", changes={"contact.wear_per_m": 0.16}, columns=("distance_m",)),
    Hidden(name="position-dependence", changes={"contact.position_n_per_mm": 0.04}, columns=_PLACE),
    Hidden(
        name="position-ripple",
        changes={"contact.ripple_n": 0.38, "contact.ripple_pitch_mm": 5.0, "contact.ripple_phase_rad": 0.5},
        columns=_PLACE,
    ),
    Hidden(name="backlash", changes={"contact.lost_n": 1.8}),
    Hidden(name="thermal-zero-drift", changes={"cell.zero_n_per_k": 0.085}, columns=("temperature_c",)),
    Hidden(name="thermal-span-drift", changes={"cell.span_per_k": 0.004}, columns=("temperature_c",)),
    Hidden(name="warm-up", changes={"cell.warm_up_n": 1.2, "cell.warm_up_s": 10.0}),
    Hidden(name="linear-drift", changes={"cell.drift_n_per_s": 0.015}),
    Hidden(name="sensor-quadratic", changes={"cell.quadratic_per_n": 0.002}),
    Hidden(name="sensor-cubic", changes={"cell.cubic_per_n2": 3.0e-5}),
    Hidden(name="mains-hum", changes={"cell.hum_n": 0.37, "cell.hum_phase_rad": 0.4, "cell.hum_hz": 50.03},
           rate_hz=200.0),
    Hidden(name="clock-offset", changes={"cell.clock_offset_s": -0.011}),
    Hidden(name="clock-skew", changes={"cell.clock_skew": 2.8e-4}),
    Hidden(name="repeated-samples", spoil=repeating, told={"repeated_share": 0.1}),
    Hidden(name="outliers", spoil=spiking, told={"outlier_share": 0.005, "outlier_n": 5.0}),
    Hidden(name="sensor-quantisation", spoil=rounding, told={"quantum_n": 0.5}, factor=1.001),
    Hidden(name="valve-crosstalk", changes={"cell.crosstalk_n_per_v": 2.0}),
    Hidden(name="sign-loss", changes={"cell.sign_lost": 1.0}, around={"cell.zero_n": -1.1}),
)  # fmt: skip
OTHER_FORMS: Final = (
    Hidden(name="side-load", changes={"friction.side_load_n_per_n": 0.06}, columns=_FEED),
    Hidden(name="position-dependent-friction",
           changes={"friction.place_n_per_mm": 0.03, "friction.place_asymmetry_n_per_mm": -0.03},
           around={"friction.coulomb_n": 2.0}, columns=_PLACE),
    Hidden(name="stribeck-friction", changes={"friction.dwell_stiction_n": 1.0, "friction.dwell_stiction_s": 0.15},
           factor=2.0),
)  # fmt: skip
"""Effects that show in more than one way, in another one than above."""
BY_NAME: Final = {each.name: each for each in EXAMPLES}
