"""Effects of the electro-pneumatic regulator: command voltage in, pressure out."""

from typing import Final

from gateway.catalogue.effect import (
    PRESSURE,
    By,
    Effect,
    EffectForm,
    Parameter,
    PartName,
    Recipe,
    SearchHints,
    Start,
    Treatment,
    fixed_starts,
)
from gateway.defaults import UNLIMITED

DELAY: Final = Parameter("regulator", "delay_s", "s", 0.0, 0.0, 1.0, 0.001)
LAG: Final = Parameter("regulator", "lag_s", "s", 0.0, 0.0, 2.0, 0.002)
SECOND_LAG: Final = Parameter("regulator", "second_lag_s", "s", 0.0, 0.0, 2.0, 0.002)
DEAD_BAND: Final = Parameter("regulator", "dead_band_pa", "Pa", 0.0, 0.0, 2.0e5, 100.0)
HYSTERESIS: Final = Parameter("regulator", "hysteresis_pa", "Pa", 0.0, 0.0, 2.0e5, 200.0)
COMMAND_STEP: Final = Parameter("regulator", "command_step_v", "V", 0.0, 0.0, 2.0, 0.0001)
BOW: Final = Parameter("regulator", "command_bow", "1", 0.0, -0.25, 0.25, 0.002)
S_SHAPE: Final = Parameter("regulator", "command_s", "1", 0.0, -0.12, 0.12, 0.002)
SUPPLY: Final = Parameter("regulator", "supply_pa", "Pa", UNLIMITED, 1.0e4, UNLIMITED, 1000.0)
CEILING: Final = Parameter("regulator", "ceiling_pa", "Pa", UNLIMITED, 1.0e4, UNLIMITED, 1000.0)
DROOP: Final = Parameter("regulator", "droop_pa_per_pa", "Pa/Pa", 0.0, -2.0, 2.0, 0.01)
DROOP_SHARE: Final = Parameter("regulator", "droop_share_per_pa", "1/Pa", 0.0, -2.0e-5, 2.0e-5, 1.0e-8)
LEAK: Final = Parameter("regulator", "leak_per_s", "1/s", 0.0, 0.0, 1.0, 0.001)
LEAK_FLOW: Final = Parameter("regulator", "leak_flow_pa", "Pa", 0.0, 0.0, 5.0e5, 500.0)
HUNTING: Final = Parameter("regulator", "hunting_pa", "Pa", 0.0, 0.0, 1.0e5, 300.0)
HUNTING_HZ: Final = Parameter("regulator", "hunting_hz", "Hz", 5.0, 0.1, 40.0, 0.001, shape=True)
HUNTING_PHASE: Final = Parameter("regulator", "hunting_phase_rad", "rad", 0.0, -10.0, 10.0, 0.02, shape=True)
SLEW: Final = Parameter("regulator", "slew_pa_per_s", "Pa/s", UNLIMITED, 1.0e4, UNLIMITED, 1.0e4)

NEAR: Final = (0.93, 0.96, 0.985)
SLOW_LAGS: Final = ("transport-delay", "clock-offset", "extra-lag", "viscous-friction")
LIMITS: Final = (
    "sensor-quadratic",
    "sensor-cubic",
    "supply-saturation",
    "contact-nonlinearity",
    "command-nonlinearity",
    "end-stop",
)
TRIM: Final = "the trim takes it back as the load cell sees it"
TOO_FAST: Final = "it is faster than the regulator's delay and lags let the force follow"
_STEPS_RECIPE: Final = Recipe(parts=(PartName.STEPS,), columns=PRESSURE)
_STAIRS_AND_STEPS: Final = Recipe(parts=(PartName.STAIRCASE, PartName.STEPS), columns=PRESSURE)
_TRANSIENTS: Final = "steps or ramps of the command, several times its lag apart, at 100 rows a second or more"
_SLOW_STEPS: Final = "a slow staircase up and down over the whole range with small steps"


def _supply(hints: SearchHints) -> tuple[Start, ...]:
    """A fall from UNLIMITED to just below the pressures that were reached."""
    return tuple((limit_pa - SUPPLY.null,) for limit_pa in limits(hints.pressures_pa) if limit_pa > 2.0e4)


def limits(reached: tuple[float, ...]) -> tuple[float, ...]:
    """Return where what was reached may have met a limit: below each quantile, and closely below the largest."""
    return tuple(0.97 * quantile for quantile in reached[1:-1]) + tuple(share * reached[-1] for share in NEAR)


def _slew(hints: SearchHints) -> tuple[Start, ...]:
    fastest = max(hints.pressure_rate_pa_per_s, 1.0e4)
    return tuple((share * fastest - SLEW.null,) for share in (0.1, 0.2, 0.35, 0.5, 0.7, 0.85, 1.0, 1.2))


def _steps(hints: SearchHints) -> tuple[Start, ...]:
    return tuple((step_v,) for step_v in hints.command_steps_v)


def _dead_band(hints: SearchHints) -> tuple[Start, ...]:
    return tuple((band_pa,) for band_pa in hints.dead_bands_pa)


def _hunting(hints: SearchHints) -> tuple[Start, ...]:
    return tuple((1.0e3, line_hz, 0.0) for line_hz in hints.lines_hz if 0.7 <= line_hz <= 40.0)


REGULATOR: Final = (
    Effect(
        name="transport-delay",
        number=1,
        family="regulator",
        what="time before the pressure begins to follow the command",
        signature="the whole response comes late; the residual follows the slope of the force",
        excitation=_TRANSIENTS,
        experiment="steps of the command with pressure_kpa recorded: a delay shows in both, a clock offset in one",
        recipe=_STEPS_RECIPE,
        treatments=(Treatment(by=By.TIMING),),
        least=7.0e-4,
        forms=(EffectForm(parameters=(DELAY,), probes=fixed_starts((0.004,), (0.02,), (0.06,))),),
        group=SLOW_LAGS,
    ),
    Effect(
        name="extra-lag",
        number=2,
        family="regulator",
        what="a second first-order lag behind the regulator's own",
        signature="steps begin softly and then follow; the residual follows the curvature of the force",
        excitation=_TRANSIENTS,
        experiment="steps of the command with the pressure recorded, 200 rows a second or more",
        recipe=_STEPS_RECIPE,
        treatments=(Treatment(by=By.TIMING, fields=("regulator.lag_s", "regulator.second_lag_s", "cell.filter_s")),),
        least=7.0e-4,
        forms=(EffectForm(parameters=(SECOND_LAG,), probes=fixed_starts((0.005,), (0.02,), (0.06,))),),
        group=SLOW_LAGS,
    ),
    Effect(
        name="dead-band",
        number=3,
        family="regulator",
        what="changes of the command below a threshold are not followed",
        signature="the force stands still while the command creeps, then jumps",
        excitation="steps of the command smaller than the dead band, up and down",
        experiment="a staircase of 0.01 V steps up and down around three levels",
        recipe=Recipe(parts=(PartName.FINE,), columns=PRESSURE),
        treatments=(Treatment(why_not="changes of the command within it are not heard, whatever they are"),),
        forms=(EffectForm(parameters=(DEAD_BAND,), probes=_dead_band, exact=True),),
        group=("regulator-hysteresis", "command-quantisation"),
    ),
    Effect(
        name="regulator-hysteresis",
        number=4,
        family="regulator",
        what="the pressure depends on the direction from which the command came",
        signature="a loop of constant width between command and pressure",
        excitation=_SLOW_STEPS,
        experiment="a staircase up and down with the pressure recorded: the loop stands between command and pressure",
        recipe=Recipe(parts=(PartName.STAIRCASE, PartName.FINE), columns=PRESSURE),
        treatments=(Treatment(by=By.MODEL),),
        forms=(EffectForm(parameters=(HYSTERESIS,), probes=fixed_starts((600.0,), (3.0e3,), (1.0e4,), (3.0e4,))),),
        group=("coulomb-friction",),
    ),
    Effect(
        name="command-quantisation",
        number=5,
        family="regulator",
        what="the command input has coarse steps",
        signature="the force is a staircase of a ramp; the residual is a saw tooth of the command",
        excitation="ramps or many different levels of the command",
        experiment="a ramp of 0.05 V/s over two volts",
        recipe=Recipe(parts=(PartName.SLOW_RAMP,)),
        treatments=(Treatment(why_not="nothing between two steps can be sent"),),
        forms=(EffectForm(parameters=(COMMAND_STEP,), probes=_steps, exact=True, everywhere=True),),
        group=("dead-band",),
    ),
    Effect(
        name="command-nonlinearity",
        number=6,
        family="regulator",
        what="the pressure is no straight line of the command",
        signature="the residual bends with the command, before lag and friction",
        excitation="levels over the whole range",
        experiment="a slow staircase over the whole range with the pressure recorded",
        recipe=_STAIRS_AND_STEPS,
        treatments=(Treatment(by=By.COMMAND),),
        forms=(
            EffectForm(parameters=(BOW,), probes=fixed_starts((0.01,)), proportional=True),
            EffectForm(parameters=(S_SHAPE,), probes=fixed_starts((0.01,)), proportional=True),
        ),
        group=LIMITS,
    ),
    Effect(
        name="supply-saturation",
        number=7,
        family="regulator",
        what="the air line cannot give more pressure",
        signature="the force stops rising above one level, whatever the command",
        excitation="commands above the supply pressure",
        experiment="a staircase to full scale with supply_kpa or pressure_kpa recorded",
        recipe=_STAIRS_AND_STEPS,
        treatments=(Treatment(why_not="the air line has no more pressure"),),
        forms=(EffectForm(parameters=(SUPPLY,), probes=_supply), EffectForm(parameters=(CEILING,), probes=_supply)),
        group=LIMITS,
    ),
    Effect(
        name="supply-droop",
        number=8,
        family="regulator",
        what="the pressure follows swings of the supply",
        signature="the residual follows supply_kpa",
        excitation="a supply that swings, recorded as supply_kpa",
        experiment="hold three levels while another consumer draws air from the same line, with supply_kpa recorded",
        recipe=Recipe(
            parts=(PartName.THREE_LEVELS,),
            meanwhile="let another consumer on the same air line switch on and off every few seconds",
        ),
        treatments=(
            Treatment(
                why_not=f"the supply pressure is not told to the controller; {TRIM}",
                fields=("regulator.droop_pa_per_pa", "regulator.droop_share_per_pa", "regulator.droop_reference_pa"),
            ),
        ),
        forms=(
            EffectForm(parameters=(DROOP,), probes=fixed_starts((0.02,)), needs=("supply_kpa",), proportional=True),
            EffectForm(
                parameters=(DROOP_SHARE,), probes=fixed_starts((1.0e-7,)), needs=("supply_kpa",), proportional=True
            ),
        ),
    ),
    Effect(
        name="leak",
        number=9,
        family="regulator",
        what="air escapes between valve and cylinder",
        signature="the force falls while the command stands still, or misses most just above zero pressure",
        excitation="dwells of several seconds at several levels, steps up and down",
        experiment="hold three levels for 10 s each, then steps up and down between them",
        recipe=Recipe(parts=(PartName.DWELLS, PartName.STEPS), columns=PRESSURE),
        treatments=(
            Treatment(
                why_not=TRIM, fields=("regulator.leak_per_s", "regulator.leak_flow_pa", "regulator.fill_slowdown")
            ),
        ),
        forms=(
            EffectForm(parameters=(LEAK,), probes=fixed_starts((0.003,), (0.03,))),
            EffectForm(parameters=(LEAK_FLOW,), probes=fixed_starts((5.0e3,)), proportional=True),
        ),
        group=LIMITS,
        rarity=2.0,
    ),
    Effect(
        name="regulator-hunting",
        number=10,
        family="regulator",
        what="the regulator's own loop oscillates",
        signature="a line in the spectrum below 40 Hz while there is pressure",
        excitation="dwells under pressure, sampled at more than twice the line",
        experiment="hold three levels for 10 s each at 200 rows a second, spindle off",
        recipe=Recipe(parts=(PartName.REST, PartName.DWELLS), columns=PRESSURE),
        treatments=(Treatment(why_not=TOO_FAST),),
        forms=(
            EffectForm(
                parameters=(HUNTING, HUNTING_HZ, HUNTING_PHASE), probes=_hunting, proportional=True, quadrature=True
            ),
        ),
        group=("mains-hum", "spindle-vibration"),
    ),
    Effect(
        name="slew-limit",
        number=11,
        family="regulator",
        what="the pressure has a fastest rate of change",
        signature="large steps are ramps, small ones are not",
        excitation="steps of different sizes",
        experiment="steps of 0.5, 1, 2 and 4 V up and down",
        recipe=_STEPS_RECIPE,
        treatments=(Treatment(why_not="the regulator cannot be faster than it is"),),
        forms=(EffectForm(parameters=(SLEW,), probes=_slew),),
        group=("leak",),
    ),
)
