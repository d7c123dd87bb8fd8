"""Effects of what moves around the tool: feed, tilt, spindle, and its place along the workpiece."""

from functools import partial
from typing import Final

from gateway.catalogue import effect, shared

entry = partial(effect.Effect, family="contact and tool")

SIDE_FEED: Final = effect.Parameter("friction", "side_load_n_s_per_mm", "N s/mm", 0.0, 0.0, 20.0, 0.005)
SIDE_FORCE: Final = effect.Parameter("friction", "side_load_n_per_n", "N/N", 0.0, 0.0, 0.9, 0.003)
SIDE_TILT: Final = effect.Parameter("friction", "side_load_tilt_n", "N", 0.0, 0.0, 100.0, 0.1)
SIDE_POSITION: Final = effect.Parameter("friction", "side_load_n_per_mm", "N/mm", 0.0, 0.0, 20.0, 0.002)
TILT: Final = effect.Parameter("contact", "tilt_n", "N", 0.0, 0.0, 200.0, 0.1)
TILT_ZERO: Final = effect.Parameter("contact", "tilt_zero_deg", "deg", 0.0, -400.0, 400.0, 0.5, shape=True)
FEED_DRAG: Final = effect.Parameter("contact", "feed_drag_n_s_per_mm", "N s/mm", 0.0, -50.0, 50.0, 0.005)
FEED_DRAG_DRY: Final = effect.Parameter("contact", "feed_drag_n", "N", 0.0, -50.0, 50.0, 0.05)
FEED_DRAG_ABS: Final = effect.Parameter("contact", "feed_drag_abs_n_s_per_mm", "N s/mm", 0.0, -50.0, 50.0, 0.005)
SPINDLE: Final = effect.Parameter("contact", "spindle_n", "N", 0.0, 0.0, 100.0, 0.05)
SPINDLE_PHASE: Final = effect.Parameter("contact", "spindle_phase_rad", "rad", 0.0, -10.0, 10.0, 0.02, shape=True)
SPINDLE_SQUARE: Final = effect.Parameter("contact", "spindle_n_per_krpm2", "N/krpm2", 0.0, 0.0, 100.0, 0.005)
SLOPE: Final = effect.Parameter("contact", "position_n_per_mm", "N/mm", 0.0, -100.0, 100.0, 0.005)
CURVE: Final = effect.Parameter("contact", "position_n_per_mm2", "N/mm2", 0.0, -100.0, 100.0, 2.0e-4)
RIPPLE: Final = effect.Parameter("contact", "ripple_n", "N", 0.0, 0.0, 50.0, 0.05)
RIPPLE_PITCH: Final = effect.Parameter("contact", "ripple_pitch_mm", "mm", 5.0, 0.05, 1.0e4, 0.002, shape=True)
RIPPLE_PHASE: Final = effect.Parameter("contact", "ripple_phase_rad", "rad", 0.0, -10.0, 10.0, 0.02, shape=True)

_WHOLE_WAY: Final = effect.Recipe(
    parts=(effect.PartName.LEVEL,), meanwhile="let the robot go the whole way forth and back at two speeds"
)
_NO_PLACE: Final = "the command block carries no place along the path; what is slow the trim takes back"


def _ripple(hints: effect.SearchHints) -> tuple[effect.Start, ...]:
    return tuple((0.1, pitch_mm, 0.0) for pitch_mm in hints.pitches_mm)


TOOL_MOTION: Final = (
    entry(
        name="side-load",
        number=22,
        what="a force across the slide raises its friction",
        signature="the loop widens with feed, tilt or position",
        excitation="reversals of the force at different feed, tilt or position, with that column recorded",
        experiment="reversals of 1 V at rest and at two feeds, with feed_mm_s recorded",
        recipe=effect.Recipe(
            parts=(effect.PartName.REVERSALS,),
            columns=("feed_mm_s", "tilt_deg"),
            meanwhile="let the robot feed at two speeds, and stand, for some seconds each",
        ),
        treatments=(effect.Treatment(why_not="the model's loop has one width, whatever presses from the side"),),
        forms=(
            effect.EffectForm(
                parameters=(SIDE_FEED,), probes=effect.fixed_starts((0.003,), (0.02,)), needs=("feed_mm_s",)
            ),
            effect.EffectForm(
                parameters=(SIDE_FORCE,), probes=effect.fixed_starts((0.003,), (0.02,)), needs=("feed_mm_s",)
            ),
            effect.EffectForm(
                parameters=(SIDE_TILT,), probes=effect.fixed_starts((0.05,), (0.4,)), needs=("tilt_deg",)
            ),
            effect.EffectForm(
                parameters=(SIDE_POSITION,), probes=effect.fixed_starts((0.002,), (0.02,)), needs=("position_mm",)
            ),
        ),
        group=("load-dependent-friction", "position-dependent-friction"),
    ),
    entry(
        name="tilt-gravity",
        number=23,
        what="the weight of the tool presses with the cosine of its tilt",
        signature="the residual is a cosine of tilt_deg",
        excitation="tilts over 20 degrees or more, recorded as tilt_deg",
        experiment="hold one force at 0, 45, 90 and 135 degrees, with tilt_deg recorded",
        recipe=effect.Recipe(
            parts=(effect.PartName.LEVEL,),
            meanwhile="turn the tool to 0, 45, 90 and 135 degrees, 10 s each, with its pad on a workpiece that turns along",
        ),
        treatments=(effect.Treatment(by=effect.By.OUTSIDE),),
        forms=(
            effect.EffectForm(
                parameters=(TILT, TILT_ZERO),
                probes=effect.fixed_starts((1.0, 0.0)),
                needs=("tilt_deg",),
                proportional=True,
                quadrature=True,
            ),
        ),
    ),
    entry(
        name="feed-drag",
        number=24,
        what="moving along the workpiece drags the tool",
        signature="the residual follows feed_mm_s",
        excitation="feeds of both directions and different speeds, recorded as feed_mm_s",
        experiment="one force, feeds of 0, 5 and 15 mm/s in both directions, with feed_mm_s recorded",
        recipe=effect.Recipe(
            parts=(effect.PartName.LEVEL,), meanwhile="let the robot feed at 0, 5 and 15 mm/s in both directions"
        ),
        treatments=(effect.Treatment(by=effect.By.OUTSIDE),),
        forms=(
            effect.EffectForm(
                parameters=(FEED_DRAG,), probes=effect.fixed_starts((0.02,)), needs=("feed_mm_s",), proportional=True
            ),
            effect.EffectForm(
                parameters=(FEED_DRAG_DRY,), probes=effect.fixed_starts((0.2,)), needs=("feed_mm_s",), proportional=True
            ),
            effect.EffectForm(
                parameters=(FEED_DRAG_ABS,),
                probes=effect.fixed_starts((0.02,)),
                needs=("feed_mm_s",),
                proportional=True,
            ),
        ),
    ),
    entry(
        name="spindle-vibration",
        number=25,
        what="the turning spindle shakes the tool",
        signature="a line at the spindle's turning while it is on",
        excitation="spindle on and off, recorded as spindle_rpm",
        experiment="one force with the spindle off, at half and at full speed, 10 s each, with spindle_rpm recorded",
        recipe=effect.Recipe(
            parts=(effect.PartName.LEVEL,), meanwhile="run the spindle at nothing, half and full speed, 20 s each"
        ),
        treatments=(
            effect.Treatment(
                why_not=shared.TOO_FAST,
                fields=(
                    "contact.spindle_n",
                    "contact.spindle_n_per_krpm2",
                    "contact.spindle_order",
                    "contact.spindle_phase_rad",
                ),
            ),
        ),
        forms=(
            effect.EffectForm(
                parameters=(SPINDLE, SPINDLE_PHASE),
                probes=effect.fixed_starts((0.1, 0.0)),
                needs=("spindle_rpm",),
                proportional=True,
                quadrature=True,
            ),
            effect.EffectForm(
                parameters=(SPINDLE_SQUARE, SPINDLE_PHASE),
                probes=effect.fixed_starts((0.02, 0.0)),
                needs=("spindle_rpm",),
                proportional=True,
                quadrature=True,
            ),
        ),
        group=("mains-hum", "regulator-hunting"),
    ),
    entry(
        name="position-dependence",
        number=27,
        what="the force depends on where the tool stands",
        signature="the residual follows position_mm",
        excitation="positions over the whole way, more than once, recorded as position_mm",
        experiment="one force, the whole way forth and back at two speeds, with position_mm recorded",
        recipe=_WHOLE_WAY,
        treatments=(effect.Treatment(why_not=_NO_PLACE),),
        forms=(
            effect.EffectForm(
                parameters=(SLOPE,), probes=effect.fixed_starts((0.02,)), needs=("position_mm",), proportional=True
            ),
            effect.EffectForm(
                parameters=(SLOPE, CURVE),
                probes=effect.fixed_starts((0.02, 0.0), (0.0, 1.0e-3)),
                needs=("position_mm",),
                proportional=True,
            ),
        ),
    ),
    entry(
        name="position-ripple",
        number=28,
        what="a periodic force along the way: a screw, a belt, a waviness",
        signature="a sine of position_mm",
        excitation="a way of several periods, recorded as position_mm",
        experiment="one force, 50 mm forth and back at two speeds, with position_mm recorded",
        recipe=_WHOLE_WAY,
        treatments=(effect.Treatment(why_not=_NO_PLACE),),
        forms=(
            effect.EffectForm(
                parameters=(RIPPLE, RIPPLE_PITCH, RIPPLE_PHASE),
                probes=_ripple,
                needs=("position_mm",),
                proportional=True,
                quadrature=True,
            ),
        ),
    ),
)
