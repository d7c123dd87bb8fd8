"""The model of pulling, where nobody has measured it: that of pushing by the share of the piston that the rod leaves free.

Pressure acts on the rod side on that share of the area, so the force for a voltage is that share. Friction is no smaller there:
the derived loop is too narrow by the rest of it, and what is off the trim has to make good.
"""

from dataclasses import replace

from gateway.bsfm import Branches, Bsfm, LinearBlend, RationalBezier


def scale_forces(model: Bsfm, share: float) -> Bsfm:
    """Return the model with all forces multiplied by share > 0; voltages stay."""
    branches = model.branches
    rising, falling = (_scale_curve(curve, share) for curve in (branches.rising, branches.falling))
    reversal = model.reversal
    if isinstance(reversal, LinearBlend):
        reversal = LinearBlend(reversal.span_n * share)
    limits_n = None if model.limits_n is None else (model.limits_n[0] * share, model.limits_n[1] * share)
    return replace(model, branches=Branches(rising, falling), reversal=reversal, limits_n=limits_n)


def _scale_curve(curve: RationalBezier, share: float) -> RationalBezier:
    return RationalBezier(curve.x0, curve.x1, [share * handle for handle in curve.handles], list(curve.weights))
