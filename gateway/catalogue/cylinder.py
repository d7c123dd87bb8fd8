"""Effects of the slide that turns pressure into thrust: friction in all its forms."""

from functools import partial
from typing import Final

from gateway.catalogue import effect, shared

entry = partial(effect.Effect, family="cylinder")

AREA: Final = effect.Parameter("cylinder", "area_m2", "m2", 1.0e-4, 1.0e-7, 1.0, 2.0e-6)
COULOMB: Final = effect.Parameter("friction", "coulomb_n", "N", 0.0, 0.0, 200.0, 0.05)
STRIBECK: Final = effect.Parameter("friction", "stribeck_n", "N", 0.0, 0.0, 100.0, 0.1)
STRIBECK_SPEED: Final = effect.Parameter(
    "friction", "stribeck_speed_m_per_s", "m/s", 0.01, 1.0e-5, 1.0, 1.0e-4, shape=True
)
VISCOUS: Final = effect.Parameter("friction", "viscous_n_s_per_m", "N s/m", 0.0, 0.0, 1.0e5, 20.0)
PRESLIDING: Final = effect.Parameter("friction", "presliding_m", "m", 0.0, 0.0, 5.0e-3, 5.0e-6)
LOAD: Final = effect.Parameter("friction", "load_dependent_n_per_n", "N/N", 0.0, 0.0, 0.9, 0.003)
ASYMMETRY: Final = effect.Parameter("friction", "asymmetry_n", "N", 0.0, -50.0, 50.0, 0.05)
DRAG_ASYMMETRY: Final = effect.Parameter("friction", "asymmetry_n_s_per_m", "N s/m", 0.0, -1.0e5, 1.0e5, 20.0)
STICTION: Final = effect.Parameter("friction", "dwell_stiction_n", "N", 0.0, 0.0, 50.0, 0.1)
STICTION_TIME: Final = effect.Parameter("friction", "dwell_stiction_s", "s", 5.0, 0.8, 100.0, 0.2, shape=True)
PLACE: Final = effect.Parameter("friction", "place_n_per_mm", "N/mm", 0.0, -20.0, 20.0, 0.002)
PLACE_CURVE: Final = effect.Parameter("friction", "place_n_per_mm2", "N/mm2", 0.0, -20.0, 20.0, 1.0e-4)
PLACE_ASYMMETRY: Final = effect.Parameter("friction", "place_asymmetry_n_per_mm", "N/mm", 0.0, -20.0, 20.0, 0.002)
PLACE_ASYMMETRY_CURVE: Final = effect.Parameter(
    "friction", "place_asymmetry_n_per_mm2", "N/mm2", 0.0, -20.0, 20.0, 1.0e-4
)
CHAMBER_LAG: Final = effect.Parameter("cylinder", "chamber_lag_s", "s", 0.0, 0.0, 2.0, 0.002)
STICTION_TIME_SHORT: Final = effect.Parameter("friction", "dwell_stiction_s", "s", 5.0, 0.02, 0.8, 0.01, shape=True)

LEAST_DRAG: Final = 25.0
"""N s/m: 1 N at 40 mm/s; less is no finding."""
LEAST_PRESLIDING_M: Final = 3.0e-6
"""Less is part of every seal, and within one step of the fit."""

# where the search begins, for each parameter of a form; sizes that a small slide has
_COULOMB_STARTS: Final = ((0.3,), (1.0,))  # N: a light seal and a heavy one
_STRIBECK_STARTS: Final = ((0.3, 1.0e-4), (0.3, 1.0e-3), (0.3, 6.0e-3))  # N, m/s: from creeping to a fast stroke
_STICK_SLIP_STARTS: Final = ((0.15, 0.1), (0.15, 0.3))  # N, s: rests between two slips
_DRAG_STARTS: Final = ((50.0,), (500.0,))  # N s/m: 2 and 20 N at 40 mm/s
_PRESLIDING_STARTS: Final = ((3.0e-5,), (1.0e-4,), (4.0e-4,))  # m: a hard seal to a soft one
_LOAD_STARTS: Final = ((0.003,), (0.02,))  # N/N
_ASYMMETRY_STARTS: Final = ((0.2,),)  # N; the response is proportional
_DRAG_ASYMMETRY_STARTS: Final = ((40.0,), (-40.0,), (300.0,), (-300.0,))  # N s/m, either way
_STICTION_STARTS: Final = ((0.3, 1.0), (0.3, 5.0))  # N, s: short and long rests

_PLACE_STARTS: Final = ((0.01, 0.0), (0.0, 5.0e-4))  # N/mm, N/mm2: 0.2 N at the ends of a stroke of 40 mm
_PLACE_STARTS_BY_DIRECTION: Final = ((0.01, 0.0, 0.0, 0.0), (0.0, 5.0e-4, 0.0, 0.0), (0.0, 0.0, 0.01, 0.0))
_CHAMBER_LAG_STARTS: Final = ((0.005,), (0.02,), (0.06,))  # s: a short hose, a long one, a throttle

_ONE_SPEED: Final = ("coulomb-friction", "viscous-friction", "presliding")
_AT_THREE_SPEEDS: Final = effect.Recipe(parts=(effect.PartName.RAMPS, effect.PartName.STROKES), columns=effect.PRESSURE)
_LOOPS: Final = effect.Recipe(parts=(effect.PartName.REVERSALS, effect.PartName.STROKES))
_SPEED: Final = "it depends on the slide's speed, which nobody measures"
_BOTH_WAYS: Final = "the force goes up and down over the whole range, several times"

CYLINDER: Final = (
    entry(
        name="coulomb-friction",
        number=12,
        what="dry friction of seals and guide, the same at any speed and load",
        signature="a loop of constant width",
        excitation=_BOTH_WAYS,
        experiment="the same strokes at three speeds (10, 40 and 150 mm/s, or ramps of 0.1, 0.5 and 2 V/s), pressure recorded",
        recipe=_AT_THREE_SPEEDS,
        treatments=(effect.Treatment(by=effect.By.MODEL),),
        forms=(effect.EffectForm(parameters=(COULOMB,), probes=effect.fixed_starts(*_COULOMB_STARTS)),),
        group=("regulator-hysteresis", "backlash", "asymmetric-friction", *_ONE_SPEED),
    ),
    entry(
        name="stribeck-friction",
        number=13,
        what="friction that falls when the slide begins to move fast",
        signature="a jump after each rest, larger at slow ramps",
        excitation="motions at slow and fast speed, and reversals",
        experiment="ramps of 0.05, 0.5 and 5 V/s up and down",
        recipe=effect.Recipe(parts=(effect.PartName.RAMPS, effect.PartName.RESTS)),
        treatments=(
            effect.Treatment(why_not=_SPEED, fields=("friction.stribeck_n", "friction.stribeck_speed_m_per_s")),
        ),
        forms=(
            effect.EffectForm(
                parameters=(STRIBECK, STRIBECK_SPEED),
                probes=effect.fixed_starts(*_STRIBECK_STARTS),
            ),
            effect.EffectForm(
                parameters=(STICTION, STICTION_TIME_SHORT), probes=effect.fixed_starts(*_STICK_SLIP_STARTS)
            ),  # of a slide that sticks and slips
        ),
        group=("coulomb-friction", "dwell-stiction", "presliding"),
    ),
    entry(
        name="viscous-friction",
        number=14,
        what="friction in proportion to speed",
        signature="the loop widens with speed; on a stiff workpiece it looks like a lag",
        excitation="motions at several speeds",
        experiment="strokes at three speeds with position_mm recorded",
        recipe=_AT_THREE_SPEEDS,
        treatments=(effect.Treatment(why_not=_SPEED),),
        least=LEAST_DRAG,
        forms=(effect.EffectForm(parameters=(VISCOUS,), probes=effect.fixed_starts(*_DRAG_STARTS)),),
        group=tuple(dict.fromkeys((*shared.SLOW_LAGS, *_ONE_SPEED))),
    ),
    entry(
        name="presliding",
        number=15,
        what="seals give way elastically before they slide",
        signature="rounded corners of the loop at each reversal",
        excitation="many reversals, small ones too",
        experiment="a ladder with minor loops: reversals of 0.1, 0.3 and 1 V around three levels",
        recipe=_LOOPS,
        treatments=(effect.Treatment(by=effect.By.MODEL),),
        least=LEAST_PRESLIDING_M,
        forms=(effect.EffectForm(parameters=(PRESLIDING,), probes=effect.fixed_starts(*_PRESLIDING_STARTS)),),
        group=(*_ONE_SPEED, "stribeck-friction"),
    ),
    entry(
        name="load-dependent-friction",
        number=16,
        what="friction that grows with the pressure behind the seals",
        signature="the loop widens with the force",
        excitation=_BOTH_WAYS,
        experiment="reversals of 1 V around 1, 3 and 5 V",
        recipe=_LOOPS,
        treatments=(effect.Treatment(by=effect.By.MODEL),),
        forms=(
            effect.EffectForm(
                parameters=(LOAD,),
                probes=effect.fixed_starts(*_LOAD_STARTS),
            ),
        ),
    ),
    entry(
        name="asymmetric-friction",
        number=17,
        what="friction that differs between the two directions",
        signature="rising and falling branch are not the same distance from the middle",
        excitation="full reversals and partial ones that end inside the loop",
        experiment="reversals of 0.1 and 1 V around three levels",
        recipe=_LOOPS,
        treatments=(
            effect.Treatment(by=effect.By.MODEL, fields=("friction.asymmetry_n",)),
            effect.Treatment(why_not=_SPEED, fields=("friction.asymmetry_n_s_per_m",)),
        ),
        forms=(
            effect.EffectForm(
                parameters=(ASYMMETRY,), probes=effect.fixed_starts(*_ASYMMETRY_STARTS), proportional=True
            ),
            effect.EffectForm(
                parameters=(DRAG_ASYMMETRY,),
                probes=effect.fixed_starts(*_DRAG_ASYMMETRY_STARTS),
                least=LEAST_DRAG,
            ),
        ),
        group=("coulomb-friction", "viscous-friction"),
        rarity=10.0,
    ),
    entry(
        name="dwell-stiction",
        number=18,
        what="friction that grows while the slide rests",
        signature="a peak at the first motion after a rest, larger after a longer one",
        excitation="rests of different length, 0.5 to 20 s, each followed by a slow ramp",
        experiment="at one level: rests of 1, 3, 10 and 30 s, each followed by a ramp of 0.2 V/s",
        recipe=effect.Recipe(parts=(effect.PartName.RESTS,)),
        treatments=(effect.Treatment(why_not="the model has no memory of how long the slide has rested"),),
        forms=(effect.EffectForm(parameters=(STICTION, STICTION_TIME), probes=effect.fixed_starts(*_STICTION_STARTS)),),
        group=("stribeck-friction",),
    ),
    entry(
        name="position-dependent-friction",
        number=44,
        what="friction that depends on the place in the stroke: a worn, bent or badly greased tube",
        signature="the loop is wider at some places of the stroke than at others",
        excitation="strokes forth and back over the whole way, more than once, recorded as position_mm",
        experiment="slow strokes over the whole way, at two pressures and two speeds, with position_mm recorded",
        recipe=effect.Recipe(
            parts=(effect.PartName.REVERSALS,),
            columns=effect.PRESSURE,
            meanwhile="move the slide over its whole way, forth and back, at two speeds",
        ),
        treatments=(effect.Treatment(why_not="the command block carries no place in the stroke"),),
        forms=(
            effect.EffectForm(
                parameters=(PLACE, PLACE_CURVE),
                probes=effect.fixed_starts(*_PLACE_STARTS),
                needs=("position_mm",),
                proportional=True,
            ),
            effect.EffectForm(
                parameters=(PLACE, PLACE_CURVE, PLACE_ASYMMETRY, PLACE_ASYMMETRY_CURVE),
                probes=effect.fixed_starts(*_PLACE_STARTS_BY_DIRECTION),
                needs=("position_mm",),
                proportional=True,
            ),
        ),
        group=("position-dependence", "side-load"),
        rarity=6.0,
    ),
    entry(
        name="pressure-lag",
        number=45,
        what="the chamber's pressure comes later than the gauge's: a hose or a throttle between them",
        signature="fast changes of the pressure show in the force late and small",
        excitation="a measured pressure that changes fast, with the motion going on",
        experiment="steps of the pressure with the slide at rest, and strokes at one pressure: a lag shows in the first only",
        recipe=effect.Recipe(parts=(effect.PartName.STEPS, effect.PartName.STROKES), columns=effect.PRESSURE),
        treatments=(effect.Treatment(why_not="it is between the gauge and the slide, where control has no sensor"),),
        least=7.0e-4,
        forms=(
            effect.EffectForm(
                parameters=(CHAMBER_LAG,),
                probes=effect.fixed_starts(*_CHAMBER_LAG_STARTS),
                needs=effect.PRESSURE,
            ),
        ),
        group=shared.SLOW_LAGS,
    ),
)
