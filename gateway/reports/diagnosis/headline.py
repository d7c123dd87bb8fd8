"""The answer of a diagnosis in one sentence, and what it lacks: the same words in the terminal and on the page."""

from collections.abc import Sequence
from typing import Final

from gateway.diagnosis.notes import why_blind
from gateway.diagnosis.result import Cause, Diagnosis, Verdict
from gateway.reports.diagnosis import wording as words

BADGES: Final = {
    Verdict.NOTHING_FOUND: ("nothing found", "good"),
    Verdict.CONFIRMED: ("confirmed", "good"),
    Verdict.PARTIAL: ("explained in part", "warn"),
    Verdict.UNKNOWN: ("not explained", "bad"),
}
_WRONG_COLUMNS: Final = "Nothing can be told yet: the columns are not what their names say"
_FIX_COLUMNS: Final = "No cause was looked for. Fix this first, then run it again."
_NOTHING_LEFT: Final = "Nothing is left above the noise floor."
_CONFIRM: Final = "To confirm it, record rests, repeat a cycle or give the noise floor (--noise-floor-n)."
_TELL_APART: Final = "They look alike in this recording; what to record next tells them apart."
_KEEP_REFIT: Final = "diagnose --save keeps the plant as it was refitted, for plant use."
_COSTLY_SHARE: Final = 0.3  # of what the refit takes away: three numbers that share it evenly have 0.58 of it each
_DEPENDS_ON_NOTHING: Final = "What is left is more than the noise, and depends on nothing that was recorded."


def badge(diagnosis: Diagnosis) -> tuple[str, str]:
    """Return the verdict as a word or two, and its colour."""
    if _has_wrong_columns(diagnosis) or why_blind(diagnosis):
        return "nothing can be told", "warn"
    if diagnosis.verdict is Verdict.PARTIAL and not _leaves_more_than_noise(diagnosis):
        return "explained, not confirmed", "warn"
    if diagnosis.verdict is Verdict.NOTHING_FOUND and is_plant_off(diagnosis):
        return "no effect, other numbers", "warn"
    return BADGES[diagnosis.verdict]


def answer_sentence(diagnosis: Diagnosis) -> str:
    """Return `Creep explains part of the difference: 0.42 N before, 0.21 N after, the noise is 0.10 N`. N RMS."""
    if _has_wrong_columns(diagnosis):
        return _WRONG_COLUMNS
    if why := why_blind(diagnosis):
        return f"Nothing can be told: {why}"
    tell = _describe_finding if diagnosis.machine is None else _describe_change
    return f"{tell(diagnosis)}: {_describe_error(diagnosis)}"


def lack_sentence(diagnosis: Diagnosis) -> str:
    """Return what the answer lacks, or that it lacks nothing; empty where the answer has said it."""
    if _has_wrong_columns(diagnosis):
        return _FIX_COLUMNS
    if why_blind(diagnosis) or diagnosis.verdict is Verdict.NOTHING_FOUND:
        return ""
    if diagnosis.verdict is Verdict.CONFIRMED:
        return _NOTHING_LEFT
    if diagnosis.leftover:
        found = words.join_words(dict.fromkeys(rest.depends_on for rest in diagnosis.leftover))
        return f"What is left depends on {found}."
    if diagnosis.verdict is Verdict.UNKNOWN or _leaves_more_than_noise(diagnosis):
        return _DEPENDS_ON_NOTHING
    return _TELL_APART if _has_group(diagnosis.causes) else _CONFIRM


def is_plant_off(diagnosis: Diagnosis) -> bool:
    """Decide whether the rig's plant is off by more than the noise as it stands, and not once it is refitted."""
    refit = diagnosis.refit
    return refit is not None and refit.is_own and refit.gain_n > diagnosis.baseline.noise_floor_n


def refit_sentence(diagnosis: Diagnosis) -> str:
    """Return what the rig's plant gets wrong as it stands; empty where refitting it takes away no more than the noise."""
    refit = diagnosis.refit
    if refit is None or not is_plant_off(diagnosis):
        return ""
    costly = [each for each in refit.numbers if each.costs_n > _COSTLY_SHARE * refit.gain_n] or refit.numbers
    numbers = words.join_words(words.refitted_number(each) for each in costly)
    return (
        f"As it stands, the rig's plant is off by {words.force(refit.as_given_rms_n)} N RMS: {numbers}. {_KEEP_REFIT}"
    )


def _describe_finding(diagnosis: Diagnosis) -> str:
    if diagnosis.verdict is Verdict.NOTHING_FOUND:
        return "No effect is missing that this recording could show"
    if diagnosis.verdict is Verdict.UNKNOWN:
        return "No effect of the catalogue explains the difference"
    names, many = _names(diagnosis.causes), len(diagnosis.causes) > 1
    return f"{_capitalise(names)} explain{'' if many else 's'} {_how_much(diagnosis)}"


def _describe_change(diagnosis: Diagnosis) -> str:
    if diagnosis.verdict is Verdict.NOTHING_FOUND:
        return "Nothing has changed on this machine that the recordings could show"
    if diagnosis.verdict is Verdict.UNKNOWN:
        return "Something has changed on this machine, and no effect of the catalogue explains it"
    return f"What has changed on this machine is {_names(diagnosis.causes)}, which explains {_how_much(diagnosis)}"


def _how_much(diagnosis: Diagnosis) -> str:
    if diagnosis.verdict is Verdict.CONFIRMED:
        return "the whole difference"
    if _leaves_more_than_noise(diagnosis):
        return "part of the difference"
    if _has_group(diagnosis.causes):
        return "the difference, but not told apart from what looks alike"
    return "the difference, as far as the noise is known"


def _describe_error(diagnosis: Diagnosis) -> str:
    before_n, after_n, noise_n = (
        f"{words.force(value)} N"
        for value in (
            diagnosis.baseline.rms_n,
            diagnosis.extended.held_out_rms_n,
            diagnosis.baseline.noise_floor_n,
        )
    )
    if not diagnosis.causes:
        refitted = ", refitted," if is_plant_off(diagnosis) else ""
        return f"the simulation{refitted} is off by {before_n}, the noise is {noise_n}"
    return f"{before_n} before, {after_n} after, the noise is {noise_n}"


def _names(causes: Sequence[Cause]) -> str:
    """Return `creep (or warm-up) and mains-hum`."""
    return words.join_words(
        cause.name + (f" (or {', or '.join(others)})" if (others := words.others(cause)) else "") for cause in causes
    )


def _capitalise(text: str) -> str:
    return text[:1].upper() + text[1:]


def _leaves_more_than_noise(diagnosis: Diagnosis) -> bool:
    return bool(diagnosis.leftover) or not diagnosis.extended.reaches_noise_floor


def _has_group(causes: Sequence[Cause]) -> bool:
    return any(words.others(cause) for cause in causes)


def _has_wrong_columns(diagnosis: Diagnosis) -> bool:
    return any(suspect.is_sure for suspect in diagnosis.suspects)
