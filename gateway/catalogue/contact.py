"""Effects of the contact: pad, mount and workpiece."""

from functools import partial
from typing import Final

from gateway.catalogue import effect, shared
from gateway.defaults import PAD_STIFFNESS_N_PER_M, UNLIMITED

entry = partial(effect.Effect, family="contact and tool")

CREEP: Final = effect.Parameter("contact", "creep_share", "1", 0.0, -1.0, 1.0, 0.002)
CREEP_TIME: Final = effect.Parameter("contact", "creep_s", "s", 10.0, 0.3, 1.0e4, 0.2, shape=True)
HARDENING: Final = effect.Parameter("contact", "hardening", "1", 0.0, -1.0, 1.0, 0.002)
STROKE: Final = effect.Parameter("cylinder", "stroke_m", "m", UNLIMITED, 1.0e-6, UNLIMITED, 2.0e-6)
STOP_STIFFNESS: Final = effect.Parameter("contact", "stop_stiffness_n_per_mm", "N/mm", 0.0, 0.0, 1.0e3, 0.02)
STOP: Final = effect.Parameter("contact", "stop_mm", "mm", UNLIMITED, -1.0e4, UNLIMITED, 0.02, shape=True)
WEAR: Final = effect.Parameter("contact", "wear_per_m", "1/m", 0.0, -1.0, 1.0, 1.0e-4)
WEAR_N: Final = effect.Parameter("contact", "wear_n_per_m", "N/m", 0.0, -100.0, 100.0, 1.0e-3)
LOST: Final = effect.Parameter("contact", "lost_n", "N", 0.0, 0.0, 100.0, 0.05)


def _stroke(hints: effect.SearchHints) -> tuple[effect.Start, ...]:
    """Travel at which the pad carries a force that was nearly reached; the pad's stiffness is the default plant's."""
    return tuple(
        (force_n / PAD_STIFFNESS_N_PER_M - STROKE.null,) for force_n in shared.limits(hints.forces_n) if force_n > 1.0
    )


def _stop(hints: effect.SearchHints) -> tuple[effect.Start, ...]:
    return tuple((0.5, position_mm) for position_mm in hints.positions_mm)


CONTACT: Final = (
    entry(
        name="creep",
        number=19,
        what="pad or cell body give way slowly under load",
        signature="after each step the force goes on a little for seconds",
        excitation="dwells of many seconds at different levels, with returns to the first",
        experiment="hold 30 s at high force, 30 s at low force, three times",
        recipe=effect.Recipe(parts=(effect.PartName.DWELLS, effect.PartName.CYCLES)),
        treatments=(effect.Treatment(why_not=shared.TRIM),),
        forms=(
            effect.EffectForm(
                parameters=(CREEP, CREEP_TIME),
                probes=effect.fixed_starts((0.02, 1.0), (0.02, 3.0), (0.02, 10.0), (0.02, 40.0)),
                proportional=True,
            ),
        ),
        group=shared.MONOTONE,
    ),
    entry(
        name="contact-nonlinearity",
        number=20,
        what="the contact passes the force on along a bent line",
        signature="the residual bends with the force",
        excitation="levels over the whole range",
        experiment="dead weights on the load cell: they tell a bent cell from a bent contact",
        recipe=shared.DEAD_WEIGHTS,
        treatments=(effect.Treatment(by=effect.By.MODEL),),
        forms=(effect.EffectForm(parameters=(HARDENING,), probes=effect.fixed_starts((0.01,)), proportional=True),),
        group=shared.LIMITS,
    ),
    entry(
        name="end-stop",
        number=21,
        what="the slide reaches its end stop, which takes the rest of the thrust",
        signature="the force stops rising at one travel",
        excitation="forces, or positions, beyond the stop",
        experiment="a staircase to full force with position_mm recorded, at two distances of the workpiece",
        recipe=effect.Recipe(
            parts=(effect.PartName.STAIRCASE,),
            columns=("position_mm",),
            apart="run the plan again with the workpiece 1 mm nearer: a stop then takes another share",
        ),
        treatments=(effect.Treatment(why_not="beyond it the slide carries no more force: mount the tool nearer"),),
        forms=(
            effect.EffectForm(parameters=(STROKE,), probes=_stroke),
            effect.EffectForm(
                parameters=(STOP_STIFFNESS, STOP), probes=_stop, needs=("position_mm",), proportional=True
            ),
        ),
        group=shared.LIMITS,
        rarity=4.0,  # a soft one that stands before the first position is a slope along the way
    ),
    entry(
        name="pad-wear",
        number=26,
        what="the pad wears along the way that it has ground",
        signature="the force falls with distance_m",
        excitation="a long way under force, with rests between, recorded as distance_m",
        experiment="three passes with rests of a minute between them, with distance_m and temperature_c recorded",
        recipe=effect.Recipe(
            parts=(effect.PartName.CYCLES,),
            columns=("temperature_c",),
            apart="note distance_m: wear follows the way that was ground, drift follows time and goes on at rest",
        ),
        treatments=(effect.Treatment(why_not=shared.TRIM),),
        forms=(
            effect.EffectForm(
                parameters=(WEAR,), probes=effect.fixed_starts((0.01,)), needs=("distance_m",), proportional=True
            ),
            effect.EffectForm(
                parameters=(WEAR_N,), probes=effect.fixed_starts((0.01,)), needs=("distance_m",), proportional=True
            ),
        ),
        group=shared.MONOTONE,
    ),
    entry(
        name="backlash",
        number=29,
        what="play in mount or guide that must close before force passes (lost at each reversal, it widens the loop)",
        signature="no force until the thrust has closed the gap",
        excitation="returns to no force, from different sizes",
        experiment="reversals of 0.05 to 1 V around three levels with position_mm recorded",
        recipe=effect.Recipe(parts=(effect.PartName.TOUCHES, effect.PartName.REVERSALS)),
        treatments=(effect.Treatment(by=effect.By.MODEL, fields=("contact.backlash_n", "contact.lost_n")),),
        forms=(
            effect.EffectForm(parameters=(LOST,), probes=effect.fixed_starts((0.5,), (2.0,)), like_a_held_start=True),
        ),  # the other play is friction's: one cannot tell
        group=("sign-loss", "asymmetric-friction"),
        rarity=4.0,
    ),
)
