"""Effects of pad, tool and workpiece."""

from typing import Final

from gateway.catalogue.cylinder import SIDE_LOAD
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
from gateway.catalogue.regulator import LIMITS, TOO_FAST, TRIM, limits
from gateway.defaults import PAD_STIFFNESS_N_PER_M, UNLIMITED

CREEP: Final = Parameter("contact", "creep_share", "1", 0.0, -1.0, 1.0, 0.002)
CREEP_TIME: Final = Parameter("contact", "creep_s", "s", 10.0, 0.3, 1.0e4, 0.2, shape=True)
HARDENING: Final = Parameter("contact", "hardening", "1", 0.0, -1.0, 1.0, 0.002)
STROKE: Final = Parameter("cylinder", "stroke_m", "m", UNLIMITED, 1.0e-6, UNLIMITED, 2.0e-6)
STOP_STIFFNESS: Final = Parameter("contact", "stop_stiffness_n_per_mm", "N/mm", 0.0, 0.0, 1.0e3, 0.02)
STOP: Final = Parameter("contact", "stop_mm", "mm", UNLIMITED, -1.0e4, UNLIMITED, 0.02, shape=True)
TILT: Final = Parameter("contact", "tilt_n", "N", 0.0, 0.0, 200.0, 0.1)
TILT_ZERO: Final = Parameter("contact", "tilt_zero_deg", "deg", 0.0, -400.0, 400.0, 0.5, shape=True)
FEED_DRAG: Final = Parameter("contact", "feed_drag_n_s_per_mm", "N s/mm", 0.0, -50.0, 50.0, 0.005)
FEED_DRAG_DRY: Final = Parameter("contact", "feed_drag_n", "N", 0.0, -50.0, 50.0, 0.05)
FEED_DRAG_ABS: Final = Parameter("contact", "feed_drag_abs_n_s_per_mm", "N s/mm", 0.0, -50.0, 50.0, 0.005)
SPINDLE: Final = Parameter("contact", "spindle_n", "N", 0.0, 0.0, 100.0, 0.05)
SPINDLE_PHASE: Final = Parameter("contact", "spindle_phase_rad", "rad", 0.0, -10.0, 10.0, 0.02, shape=True)
SPINDLE_SQUARE: Final = Parameter("contact", "spindle_n_per_krpm2", "N/krpm2", 0.0, 0.0, 100.0, 0.005)
WEAR: Final = Parameter("contact", "wear_per_m", "1/m", 0.0, -1.0, 1.0, 1.0e-4)
WEAR_N: Final = Parameter("contact", "wear_n_per_m", "N/m", 0.0, -100.0, 100.0, 1.0e-3)
SLOPE: Final = Parameter("contact", "position_n_per_mm", "N/mm", 0.0, -100.0, 100.0, 0.005)
CURVE: Final = Parameter("contact", "position_n_per_mm2", "N/mm2", 0.0, -100.0, 100.0, 2.0e-4)
RIPPLE: Final = Parameter("contact", "ripple_n", "N", 0.0, 0.0, 50.0, 0.05)
RIPPLE_PITCH: Final = Parameter("contact", "ripple_pitch_mm", "mm", 5.0, 0.05, 1.0e4, 0.002, shape=True)
RIPPLE_PHASE: Final = Parameter("contact", "ripple_phase_rad", "rad", 0.0, -10.0, 10.0, 0.02, shape=True)
LOST: Final = Parameter("contact", "lost_n", "N", 0.0, 0.0, 100.0, 0.05)

MONOTONE: Final = ("linear-drift", "pad-wear", "warm-up", "creep", "thermal-zero-drift")

DEAD_WEIGHTS: Final = Recipe(
    parts=(PartName.STAIRCASE,),
    columns=PRESSURE,
    apart="put dead weights on the load cell, seven levels up and down: a bent cell shows with them, a bent contact does not",
)
_WHOLE_WAY: Final = Recipe(
    parts=(PartName.LEVEL,), meanwhile="let the robot go the whole way forth and back at two speeds"
)
_NO_PLACE: Final = "the command block carries no place along the path; what is slow the trim takes back"


def _stroke(hints: SearchHints) -> tuple[Start, ...]:
    """Travel at which the pad carries a force that was nearly reached; the pad's stiffness is the default plant's."""
    return tuple(
        (force_n / PAD_STIFFNESS_N_PER_M - STROKE.null,) for force_n in limits(hints.forces_n) if force_n > 1.0
    )


def _stop(hints: SearchHints) -> tuple[Start, ...]:
    return tuple((0.5, position_mm) for position_mm in hints.positions_mm)


def _ripple(hints: SearchHints) -> tuple[Start, ...]:
    return tuple((0.1, pitch_mm, 0.0) for pitch_mm in hints.pitches_mm)


CONTACT: Final = (
    Effect(
        name="creep",
        number=19,
        family="contact and tool",
        what="pad or cell body give way slowly under load",
        signature="after each step the force goes on a little for seconds",
        excitation="dwells of many seconds at different levels, with returns to the first",
        experiment="hold 30 s at high force, 30 s at low force, three times",
        recipe=Recipe(parts=(PartName.DWELLS, PartName.CYCLES)),
        treatments=(Treatment(why_not=TRIM),),
        forms=(
            EffectForm(
                parameters=(CREEP, CREEP_TIME),
                probes=fixed_starts((0.02, 1.0), (0.02, 3.0), (0.02, 10.0), (0.02, 40.0)),
                proportional=True,
            ),
        ),
        group=MONOTONE,
    ),
    Effect(
        name="contact-nonlinearity",
        number=20,
        family="contact and tool",
        what="the contact passes the force on along a bent line",
        signature="the residual bends with the force",
        excitation="levels over the whole range",
        experiment="dead weights on the load cell: they tell a bent cell from a bent contact",
        recipe=DEAD_WEIGHTS,
        treatments=(Treatment(by=By.MODEL),),
        forms=(EffectForm(parameters=(HARDENING,), probes=fixed_starts((0.01,)), proportional=True),),
        group=LIMITS,
    ),
    Effect(
        name="end-stop",
        number=21,
        family="contact and tool",
        what="the slide reaches its end stop, which takes the rest of the thrust",
        signature="the force stops rising at one travel",
        excitation="forces, or positions, beyond the stop",
        experiment="a staircase to full force with position_mm recorded, at two distances of the workpiece",
        recipe=Recipe(
            parts=(PartName.STAIRCASE,),
            columns=("position_mm",),
            apart="run the plan again with the workpiece 1 mm nearer: a stop then takes another share",
        ),
        treatments=(Treatment(why_not="beyond it the slide carries no more force: mount the tool nearer"),),
        forms=(
            EffectForm(parameters=(STROKE,), probes=_stroke),
            EffectForm(parameters=(STOP_STIFFNESS, STOP), probes=_stop, needs=("position_mm",), proportional=True),
        ),
        group=LIMITS,
    ),
    SIDE_LOAD,
    Effect(
        name="tilt-gravity",
        number=23,
        family="contact and tool",
        what="the weight of the tool presses with the cosine of its tilt",
        signature="the residual is a cosine of tilt_deg",
        excitation="tilts over 20 degrees or more, recorded as tilt_deg",
        experiment="hold one force at 0, 45, 90 and 135 degrees, with tilt_deg recorded",
        recipe=Recipe(
            parts=(PartName.LEVEL,),
            meanwhile="turn the tool to 0, 45, 90 and 135 degrees, 10 s each, with its pad on a workpiece that turns along",
        ),
        treatments=(Treatment(by=By.OUTSIDE),),
        forms=(
            EffectForm(
                parameters=(TILT, TILT_ZERO),
                probes=fixed_starts((1.0, 0.0)),
                needs=("tilt_deg",),
                proportional=True,
                quadrature=True,
            ),
        ),
    ),
    Effect(
        name="feed-drag",
        number=24,
        family="contact and tool",
        what="moving along the workpiece drags the tool",
        signature="the residual follows feed_mm_s",
        excitation="feeds of both directions and different speeds, recorded as feed_mm_s",
        experiment="one force, feeds of 0, 5 and 15 mm/s in both directions, with feed_mm_s recorded",
        recipe=Recipe(parts=(PartName.LEVEL,), meanwhile="let the robot feed at 0, 5 and 15 mm/s in both directions"),
        treatments=(Treatment(by=By.OUTSIDE),),
        forms=(
            EffectForm(parameters=(FEED_DRAG,), probes=fixed_starts((0.02,)), needs=("feed_mm_s",), proportional=True),
            EffectForm(
                parameters=(FEED_DRAG_DRY,), probes=fixed_starts((0.2,)), needs=("feed_mm_s",), proportional=True
            ),
            EffectForm(
                parameters=(FEED_DRAG_ABS,), probes=fixed_starts((0.02,)), needs=("feed_mm_s",), proportional=True
            ),
        ),
    ),
    Effect(
        name="spindle-vibration",
        number=25,
        family="contact and tool",
        what="the turning spindle shakes the tool",
        signature="a line at the spindle's turning while it is on",
        excitation="spindle on and off, recorded as spindle_rpm",
        experiment="one force with the spindle off, at half and at full speed, 10 s each, with spindle_rpm recorded",
        recipe=Recipe(parts=(PartName.LEVEL,), meanwhile="run the spindle at nothing, half and full speed, 20 s each"),
        treatments=(
            Treatment(
                why_not=TOO_FAST,
                fields=(
                    "contact.spindle_n",
                    "contact.spindle_n_per_krpm2",
                    "contact.spindle_order",
                    "contact.spindle_phase_rad",
                ),
            ),
        ),
        forms=(
            EffectForm(
                parameters=(SPINDLE, SPINDLE_PHASE),
                probes=fixed_starts((0.1, 0.0)),
                needs=("spindle_rpm",),
                proportional=True,
                quadrature=True,
            ),
            EffectForm(
                parameters=(SPINDLE_SQUARE, SPINDLE_PHASE),
                probes=fixed_starts((0.02, 0.0)),
                needs=("spindle_rpm",),
                proportional=True,
                quadrature=True,
            ),
        ),
        group=("mains-hum", "regulator-hunting"),
    ),
    Effect(
        name="pad-wear",
        number=26,
        family="contact and tool",
        what="the pad wears along the way that it has ground",
        signature="the force falls with distance_m",
        excitation="a long way under force, with rests between, recorded as distance_m",
        experiment="three passes with rests of a minute between them, with distance_m and temperature_c recorded",
        recipe=Recipe(
            parts=(PartName.CYCLES,),
            columns=("temperature_c",),
            apart="note distance_m: wear follows the way that was ground, drift follows time and goes on at rest",
        ),
        treatments=(Treatment(why_not=TRIM),),
        forms=(
            EffectForm(parameters=(WEAR,), probes=fixed_starts((0.01,)), needs=("distance_m",), proportional=True),
            EffectForm(parameters=(WEAR_N,), probes=fixed_starts((0.01,)), needs=("distance_m",), proportional=True),
        ),
        group=MONOTONE,
    ),
    Effect(
        name="position-dependence",
        number=27,
        family="contact and tool",
        what="the force depends on where the tool stands",
        signature="the residual follows position_mm",
        excitation="positions over the whole way, more than once, recorded as position_mm",
        experiment="one force, the whole way forth and back at two speeds, with position_mm recorded",
        recipe=_WHOLE_WAY,
        treatments=(Treatment(why_not=_NO_PLACE),),
        forms=(
            EffectForm(parameters=(SLOPE,), probes=fixed_starts((0.02,)), needs=("position_mm",), proportional=True),
            EffectForm(
                parameters=(SLOPE, CURVE),
                probes=fixed_starts((0.02, 0.0), (0.0, 1.0e-3)),
                needs=("position_mm",),
                proportional=True,
            ),
        ),
    ),
    Effect(
        name="position-ripple",
        number=28,
        family="contact and tool",
        what="a periodic force along the way: a screw, a belt, a waviness",
        signature="a sine of position_mm",
        excitation="a way of several periods, recorded as position_mm",
        experiment="one force, 50 mm forth and back at two speeds, with position_mm recorded",
        recipe=_WHOLE_WAY,
        treatments=(Treatment(why_not=_NO_PLACE),),
        forms=(
            EffectForm(
                parameters=(RIPPLE, RIPPLE_PITCH, RIPPLE_PHASE),
                probes=_ripple,
                needs=("position_mm",),
                proportional=True,
                quadrature=True,
            ),
        ),
    ),
    Effect(
        name="backlash",
        number=29,
        family="contact and tool",
        what="play in mount or guide that must close before force passes (lost at each reversal, it widens the loop)",
        signature="no force until the thrust has closed the gap",
        excitation="returns to no force, from different sizes",
        experiment="reversals of 0.05 to 1 V around three levels with position_mm recorded",
        recipe=Recipe(parts=(PartName.TOUCHES, PartName.REVERSALS)),
        treatments=(Treatment(by=By.MODEL, fields=("contact.backlash_n", "contact.lost_n")),),
        forms=(
            EffectForm(parameters=(LOST,), probes=fixed_starts((0.5,), (2.0,))),
        ),  # the other play is friction's: one cannot tell
        group=("sign-loss", "asymmetric-friction"),
        rarity=4.0,
    ),
)
