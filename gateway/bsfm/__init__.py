"""The method: rational Bezier branches from voltage to force, their inverse, what happens at reversals, and how to fit them.

"The paper" in these modules is the one that presents the rational-Bezier-based state fitting method (BSFM) for calibrating
a low-cost pneumatic constant-force system; README, "Compared with the paper", and tools/paper say what of it is reproduced.

Public here, without numpy or scipy: the curve, the branches, the model and its calibration, the checks before activation.
fit/, ladder/ and slip/ (but for its reversal policies) need numpy and are imported by their own names, never by control.

Glossary
branch          rising or falling: the curve from voltage to force while the voltage grows or shrinks (paper, Eq. 4)
branch share    s in [-1, 1]: where between the branches the plant is; 1 on the rising one, -1 on the falling one
memory          what a reversal policy remembers of past turns; `branch_share(memory)` reads it
span            of the linear blend: the change of force, N, that leads from one branch to the other
slip stop       one Maxwell element of radius r, V, and share c of s
ladder          the voltages of a calibration run: groups of stairs up and down, then the walk
stair           one voltage of the ladder, reached in one direction; a step is the change from stair to stair
dwell           the time at one stair
sweep           the stairs of one direction; a group is a full sweep up and a full one back
walk            the stairs behind the groups that turn round inside the loop (minor loops)
settled point   the force of one stair once it has stopped moving
"""

from gateway.bsfm.branches import Branches, Crossing
from gateway.bsfm.coefficients import CoefficientFault, CoefficientLimits, CoefficientReason, Coefficients
from gateway.bsfm.curve import ORDER_MAX, RationalBezier
from gateway.bsfm.inverse import InverseStatus
from gateway.bsfm.model import Bsfm, Calibration, Response
from gateway.bsfm.slip.reversal import FALLING, RISING, LinearBlend, Memory, Reversal
from gateway.bsfm.slip.slip_stops import SlipStops
from gateway.bsfm.validate import validate_coefficients

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
    "validate_coefficients",
]
