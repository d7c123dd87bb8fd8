"""Effects of load cell, amplifier, cabling and clock."""

from functools import partial
from typing import Final

from gateway.catalogue import effect, shared

entry = partial(effect.Effect, family="sensing and logging")

ZERO: Final = effect.Parameter("cell", "zero_n", "N", 0.0, -1.0e4, 1.0e4, 0.05, settled=True)  # fitted as the offset
ZERO_PER_K: Final = effect.Parameter("cell", "zero_n_per_k", "N/K", 0.0, -20.0, 20.0, 0.005)
SPAN_PER_K: Final = effect.Parameter("cell", "span_per_k", "1/K", 0.0, -0.2, 0.2, 5.0e-4)
WARM_UP: Final = effect.Parameter("cell", "warm_up_n", "N", 0.0, -50.0, 50.0, 0.05)
WARM_UP_TIME: Final = effect.Parameter("cell", "warm_up_s", "s", 60.0, 1.0, 1.0e4, 0.5, shape=True)
DRIFT: Final = effect.Parameter("cell", "drift_n_per_s", "N/s", 0.0, -10.0, 10.0, 5.0e-4)
QUADRATIC: Final = effect.Parameter("cell", "quadratic_per_n", "1/N", 0.0, -0.1, 0.1, 2.0e-4)
CUBIC: Final = effect.Parameter("cell", "cubic_per_n2", "1/N2", 0.0, -0.01, 0.01, 5.0e-6)
HUM: Final = effect.Parameter("cell", "hum_n", "N", 0.0, 0.0, 50.0, 0.05)
HUM_HZ: Final = effect.Parameter("cell", "hum_hz", "Hz", 50.0, 49.0, 61.0, 0.001, shape=True)
HUM_PHASE: Final = effect.Parameter("cell", "hum_phase_rad", "rad", 0.0, -10.0, 10.0, 0.02, shape=True)
CLOCK_OFFSET: Final = effect.Parameter("cell", "clock_offset_s", "s", 0.0, -1.0, 1.0, 0.001)
CLOCK_SKEW: Final = effect.Parameter("cell", "clock_skew", "1", 0.0, -0.05, 0.05, 2.0e-5)
CROSSTALK: Final = effect.Parameter("cell", "crosstalk_n_per_v", "N/V", 0.0, -20.0, 20.0, 0.01)
SIGN_LOST: Final = effect.Parameter("cell", "sign_lost", "1", 0.0, 0.0, 1.0, 0.05, settled=True)
REPEATED: Final = effect.Parameter("cell", "repeated_share", "1", 0.0, 0.0, 1.0, 0.01)
OUTLIER_SHARE: Final = effect.Parameter("cell", "outlier_share", "1", 0.0, 0.0, 0.5, 0.001)
OUTLIER: Final = effect.Parameter("cell", "outlier_n", "N", 0.0, 0.0, 1.0e4, 0.1)
QUANTUM: Final = effect.Parameter("cell", "quantum_n", "N", 0.0, 0.0, 100.0, 0.001)

_WARM_UP_AND_DOWN: Final = effect.Recipe(
    parts=(effect.PartName.CYCLES,),
    apart="warm the cell up by some kelvin (a lamp), run the plan, let it cool down, run it again",
)
_SINGLE_READINGS: Final = "it is in single readings: the trim is slow enough not to follow them"
_ONE_CLOCK: Final = "it is the recording's: the control loop has one clock"
_UNKNOWN_ZERO: Final = "the cell shows it as force, and its size now is not known: tare before work"
_TEMPERATURE: Final = "a temperature that goes up and down by some kelvin, recorded as temperature_c"


def _hum(hints: effect.SearchHints) -> tuple[effect.Start, ...]:
    return tuple((0.1, mains_hz, 0.0) for mains_hz in hints.mains_hz)


def _warm_up(hints: effect.SearchHints) -> tuple[effect.Start, ...]:
    return tuple((0.2, share * hints.duration_s) for share in (0.05, 0.15, 0.4))


def _drift(hints: effect.SearchHints) -> tuple[effect.Start, ...]:
    return ((0.3 / max(hints.duration_s, 1.0),),)


SENSING: Final = (
    entry(
        name="thermal-zero-drift",
        number=30,
        what="the zero of the load cell moves with temperature",
        signature="the residual follows temperature_c at any force",
        excitation=_TEMPERATURE,
        experiment="a warm-up and a cool-down without force and under force, with temperature_c recorded",
        recipe=_WARM_UP_AND_DOWN,
        treatments=(effect.Treatment(by=effect.By.CELL),),
        forms=(
            effect.EffectForm(
                parameters=(ZERO_PER_K,),
                probes=effect.fixed_starts((0.02,)),
                needs=("temperature_c",),
                proportional=True,
            ),
        ),
        group=shared.MONOTONE,
    ),
    entry(
        name="thermal-span-drift",
        number=31,
        what="the sensitivity of the load cell moves with temperature",
        signature="the residual follows temperature_c times the force",
        excitation=_TEMPERATURE + ", at low and high force",
        experiment="reversals over the whole range at two temperatures, with temperature_c recorded",
        recipe=_WARM_UP_AND_DOWN,
        treatments=(effect.Treatment(by=effect.By.CELL),),
        forms=(
            effect.EffectForm(
                parameters=(SPAN_PER_K,),
                probes=effect.fixed_starts((0.001,)),
                needs=("temperature_c",),
                proportional=True,
            ),
        ),
    ),
    entry(
        name="warm-up",
        number=32,
        what="after switching on the zero settles exponentially",
        signature="an exponential in time, at any force",
        excitation="the first minutes after switching on",
        experiment="record from switching on for ten minutes without force, with temperature_c recorded",
        recipe=effect.Recipe(
            parts=(effect.PartName.LONG_REST,),
            columns=("temperature_c",),
            apart="switch the amplifier off for half an hour before",
        ),
        treatments=(effect.Treatment(why_not=_UNKNOWN_ZERO),),
        forms=(effect.EffectForm(parameters=(WARM_UP, WARM_UP_TIME), probes=_warm_up, proportional=True),),
        group=(*shared.MONOTONE, "leak"),
    ),
    entry(
        name="linear-drift",
        number=33,
        what="the zero moves steadily in time",
        signature="a straight line in time, at any force",
        excitation="a recording of a minute or more that returns to the same levels",
        experiment="ten minutes without force, then ten at one force, with temperature_c and distance_m recorded",
        recipe=effect.Recipe(parts=(effect.PartName.CYCLES,)),
        treatments=(effect.Treatment(why_not=_UNKNOWN_ZERO),),
        forms=(effect.EffectForm(parameters=(DRIFT,), probes=_drift, proportional=True),),
        group=shared.MONOTONE,
    ),
    entry(
        name="sensor-quadratic",
        number=34,
        what="the load cell's line is bent to one side",
        signature="the residual is a parabola of the force",
        excitation="levels over the whole range",
        experiment="dead weights on the load cell, five levels",
        recipe=shared.DEAD_WEIGHTS,
        treatments=(effect.Treatment(by=effect.By.CELL),),
        forms=(effect.EffectForm(parameters=(QUADRATIC,), probes=effect.fixed_starts((2.0e-4,)), proportional=True),),
        group=shared.LIMITS,
    ),
    entry(
        name="sensor-cubic",
        number=35,
        what="the load cell's line is bent symmetrically",
        signature="the residual is a cubic of the force",
        excitation="levels over the whole range",
        experiment="dead weights on the load cell, seven levels",
        recipe=shared.DEAD_WEIGHTS,
        treatments=(effect.Treatment(by=effect.By.CELL),),
        forms=(effect.EffectForm(parameters=(CUBIC,), probes=effect.fixed_starts((5.0e-6,)), proportional=True),),
        group=shared.LIMITS,
    ),
    entry(
        name="mains-hum",
        number=36,
        what="the mains couple into the cell's cable",
        signature="a line at 50 or 60 Hz, or where the sampling folds it",
        excitation="any; sampled at 120 rows a second or more to tell it from other lines",
        experiment="ten seconds at rest at 500 rows a second",
        recipe=effect.Recipe(parts=(effect.PartName.REST, effect.PartName.DWELLS)),
        treatments=(effect.Treatment(why_not=_SINGLE_READINGS),),
        forms=(
            effect.EffectForm(parameters=(HUM, HUM_HZ, HUM_PHASE), probes=_hum, proportional=True, quadrature=True),
        ),
        group=("spindle-vibration", "regulator-hunting"),
    ),
    entry(
        name="clock-offset",
        number=37,
        what="the clock of the force differs from that of the command",
        signature="the whole force comes late or early",
        excitation="steps or ramps of the command",
        experiment="steps of the command with pressure_kpa recorded by the clock of the force",
        recipe=effect.Recipe(parts=(effect.PartName.STEPS, effect.PartName.RAMPS), columns=effect.PRESSURE),
        treatments=(effect.Treatment(why_not=_ONE_CLOCK),),
        least=7.0e-4,
        least_rows=0.5,
        rarity=3.0,
        forms=(effect.EffectForm(parameters=(CLOCK_OFFSET,), probes=effect.fixed_starts((0.003,), (0.03,), (-0.02,))),),
        group=shared.SLOW_LAGS,
    ),
    entry(
        name="clock-skew",
        number=38,
        what="one clock runs faster than the other",
        signature="the force comes later and later",
        excitation="steps from the beginning to the end of a minute or more",
        experiment="steps of the command over ten minutes",
        recipe=effect.Recipe(parts=(effect.PartName.LASTING,)),
        treatments=(effect.Treatment(why_not=_ONE_CLOCK),),
        forms=(
            effect.EffectForm(
                parameters=(CLOCK_SKEW,), probes=effect.fixed_starts((2.0e-4,), (2.0e-3,), (-2.0e-4,), (-2.0e-3,))
            ),
        ),
    ),
    entry(
        name="repeated-samples",
        number=39,
        what="the logger writes the last reading again",
        signature="readings that are equal to the last digit",
        excitation="any motion",
        experiment="count the amplifier's own sample numbers",
        recipe=effect.Recipe(parts=(effect.PartName.REST, effect.PartName.RAMPS)),
        treatments=(effect.Treatment(why_not=_SINGLE_READINGS),),
        forms=(),
        direct=True,
        marks=(REPEATED,),
    ),
    entry(
        name="outliers",
        number=40,
        what="single wrong readings",
        signature="spikes of one row",
        excitation="any",
        experiment="ten minutes at rest; then with the valve's cable moved away",
        recipe=effect.Recipe(parts=(effect.PartName.REST, effect.PartName.DWELLS)),
        treatments=(effect.Treatment(why_not=_SINGLE_READINGS),),
        forms=(),
        direct=True,
        marks=(OUTLIER_SHARE, OUTLIER),
    ),
    entry(
        name="sensor-quantisation",
        number=41,
        what="the amplifier's counts are coarse",
        signature="readings lie on a lattice coarser than the noise",
        excitation="any",
        experiment="read the amplifier's resolution setting",
        recipe=effect.Recipe(parts=(effect.PartName.REST, effect.PartName.RAMPS)),
        treatments=(effect.Treatment(why_not="what is between two counts is lost"),),
        forms=(),
        direct=True,
        marks=(QUANTUM,),
    ),
    entry(
        name="valve-crosstalk",
        number=42,
        what="the command's voltage couples into the force reading",
        signature="the reading jumps with the command, before any air has moved",
        excitation="steps of the command at 100 rows a second or more",
        experiment="steps of the command with the air shut off",
        recipe=effect.Recipe(
            parts=(effect.PartName.STEPS,),
            meanwhile="shut the air off and vent the line before; what moves then is no force",
            check=False,
        ),
        treatments=(effect.Treatment(by=effect.By.CELL),),
        forms=(
            effect.EffectForm(
                parameters=(CROSSTALK,), probes=effect.fixed_starts((0.02,)), needs=("command_v",), proportional=True
            ),
        ),
    ),
    entry(
        name="sign-loss",
        number=43,
        what="the sign of negative readings is lost",
        signature="readings that should be negative are mirrored",
        excitation="forces below zero",
        experiment="pull at the load cell by hand",
        recipe=effect.Recipe(
            parts=(effect.PartName.TOUCHES,),
            apart="pull at the load cell by hand, with the output off: the reading must become negative",
        ),
        treatments=(
            effect.Treatment(
                why_not="a lost sign cannot be brought back: check the amplifier's settings", fields=("cell.sign_lost",)
            ),
        ),
        forms=(
            effect.EffectForm(
                parameters=(SIGN_LOST, ZERO),
                probes=effect.fixed_starts((1.0, 0.0), (1.0, -0.3), (1.0, -1.0)),
                exact=True,
                like_a_held_start=True,
            ),
        ),
        group=("backlash",),
    ),
)
