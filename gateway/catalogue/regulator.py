"""Effects of the electro-pneumatic regulator: command voltage in, pressure out."""

from functools import partial
from typing import Final

from gateway.catalogue import effect, shared
from gateway.defaults import UNLIMITED

entry = partial(effect.Effect, family="regulator")

DELAY: Final = effect.Parameter("regulator", "delay_s", "s", 0.0, 0.0, 1.0, 0.001)
LAG: Final = effect.Parameter("regulator", "lag_s", "s", 0.0, 0.0, 2.0, 0.002)
SECOND_LAG: Final = effect.Parameter("regulator", "second_lag_s", "s", 0.0, 0.0, 2.0, 0.002)
DEAD_BAND: Final = effect.Parameter("regulator", "dead_band_pa", "Pa", 0.0, 0.0, 2.0e5, 100.0)
HYSTERESIS: Final = effect.Parameter("regulator", "hysteresis_pa", "Pa", 0.0, 0.0, 2.0e5, 200.0)
COMMAND_STEP: Final = effect.Parameter("regulator", "command_step_v", "V", 0.0, 0.0, 2.0, 0.0001)
BOW: Final = effect.Parameter("regulator", "command_bow", "1", 0.0, -0.25, 0.25, 0.002)
S_SHAPE: Final = effect.Parameter("regulator", "command_s", "1", 0.0, -0.12, 0.12, 0.002)
SUPPLY: Final = effect.Parameter("regulator", "supply_pa", "Pa", UNLIMITED, 1.0e4, UNLIMITED, 1000.0)
CEILING: Final = effect.Parameter("regulator", "ceiling_pa", "Pa", UNLIMITED, 1.0e4, UNLIMITED, 1000.0)
DROOP: Final = effect.Parameter("regulator", "droop_pa_per_pa", "Pa/Pa", 0.0, -2.0, 2.0, 0.01)
DROOP_SHARE: Final = effect.Parameter("regulator", "droop_share_per_pa", "1/Pa", 0.0, -2.0e-5, 2.0e-5, 1.0e-8)
LEAK: Final = effect.Parameter("regulator", "leak_per_s", "1/s", 0.0, 0.0, 1.0, 0.001)
LEAK_FLOW: Final = effect.Parameter("regulator", "leak_flow_pa", "Pa", 0.0, 0.0, 5.0e5, 500.0)
HUNTING: Final = effect.Parameter("regulator", "hunting_pa", "Pa", 0.0, 0.0, 1.0e5, 300.0)
HUNTING_HZ: Final = effect.Parameter("regulator", "hunting_hz", "Hz", 5.0, 0.1, 40.0, 0.001, shape=True)
HUNTING_PHASE: Final = effect.Parameter("regulator", "hunting_phase_rad", "rad", 0.0, -10.0, 10.0, 0.02, shape=True)
SLEW: Final = effect.Parameter("regulator", "slew_pa_per_s", "Pa/s", UNLIMITED, 1.0e4, UNLIMITED, 1.0e4)

_STEPS_RECIPE: Final = effect.Recipe(parts=(effect.PartName.STEPS,), columns=effect.PRESSURE)
_STAIRS_AND_STEPS: Final = effect.Recipe(
    parts=(effect.PartName.STAIRCASE, effect.PartName.STEPS), columns=effect.PRESSURE
)
_TRANSIENTS: Final = "steps or ramps of the command, several times its lag apart, at 100 rows a second or more"
_SLOW_STEPS: Final = "a slow staircase up and down over the whole range with small steps"


def _supply(hints: effect.SearchHints) -> tuple[effect.Start, ...]:
    """A fall from UNLIMITED to just below the pressures that were reached."""
    return tuple((limit_pa - SUPPLY.null,) for limit_pa in shared.limits(hints.pressures_pa) if limit_pa > 2.0e4)


def _slew(hints: effect.SearchHints) -> tuple[effect.Start, ...]:
    fastest = max(hints.pressure_rate_pa_per_s, 1.0e4)
    return tuple((share * fastest - SLEW.null,) for share in (0.1, 0.2, 0.35, 0.5, 0.7, 0.85, 1.0, 1.2))


def _steps(hints: effect.SearchHints) -> tuple[effect.Start, ...]:
    return tuple((step_v,) for step_v in hints.command_steps_v)


def _dead_band(hints: effect.SearchHints) -> tuple[effect.Start, ...]:
    return tuple((band_pa,) for band_pa in hints.dead_bands_pa)


def _hunting(hints: effect.SearchHints) -> tuple[effect.Start, ...]:
    return tuple((1.0e3, line_hz, 0.0) for line_hz in hints.lines_hz if 0.7 <= line_hz <= 40.0)


REGULATOR: Final = (
    entry(
        name="transport-delay",
        number=1,
        what="time before the pressure begins to follow the command",
        signature="the whole response comes late; the residual follows the slope of the force",
        excitation=_TRANSIENTS,
        experiment="steps of the command with pressure_kpa recorded: a delay shows in both, a clock offset in one",
        recipe=_STEPS_RECIPE,
        treatments=(effect.Treatment(by=effect.By.TIMING),),
        least=7.0e-4,
        forms=(effect.EffectForm(parameters=(DELAY,), probes=effect.fixed_starts((0.004,), (0.02,), (0.06,))),),
        group=shared.SLOW_LAGS,
    ),
    entry(
        name="extra-lag",
        number=2,
        what="a second first-order lag behind the regulator's own",
        signature="steps begin softly and then follow; the residual follows the curvature of the force",
        excitation=_TRANSIENTS,
        experiment="steps of the command with the pressure recorded, 200 rows a second or more",
        recipe=_STEPS_RECIPE,
        treatments=(
            effect.Treatment(
                by=effect.By.TIMING, fields=("regulator.lag_s", "regulator.second_lag_s", "cell.filter_s")
            ),
        ),
        least=7.0e-4,
        forms=(effect.EffectForm(parameters=(SECOND_LAG,), probes=effect.fixed_starts((0.005,), (0.02,), (0.06,))),),
        group=shared.SLOW_LAGS,
    ),
    entry(
        name="dead-band",
        number=3,
        what="changes of the command below a threshold are not followed",
        signature="the force stands still while the command creeps, then jumps",
        excitation="steps of the command smaller than the dead band, up and down",
        experiment="a staircase of 0.01 V steps up and down around three levels",
        recipe=effect.Recipe(parts=(effect.PartName.FINE,), columns=effect.PRESSURE),
        treatments=(effect.Treatment(why_not="changes of the command within it are not heard, whatever they are"),),
        forms=(effect.EffectForm(parameters=(DEAD_BAND,), probes=_dead_band, exact=True),),
        group=("regulator-hysteresis", "command-quantisation"),
    ),
    entry(
        name="regulator-hysteresis",
        number=4,
        what="the pressure depends on the direction from which the command came",
        signature="a loop of constant width between command and pressure",
        excitation=_SLOW_STEPS,
        experiment="a staircase up and down with the pressure recorded: the loop stands between command and pressure",
        recipe=effect.Recipe(parts=(effect.PartName.STAIRCASE, effect.PartName.FINE), columns=effect.PRESSURE),
        treatments=(effect.Treatment(by=effect.By.MODEL),),
        forms=(
            effect.EffectForm(
                parameters=(HYSTERESIS,), probes=effect.fixed_starts((600.0,), (3.0e3,), (1.0e4,), (3.0e4,))
            ),
        ),
        group=("coulomb-friction",),
    ),
    entry(
        name="command-quantisation",
        number=5,
        what="the command input has coarse steps",
        signature="the force is a staircase of a ramp; the residual is a saw tooth of the command",
        excitation="ramps or many different levels of the command",
        experiment="a ramp of 0.05 V/s over two volts",
        recipe=effect.Recipe(parts=(effect.PartName.SLOW_RAMP,)),
        treatments=(effect.Treatment(why_not="nothing between two steps can be sent"),),
        forms=(effect.EffectForm(parameters=(COMMAND_STEP,), probes=_steps, exact=True, everywhere=True),),
        group=("dead-band",),
    ),
    entry(
        name="command-nonlinearity",
        number=6,
        what="the pressure is no straight line of the command",
        signature="the residual bends with the command, before lag and friction",
        excitation="levels over the whole range",
        experiment="a slow staircase over the whole range with the pressure recorded",
        recipe=_STAIRS_AND_STEPS,
        treatments=(effect.Treatment(by=effect.By.COMMAND),),
        forms=(
            effect.EffectForm(parameters=(BOW,), probes=effect.fixed_starts((0.01,)), proportional=True),
            effect.EffectForm(parameters=(S_SHAPE,), probes=effect.fixed_starts((0.01,)), proportional=True),
        ),
        group=shared.LIMITS,
    ),
    entry(
        name="supply-saturation",
        number=7,
        what="the air line cannot give more pressure",
        signature="the force stops rising above one level, whatever the command",
        excitation="commands above the supply pressure",
        experiment="a staircase to full scale with supply_kpa or pressure_kpa recorded",
        recipe=_STAIRS_AND_STEPS,
        treatments=(effect.Treatment(why_not="the air line has no more pressure"),),
        forms=(
            effect.EffectForm(parameters=(SUPPLY,), probes=_supply),
            effect.EffectForm(parameters=(CEILING,), probes=_supply),
        ),
        group=shared.LIMITS,
    ),
    entry(
        name="supply-droop",
        number=8,
        what="the pressure follows swings of the supply",
        signature="the residual follows supply_kpa",
        excitation="a supply that swings, recorded as supply_kpa",
        experiment="hold three levels while another consumer draws air from the same line, with supply_kpa recorded",
        recipe=effect.Recipe(
            parts=(effect.PartName.THREE_LEVELS,),
            meanwhile="let another consumer on the same air line switch on and off every few seconds",
        ),
        treatments=(
            effect.Treatment(
                why_not=f"the supply pressure is not told to the controller; {shared.TRIM}",
                fields=("regulator.droop_pa_per_pa", "regulator.droop_share_per_pa", "regulator.droop_reference_pa"),
            ),
        ),
        forms=(
            effect.EffectForm(
                parameters=(DROOP,), probes=effect.fixed_starts((0.02,)), needs=("supply_kpa",), proportional=True
            ),
            effect.EffectForm(
                parameters=(DROOP_SHARE,),
                probes=effect.fixed_starts((1.0e-7,)),
                needs=("supply_kpa",),
                proportional=True,
            ),
        ),
    ),
    entry(
        name="leak",
        number=9,
        what="air escapes between valve and cylinder",
        signature="the force falls while the command stands still, or misses most just above zero pressure",
        excitation="dwells of several seconds at several levels, steps up and down",
        experiment="hold three levels for 10 s each, then steps up and down between them",
        recipe=effect.Recipe(parts=(effect.PartName.DWELLS, effect.PartName.STEPS), columns=effect.PRESSURE),
        treatments=(
            effect.Treatment(
                why_not=shared.TRIM,
                fields=("regulator.leak_per_s", "regulator.leak_flow_pa", "regulator.fill_slowdown"),
            ),
        ),
        forms=(
            effect.EffectForm(parameters=(LEAK,), probes=effect.fixed_starts((0.003,), (0.03,))),
            effect.EffectForm(parameters=(LEAK_FLOW,), probes=effect.fixed_starts((5.0e3,)), proportional=True),
        ),
        group=(*shared.LIMITS, "warm-up"),
        rarity=2.0,
    ),
    entry(
        name="regulator-hunting",
        number=10,
        what="the regulator's own loop oscillates",
        signature="a line in the spectrum below 40 Hz while there is pressure",
        excitation="dwells under pressure, sampled at more than twice the line",
        experiment="hold three levels for 10 s each at 200 rows a second, spindle off",
        recipe=effect.Recipe(parts=(effect.PartName.REST, effect.PartName.DWELLS), columns=effect.PRESSURE),
        treatments=(effect.Treatment(why_not=shared.TOO_FAST),),
        forms=(
            effect.EffectForm(
                parameters=(HUNTING, HUNTING_HZ, HUNTING_PHASE), probes=_hunting, proportional=True, quadrature=True
            ),
        ),
        group=("mains-hum", "spindle-vibration"),
    ),
    entry(
        name="slew-limit",
        number=11,
        what="the pressure has a fastest rate of change",
        signature="large steps are ramps, small ones are not",
        excitation="steps of different sizes",
        experiment="steps of 0.5, 1, 2 and 4 V up and down",
        recipe=_STEPS_RECIPE,
        treatments=(effect.Treatment(why_not="the regulator cannot be faster than it is"),),
        forms=(effect.EffectForm(parameters=(SLEW,), probes=_slew),),
        group=("leak",),
    ),
)
