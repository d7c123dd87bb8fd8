"""The table: statement of the paper, its value, ours, and whether that is a reproduction. Each verdict is a computed check."""

from collections.abc import Callable, Sequence

from paper.study import Study
from paper.verdicts.fits import judge_per_direction, judge_pooled
from paper.verdicts.tracking import judge_roughness, judge_spindle, judge_tracking
from paper.verdicts.validation_and_steps import judge_steps, judge_two_steps, judge_validation
from paper.verdicts.verdict import NO, OUTSIDE, YES, Verdict


def verdicts(study: Study) -> list[Verdict]:
    """Return all lines of the table, in the order of the paper's figures."""
    parts: list[Callable[[Study], list[Verdict]]] = [
        judge_pooled,
        judge_per_direction,
        judge_validation,
        judge_steps,
        judge_two_steps,
        judge_tracking,
        judge_spindle,
    ]
    return [line for part in parts for line in part(study)] + [judge_roughness()]


def numbers(lines: Sequence[Verdict]) -> dict[str, int]:
    """Return how many of each word there are."""
    return {word: sum(line.verdict == word for line in lines) for word in (YES, NO, OUTSIDE)}


def counts(lines: Sequence[Verdict]) -> str:
    """Return how many of each word there are, as text."""
    return ", ".join(f"{number} {word}" for word, number in numbers(lines).items())
