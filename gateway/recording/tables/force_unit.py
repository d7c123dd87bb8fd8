"""The unit of the force that a table's comments say: `# force_unit: kgf`. What the header or a mapping says counts more."""

from dataclasses import replace

from gateway.recording.errors import RecordingError
from gateway.recording.foreign.unit_names import unit_of
from gateway.recording.reader import Recording
from gateway.units import LINEAR, linear_conversion


def force_in_newtons(recording: Recording) -> Recording:
    """Return the recording with its force in newtons. RecordingError for a unit that is none of force."""
    written = str(recording.header.get("force_unit") or "").strip()
    if not written or "force_n" not in recording.columns:
        return recording
    unit = unit_of(written, "force")
    if unit is None and written != "MN":  # in small letters that would be a thousandth of one
        unit = unit_of(written.lower(), "force")
    if unit is None:
        raise RecordingError(
            f"{recording.path}: its comments say force_unit: {written[:20]}, which is none of {', '.join(LINEAR['force'])}; "
            "--columns force_n=force_n:UNIT says otherwise"
        )
    factor, _ = linear_conversion("force", unit, "n")
    if factor == 1.0:
        return recording
    note = f"forces are in {written} and were turned into newtons (1 {written} = {factor:.5g} N)"
    return replace(
        recording,
        header=recording.header | {"force_unit": "N"},
        columns=recording.columns | {"force_n": recording.columns["force_n"] * factor},
        notes=(*recording.notes, note),
        factors=recording.factors | {"force_n": factor},
    )
