"""The size that `sim set EFFECT=on` gives to each parameter of an effect: one that shows in the force on the shipped plant.

Most are those with which tests/diagnosis/hidden.py asks whether each effect is found: they leave 0.18 .. 0.35 N after a refit,
two to three times the noise. Bounds (supply, slew, end stop) are such that 15 .. 30 N feel them; friction is on top of what
an air slide has; a clock that is late rather than early, for a running machine does not know the future. An effect that acts by
a column (feed, temperature) needs `around.COLUMN` besides.
"""

from collections.abc import Mapping
from typing import Final

DEMONSTRATIONS: Final[Mapping[str, Mapping[str, float]]] = {
    "transport-delay": {"delay_s": 0.12},
    "extra-lag": {"second_lag_s": 0.15},
    "dead-band": {"dead_band_pa": 1.0e4},
    "regulator-hysteresis": {"hysteresis_pa": 3.0e4},
    "command-quantisation": {"command_step_v": 0.25},
    "command-nonlinearity": {"command_bow": 0.035},
    "supply-saturation": {"supply_pa": 2.0e5},
    "supply-droop": {"droop_pa_per_pa": 0.12},
    "leak": {"leak_per_s": 0.011},
    "regulator-hunting": {"hunting_pa": 5.5e3, "hunting_hz": 6.3},
    "slew-limit": {"slew_pa_per_s": 3.0e5},
    "coulomb-friction": {"coulomb_n": 3.0},
    "stribeck-friction": {"stribeck_n": 1.1, "stribeck_speed_m_per_s": 1.0e-3},
    "viscous-friction": {"viscous_n_s_per_m": 750.0},
    "presliding": {"presliding_m": 6.0e-4},
    "load-dependent-friction": {"load_dependent_n_per_n": 0.08},
    "asymmetric-friction": {"asymmetry_n": 0.8},
    "dwell-stiction": {"dwell_stiction_n": 3.0, "dwell_stiction_s": 3.0},
    "position-dependent-friction": {"place_n_per_mm": 0.03, "place_n_per_mm2": 1.0e-3},
    "pressure-lag": {"chamber_lag_s": 0.05},
    "creep": {"creep_share": 0.055, "creep_s": 5.0},
    "contact-nonlinearity": {"hardening": 0.065},
    "end-stop": {"stroke_m": 5.0e-4},
    "side-load": {"side_load_n_s_per_mm": 0.05},
    "tilt-gravity": {"tilt_n": 0.6},
    "feed-drag": {"feed_drag_n_s_per_mm": 0.028},
    "spindle-vibration": {"spindle_n": 0.37, "spindle_phase_rad": 0.7},
    "pad-wear": {"wear_per_m": 0.16},
    "position-dependence": {"position_n_per_mm": 0.04},
    "position-ripple": {"ripple_n": 0.38, "ripple_pitch_mm": 5.0},
    "backlash": {"lost_n": 1.8},
    "thermal-zero-drift": {"zero_n_per_k": 0.085},
    "thermal-span-drift": {"span_per_k": 0.004},
    "warm-up": {"warm_up_n": 1.2, "warm_up_s": 10.0},
    "linear-drift": {"drift_n_per_s": 0.015},
    "sensor-quadratic": {"quadratic_per_n": 0.002},
    "sensor-cubic": {"cubic_per_n2": 3.0e-5},
    "mains-hum": {"hum_n": 0.37, "hum_hz": 50.03},
    "clock-offset": {"clock_offset_s": 0.05},
    "clock-skew": {"clock_skew": 2.8e-4},
    "repeated-samples": {"repeated_share": 0.1},
    "outliers": {"outlier_share": 0.005, "outlier_n": 5.0},
    "sensor-quantisation": {"quantum_n": 0.5},
    "valve-crosstalk": {"crosstalk_n_per_v": 0.5},
    "sign-loss": {"sign_lost": 1.0, "zero_n": -1.1},
}
"""Effect -> parameter of the plant -> its value, in the catalogue's units."""
