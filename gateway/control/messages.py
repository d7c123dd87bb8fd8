"""The sentences of control: a code, what was seen in numbers, what it probably is, one thing to do."""

from math import inf
from typing import Final

from gateway.codes.faults import FaultCode
from gateway.control.inputs import LineStatus
from gateway.control.supervision.unreachable_force import Evidence, defective_words, unreachable_words

_UNLOADED_SHARE: Final = 0.25  # of a force that is gone, up to which a cell that carries nothing reads beside 0
_PRESSES_N: Final = 2.0  # less is what friction keeps of a vented tool


def fault_sentence(fault: FaultCode, detail: str) -> str:
    """Return the detail with the code of its fault before it."""
    return f"{fault.code} {detail}"


def unreachable_sentence(evidence: Evidence, direction: float) -> str:
    """Return A301 in numbers, with what it probably is. direction: -1 where the tool pulls."""
    shown_n, model_n = direction * evidence.measured_n, direction * evidence.expected_n
    return (
        f"A301 {evidence.voltage_v:.2f} V out, {shown_n:.1f} N measured, {model_n:.1f} expected: "
        f"{unreachable_words(evidence)}"
    )


def saturated_sentence(voltage_v: float, trim_v: float, measured_n: float, expected_n: float) -> str:
    """Return A340 in numbers, with what it probably is: a load cell of another span looks so, and a calibration would take it
    for right. Forces as the registers tell them."""
    return (
        f"A340 {voltage_v:.2f} V out, {measured_n:.1f} N measured, {expected_n:.1f} expected, the trim at its limit of "
        f"{trim_v:+.2f} V: supply pressure, calibration or the load cell's span is off; compare the cell with a "
        "known weight before you calibrate again"
    )


def hunting_sentence(force_n: float, turns: int) -> str:
    """Return W360, which says that the trim has backed off."""
    return (
        f"W360 at {force_n:.1f} N the trim has turned round {turns} times: the force sticks and slips, or the "
        "workpiece moves; the trim stands still until there is another setpoint, or a large error that stays on one side"
    )


def swinging_sentence(force_n: float, *, is_trim_off: bool) -> str:
    """Return W360 for a trim whose gain the rig file says, which may be none: then it is no cause, and goes no slower."""
    if is_trim_off:
        return (
            f"W360 at {force_n:.1f} N the force swings to both sides, and the trim is off: the regulator hunts, the force "
            "sticks and slips, lead is too large for this rig, or the workpiece moves"
        )
    return (
        f"W360 at {force_n:.1f} N the force swings to both sides: trim.gain_v_per_n_s or lead is too large for this rig, or "
        "the workpiece moves; the trim goes slower until the output is at rest. `force-gateway calibrate` measures its pace"
    )


def noisy_sentence(force_n: float, two_values: str) -> str:
    """Return W361, which says why the state does not become holding. two_values: as of `Evidence`."""
    why = (
        "the noise is as large as the band, the tool shakes or the regulator hunts; a wider in_band_tolerance, or a filter on "
        "the amplifier"
    )
    return (
        f"W361 at {force_n:.1f} N single readings keep leaving the band that their mean is in, so holding does not last: "
        f"{defective_words(two_values) if two_values else why}"
    )


def sign_sentence(rise_n: float, expected_n: float, *, was_right: bool = False, untared_n: float = inf) -> str:
    """Return A302 in numbers, and what to do. was_right: the force has risen as it should since the enable; untared_n: what the
    cell reads now without its tare, inf where that is not known: near 0, the tare was of a force."""
    cure = "swap the cell's signal wires or set sign: -1"
    if was_right:
        cure = "it was right before in this enable: a tilt that tilt_angle does not tell, or something that pulls on the tool"
    if abs(untared_n) < _UNLOADED_SHARE * abs(rise_n):
        cure = (
            f"without its tare the cell reads {untared_n:.1f} N, so a force was taken for its zero, and has left: "
            "free the tool and tare again"
        )
    return fault_sentence(
        FaultCode.SIGN_INVERTED, f"force went {rise_n:+.1f} N where {expected_n:+.1f} N were expected: {cure}"
    )


def gain_sentence(rise_n: float, expected_n: float) -> str:
    """Return A303 in numbers, and what to do."""
    share = rise_n / expected_n
    return fault_sentence(
        FaultCode.GAIN_WRONG,
        f"force rose {rise_n:.1f} N where {expected_n:.1f} N were expected ({share:.0%}): 981% or 10% means that kgf and N "
        "are mixed up; check the unit and span of the load cell in the rig file",
    )


def ladder_silent_sentence(voltage_v: float, rise_n: float, expected_n: float, *, is_constant: bool) -> str:
    """Return A301 of a calibration run: no force answers the voltage. is_constant: nor has a reading ever changed."""
    cell = "all readings are the same: cell or amplifier dead, else " if is_constant else ""
    return (
        f"A301 calibration stopped: {voltage_v:.2f} V out, the force rose by {rise_n:.1f} N where {expected_n:.1f} N were "
        f"expected: {cell}no air, valve closed or no contact"
    )


def restless_sentence(waited_s: float, rest_n: float, drift_n: float) -> str:
    """Return what a run says that begins although the load cell has not come to rest before."""
    return (
        f"the load cell has not come to rest in {waited_s:.1f} s: {rest_n:.1f} N, moved by {drift_n:.2f} N in the last 0.3 s, "
        "counts as its rest; a force that is still leaving, or a cell that drifts, makes the run wrong"
    )


def stuck_sentence(measured_n: float, limit_n: float) -> str:
    """Return W304: a force where none is commanded. Whether the safe voltage stands is not said: the port may be away."""
    return (
        f"W304 {measured_n:.1f} N measured with the output disabled, allowed +-{limit_n:.1f} N: stuck in contact, valve "
        "open or zero moved; free the tool or tare"
    )


def tare_sentence(zero_n: float, rest_n: float) -> str:
    """Return what a tare has taken as zero. rest_n: what presses at the safe voltage by the model: taken as zero, each force
    after it is so much more."""
    is_pressed = rest_n > _PRESSES_N and 0.5 * rest_n < zero_n < 1.5 * rest_n
    hint = (
        f"; {rest_n:.1f} N press at the safe voltage: if the tool touches, lift it and tare again" if is_pressed else ""
    )
    return f"tare: zero at {zero_n:.2f} N{hint}"


def master_lost_sentence(line: LineStatus, lease_age_s: float, *, is_behind: bool = False) -> str:
    """Return how the loss of the master was seen. lease_age_s: since its heartbeat last changed; is_behind: it changes, but has
    waited in a pile of requests."""
    if line.owner_connected and is_behind:
        return "master lost: its heartbeats wait behind its other requests, and it may be gone: let it wait for each answer"
    why = "" if line.owner_connected else "connection closed, "
    if line.owner_connected and line.owner_refused:
        why = f"its last write was refused, with any heartbeat in it ({line.owner_refused}); "
    return f"master lost: {why}heartbeat unchanged for {lease_age_s * 1e3:.0f} ms"
