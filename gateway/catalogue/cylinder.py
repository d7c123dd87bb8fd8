"""Effects of the slide that turns pressure into thrust: friction in all its forms."""

from typing import Final

from gateway.catalogue.effect import (
    PRESSURE,
    By,
    Effect,
    EffectForm,
    Parameter,
    PartName,
    Recipe,
    Treatment,
    fixed_starts,
)
from gateway.catalogue.regulator import SLOW_LAGS

AREA: Final = Parameter("cylinder", "area_m2", "m2", 1.0e-4, 1.0e-7, 1.0, 2.0e-6)
COULOMB: Final = Parameter("friction", "coulomb_n", "N", 0.0, 0.0, 200.0, 0.05)
STRIBECK: Final = Parameter("friction", "stribeck_n", "N", 0.0, 0.0, 100.0, 0.1)
STRIBECK_SPEED: Final = Parameter("friction", "stribeck_speed_m_per_s", "m/s", 0.01, 1.0e-5, 1.0, 1.0e-4, shape=True)
VISCOUS: Final = Parameter("friction", "viscous_n_s_per_m", "N s/m", 0.0, 0.0, 1.0e5, 20.0)
PRESLIDING: Final = Parameter("friction", "presliding_m", "m", 0.0, 0.0, 5.0e-3, 5.0e-6)
LOAD: Final = Parameter("friction", "load_dependent_n_per_n", "N/N", 0.0, 0.0, 0.9, 0.003)
ASYMMETRY: Final = Parameter("friction", "asymmetry_n", "N", 0.0, -50.0, 50.0, 0.05)
DRAG_ASYMMETRY: Final = Parameter("friction", "asymmetry_n_s_per_m", "N s/m", 0.0, -1.0e5, 1.0e5, 20.0)
STICTION: Final = Parameter("friction", "dwell_stiction_n", "N", 0.0, 0.0, 50.0, 0.1)
STICTION_TIME: Final = Parameter("friction", "dwell_stiction_s", "s", 5.0, 0.8, 100.0, 0.2, shape=True)
STICTION_TIME_SHORT: Final = Parameter("friction", "dwell_stiction_s", "s", 5.0, 0.02, 0.8, 0.01, shape=True)
SIDE_FEED: Final = Parameter("friction", "side_load_n_s_per_mm", "N s/mm", 0.0, 0.0, 20.0, 0.005)
SIDE_FORCE: Final = Parameter("friction", "side_load_n_per_n", "N/N", 0.0, 0.0, 0.9, 0.003)
SIDE_TILT: Final = Parameter("friction", "side_load_tilt_n", "N", 0.0, 0.0, 100.0, 0.1)
SIDE_POSITION: Final = Parameter("friction", "side_load_n_per_mm", "N/mm", 0.0, 0.0, 20.0, 0.002)

LEAST_DRAG: Final = 25.0
"""N s/m: 1 N at 40 mm/s; less is no finding."""
LEAST_PRESLIDING_M: Final = 3.0e-6
"""Less is part of every seal, and within one step of the fit."""

_ONE_SPEED: Final = ("coulomb-friction", "viscous-friction", "presliding")
_AT_THREE_SPEEDS: Final = Recipe(parts=(PartName.RAMPS, PartName.STROKES), columns=PRESSURE)
_LOOPS: Final = Recipe(parts=(PartName.REVERSALS, PartName.STROKES))
_SPEED: Final = "it depends on the slide's speed, which nobody measures"
_BOTH_WAYS: Final = "the force goes up and down over the whole range, several times"

CYLINDER: Final = (
    Effect(
        name="coulomb-friction",
        number=12,
        family="cylinder",
        what="dry friction of seals and guide, the same at any speed and load",
        signature="a loop of constant width",
        excitation=_BOTH_WAYS,
        experiment="the same strokes at three speeds (10, 40 and 150 mm/s, or ramps of 0.1, 0.5 and 2 V/s), pressure recorded",
        recipe=_AT_THREE_SPEEDS,
        treatments=(Treatment(by=By.MODEL),),
        forms=(EffectForm(parameters=(COULOMB,), probes=fixed_starts((0.3,), (1.0,))),),
        group=("regulator-hysteresis", "backlash", "asymmetric-friction", *_ONE_SPEED),
    ),
    Effect(
        name="stribeck-friction",
        number=13,
        family="cylinder",
        what="friction that falls when the slide begins to move fast",
        signature="a jump after each rest, larger at slow ramps",
        excitation="motions at slow and fast speed, and reversals",
        experiment="ramps of 0.05, 0.5 and 5 V/s up and down",
        recipe=Recipe(parts=(PartName.RAMPS, PartName.RESTS)),
        treatments=(Treatment(why_not=_SPEED, fields=("friction.stribeck_n", "friction.stribeck_speed_m_per_s")),),
        forms=(
            EffectForm(
                parameters=(STRIBECK, STRIBECK_SPEED), probes=fixed_starts((0.3, 1.0e-4), (0.3, 1.0e-3), (0.3, 6.0e-3))
            ),
            EffectForm(
                parameters=(STICTION, STICTION_TIME_SHORT), probes=fixed_starts((0.15, 0.1), (0.15, 0.3))
            ),  # of a slide that sticks and slips
        ),
        group=("coulomb-friction", "dwell-stiction"),
    ),
    Effect(
        name="viscous-friction",
        number=14,
        family="cylinder",
        what="friction in proportion to speed",
        signature="the loop widens with speed; on a stiff workpiece it looks like a lag",
        excitation="motions at several speeds",
        experiment="strokes at three speeds with position_mm recorded",
        recipe=_AT_THREE_SPEEDS,
        treatments=(Treatment(why_not=_SPEED),),
        least=LEAST_DRAG,
        forms=(EffectForm(parameters=(VISCOUS,), probes=fixed_starts((50.0,), (500.0,))),),
        group=tuple(dict.fromkeys((*SLOW_LAGS, *_ONE_SPEED))),
    ),
    Effect(
        name="presliding",
        number=15,
        family="cylinder",
        what="seals give way elastically before they slide",
        signature="rounded corners of the loop at each reversal",
        excitation="many reversals, small ones too",
        experiment="a ladder with minor loops: reversals of 0.1, 0.3 and 1 V around three levels",
        recipe=_LOOPS,
        treatments=(Treatment(by=By.MODEL),),
        least=LEAST_PRESLIDING_M,
        forms=(EffectForm(parameters=(PRESLIDING,), probes=fixed_starts((3.0e-5,), (1.0e-4,), (4.0e-4,))),),
        group=_ONE_SPEED,
    ),
    Effect(
        name="load-dependent-friction",
        number=16,
        family="cylinder",
        what="friction that grows with the pressure behind the seals",
        signature="the loop widens with the force",
        excitation=_BOTH_WAYS,
        experiment="reversals of 1 V around 1, 3 and 5 V",
        recipe=_LOOPS,
        treatments=(Treatment(by=By.MODEL),),
        forms=(
            EffectForm(
                parameters=(LOAD,),
                probes=fixed_starts((0.003,), (0.02,)),
            ),
        ),
    ),
    Effect(
        name="asymmetric-friction",
        number=17,
        family="cylinder",
        what="friction that differs between the two directions",
        signature="rising and falling branch are not the same distance from the middle",
        excitation="full reversals and partial ones that end inside the loop",
        experiment="reversals of 0.1 and 1 V around three levels",
        recipe=_LOOPS,
        treatments=(
            Treatment(by=By.MODEL, fields=("friction.asymmetry_n",)),
            Treatment(why_not=_SPEED, fields=("friction.asymmetry_n_s_per_m",)),
        ),
        forms=(
            EffectForm(parameters=(ASYMMETRY,), probes=fixed_starts((0.2,)), proportional=True),
            EffectForm(
                parameters=(DRAG_ASYMMETRY,),
                probes=fixed_starts((40.0,), (-40.0,), (300.0,), (-300.0,)),
                least=LEAST_DRAG,
            ),
        ),
        group=("coulomb-friction", "viscous-friction"),
        rarity=10.0,
    ),
    Effect(
        name="dwell-stiction",
        number=18,
        family="cylinder",
        what="friction that grows while the slide rests",
        signature="a peak at the first motion after a rest, larger after a longer one",
        excitation="rests of different length, 0.5 to 20 s, each followed by a slow ramp",
        experiment="at one level: rests of 1, 3, 10 and 30 s, each followed by a ramp of 0.2 V/s",
        recipe=Recipe(parts=(PartName.RESTS,)),
        treatments=(Treatment(why_not="the model has no memory of how long the slide has rested"),),
        forms=(EffectForm(parameters=(STICTION, STICTION_TIME), probes=fixed_starts((0.3, 1.0), (0.3, 5.0))),),
        group=("stribeck-friction",),
    ),
)
SIDE_LOAD: Final = Effect(
    name="side-load",
    number=22,
    family="contact and tool",
    what="a force across the slide raises its friction",
    signature="the loop widens with feed, tilt or position",
    excitation="reversals of the force at different feed, tilt or position, with that column recorded",
    experiment="reversals of 1 V at rest and at two feeds, with feed_mm_s recorded",
    recipe=Recipe(
        parts=(PartName.REVERSALS,),
        columns=("feed_mm_s", "tilt_deg"),
        meanwhile="let the robot feed at two speeds, and stand, for some seconds each",
    ),
    treatments=(Treatment(why_not="the model's loop has one width, whatever presses from the side"),),
    forms=(
        EffectForm(parameters=(SIDE_FEED,), probes=fixed_starts((0.003,), (0.02,)), needs=("feed_mm_s",)),
        EffectForm(parameters=(SIDE_FORCE,), probes=fixed_starts((0.003,), (0.02,)), needs=("feed_mm_s",)),
        EffectForm(parameters=(SIDE_TILT,), probes=fixed_starts((0.05,), (0.4,)), needs=("tilt_deg",)),
        EffectForm(parameters=(SIDE_POSITION,), probes=fixed_starts((0.002,), (0.02,)), needs=("position_mm",)),
    ),
    group=("load-dependent-friction",),
)
