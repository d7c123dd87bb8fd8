"""Effects that control does not compensate: the numbers of a plant that make each, and what stands in the way."""

from typing import Final

_SPEED: Final = "it depends on the slide's speed, which nobody measures"
_TRIM: Final = "the trim takes it back as the load cell sees it"
_NO_PLACE: Final = "the command block carries no place along the path; what is slow the trim takes back"
_RIPPLE: Final = "it is faster than the regulator's delay and lags let the force follow"
_READING: Final = "it is in single readings: the trim is slow enough not to follow them"
_LOG: Final = "it is the recording's: the control loop has one clock"
_ZERO: Final = "the cell shows it as force, and its size now is not known: tare before work"

REASONS: Final[dict[str, tuple[tuple[str, ...], str]]] = {
    "dead-band": (
        ("regulator.dead_band_pa",),
        "changes of the command within it are not heard, whatever they are",
    ),
    "command-quantisation": (("regulator.command_step_v",), "nothing between two steps can be sent"),
    "supply-saturation": (("regulator.supply_pa", "regulator.ceiling_pa"), "the air line has no more pressure"),
    "supply-droop": (
        ("regulator.droop_pa_per_pa", "regulator.droop_share_per_pa", "regulator.droop_reference_pa"),
        f"the supply pressure is not told to the controller; {_TRIM}",
    ),
    "leak": (("regulator.leak_per_s", "regulator.leak_flow_pa", "regulator.fill_slowdown"), _TRIM),
    "regulator-hunting": (("regulator.hunting_pa", "regulator.hunting_hz", "regulator.hunting_phase_rad"), _RIPPLE),
    "slew-limit": (("regulator.slew_pa_per_s",), "the regulator cannot be faster than it is"),
    "stribeck-friction": (("friction.stribeck_n", "friction.stribeck_speed_m_per_s"), _SPEED),
    "viscous-friction": (("friction.viscous_n_s_per_m",), _SPEED),
    "asymmetric-friction": (("friction.asymmetry_n_s_per_m",), _SPEED),
    "dwell-stiction": (
        ("friction.dwell_stiction_n", "friction.dwell_stiction_s"),
        "the model has no memory of how long the slide has rested",
    ),
    "creep": (("contact.creep_share", "contact.creep_s"), _TRIM),
    "end-stop": (
        ("cylinder.stroke_m", "contact.stop_stiffness_n_per_mm", "contact.stop_mm"),
        "beyond it the slide carries no more force: mount the tool nearer",
    ),
    "side-load": (
        (
            "friction.side_load_n_s_per_mm",
            "friction.side_load_n_per_n",
            "friction.side_load_tilt_n",
            "friction.side_load_n_per_mm",
        ),
        "the model's loop has one width, whatever presses from the side",
    ),
    "spindle-vibration": (
        (
            "contact.spindle_n",
            "contact.spindle_n_per_krpm2",
            "contact.spindle_order",
            "contact.spindle_phase_rad",
        ),
        _RIPPLE,
    ),
    "pad-wear": (("contact.wear_per_m", "contact.wear_n_per_m"), _TRIM),
    "position-dependence": (("contact.position_n_per_mm", "contact.position_n_per_mm2"), _NO_PLACE),
    "position-ripple": (("contact.ripple_n", "contact.ripple_pitch_mm", "contact.ripple_phase_rad"), _NO_PLACE),
    "warm-up": (("cell.warm_up_n", "cell.warm_up_s"), _ZERO),
    "linear-drift": (("cell.drift_n_per_s",), _ZERO),
    "mains-hum": (("cell.hum_n", "cell.hum_hz", "cell.hum_phase_rad"), _READING),
    "clock-offset": (("cell.clock_offset_s",), _LOG),
    "clock-skew": (("cell.clock_skew",), _LOG),
    "repeated-samples": (("cell.repeated_share",), _READING),
    "outliers": (("cell.outlier_share", "cell.outlier_n"), _READING),
    "sensor-quantisation": (("cell.quantum_n",), "what is between two counts is lost"),
    "sign-loss": (("cell.sign_lost",), "a lost sign cannot be brought back: check the amplifier's settings"),
}
