"""The causes that the residual watch can name in the register residual_cause.

Numbers are frozen within a map version; the names are those of the diagnosis' catalogue, in its order. The catalogue
itself stands above this room, and a test compares.
"""

from enum import IntEnum


class ResidualCause(IntEnum):
    """What makes the measurements differ from the model. UNKNOWN: they do, and no cause of the catalogue explains it."""

    NONE = 0
    TRANSPORT_DELAY = 1
    EXTRA_LAG = 2
    DEAD_BAND = 3
    REGULATOR_HYSTERESIS = 4
    COMMAND_QUANTISATION = 5
    COMMAND_NONLINEARITY = 6
    SUPPLY_SATURATION = 7
    SUPPLY_DROOP = 8
    LEAK = 9
    REGULATOR_HUNTING = 10
    SLEW_LIMIT = 11
    COULOMB_FRICTION = 12
    STRIBECK_FRICTION = 13
    VISCOUS_FRICTION = 14
    PRESLIDING = 15
    LOAD_DEPENDENT_FRICTION = 16
    ASYMMETRIC_FRICTION = 17
    DWELL_STICTION = 18
    CREEP = 19
    CONTACT_NONLINEARITY = 20
    END_STOP = 21
    SIDE_LOAD = 22
    TILT_GRAVITY = 23
    FEED_DRAG = 24
    SPINDLE_VIBRATION = 25
    PAD_WEAR = 26
    POSITION_DEPENDENCE = 27
    POSITION_RIPPLE = 28
    BACKLASH = 29
    THERMAL_ZERO_DRIFT = 30
    THERMAL_SPAN_DRIFT = 31
    WARM_UP = 32
    LINEAR_DRIFT = 33
    SENSOR_QUADRATIC = 34
    SENSOR_CUBIC = 35
    MAINS_HUM = 36
    CLOCK_OFFSET = 37
    CLOCK_SKEW = 38
    REPEATED_SAMPLES = 39
    OUTLIERS = 40
    SENSOR_QUANTISATION = 41
    VALVE_CROSSTALK = 42
    SIGN_LOSS = 43
    UNKNOWN = 99

    @property
    def effect(self) -> str:
        """The name in the catalogue: `transport-delay`."""
        return self.name.lower().replace("_", "-")

    @classmethod
    def of_effect(cls, name: str) -> "ResidualCause":
        """The number of an effect; UNKNOWN for one that this map has no number for."""
        return cls.__members__.get(name.upper().replace("-", "_"), cls.UNKNOWN)
