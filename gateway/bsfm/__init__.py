"""The method: rational Bezier branches from voltage to force, their inverse, what happens at reversals, and how to fit them.

Public here, without numpy or scipy: the curve, the branches, the model and its calibration, the checks before
activation. `gateway.bsfm.ladder.measured_ladder`, `.fit` and `.order_choice` need numpy and are imported by their
own names, never by
control.
"""

from gateway.bsfm.branches import Branches, Crossing
from gateway.bsfm.coefficients import CoefficientFault, CoefficientLimits, CoefficientReason, Coefficients
from gateway.bsfm.curve import ORDER_MAX, RationalBezier
from gateway.bsfm.inverse import InverseStatus
from gateway.bsfm.model import Bsfm, Calibration, Response
from gateway.bsfm.slip.reversal import FALLING, RISING, LinearBlend, Memory, Reversal
from gateway.bsfm.slip.slip_stops import SlipStops
from gateway.bsfm.validate import validate, validate_coefficients

__all__ = [
    "FALLING",
    "ORDER_MAX",
    "RISING",
    "Branches",
    "Bsfm",
    "Calibration",
    "CoefficientFault",
    "CoefficientLimits",
    "CoefficientReason",
    "Coefficients",
    "Crossing",
    "InverseStatus",
    "LinearBlend",
    "Memory",
    "RationalBezier",
    "Response",
    "Reversal",
    "SlipStops",
    "validate",
    "validate_coefficients",
]
