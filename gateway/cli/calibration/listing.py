"""A calibration as an entry of a list on the terminal."""

from collections.abc import Iterator, Sequence

from gateway.bsfm import Calibration


def describe_calibration(calibration: Calibration, slots: Sequence[int], *, is_own: bool = False) -> Iterator[str]:
    """Yield its name, what it is, how good it is, where it comes from, and why it is not offered."""
    low_n, high_n = calibration.allowed_n
    yield calibration.name + (" (the rig's own)" if is_own else "")
    yield f"{calibration.date_utc}  {calibration.kind}  {calibration.reversal_kind}  {low_n:.1f} .. {high_n:.1f} N"
    yield ", ".join(_describe_errors(calibration))
    yield f"in slot {', '.join(map(str, slots))}" if slots else ""
    yield calibration.source
    yield f"rejected, not offered: {calibration.rejected}" if calibration.rejected else ""


def _describe_errors(calibration: Calibration) -> Iterator[str]:
    for name, error_n in (("rms", calibration.rms_n), ("max", calibration.max_n)):
        if error_n >= 0.0:
            yield f"{name} {error_n:.3f} N"
