"""Is the goal met - half the largest error, 0.7 of the settling time - and where not, why: with the limit beside it."""

from dataclasses import dataclass
from typing import Final

from gateway.control.force_loop.lead_compensator import LeadCompensator
from paper.bounds import allowed_ratio, bound, delay_s, shaken_n
from paper.comparison import ERROR_GOAL, SETTLING_GOAL, Comparison
from paper.experiments.exercises import PACE_N_PER_S, UNBALANCE_N
from paper.experiments.laws import LAG_S, RESPONSE_LAG_S, TRIM, settings
from paper.experiments.rigs import paper_plant
from paper.paper_values import SETTLING_S
from paper.study import Study

MET, MISSED, NO_GOAL = "met", "missed", ""


@dataclass(frozen=True, slots=True)
class GoalResult:
    """A comparison with the verdict on ours, what bounds every law here, and the reason where ours misses."""

    comparison: Comparison
    ours: str
    bound: str
    why: str


def judge_goals(study: Study) -> list[GoalResult]:
    """Say of every comparison whether its goal is met, and if not, why."""
    return [_judge(study, comparison) for comparison in study.comparisons]


def _judge(study: Study, comparison: Comparison) -> GoalResult:
    if comparison.goal is None:
        return GoalResult(comparison, NO_GOAL, "", "")
    ours = MET if comparison.meets("ours") else MISSED
    return GoalResult(comparison, ours, bound(study, comparison), "" if ours == MET else _reason(study, comparison))


def _reason(study: Study, comparison: Comparison) -> str:
    name = comparison.name
    for beginning, reason in REASONS:
        if beginning in name:
            return reason(study, comparison)
    return "the error is small on both sides"


def _settling(study: Study, comparison: Comparison) -> str:
    return "the lead is told the nominal lags, and a copy's own differ"


def _moving(study: Study, comparison: Comparison) -> str:
    chosen = settings(RESPONSE_LAG_S, TRIM)
    left_s = 2 * LAG_S - LeadCompensator(chosen.lead, chosen.limits).gained_s
    parts_n = [PACE_N_PER_S * seconds for seconds in (delay_s() + left_s, delay_s())]
    return (
        f"the wish moves, and being late is all there is: delay and what the lead leaves of the lags cost "
        f"{parts_n[0]:.2f} N, the dead time alone {parts_n[1]:.2f} N, which no law avoids without knowing the future. "
        "Just after a turn the paper's switch jumps ahead by the loop's width, which hides the lag; slip stops do not jump"
    )


def _at_rest(study: Study, comparison: Comparison) -> str:
    noise_n = paper_plant().cell.noise_n
    return f"nothing to gain: open loop is {comparison.means['bsfm']:.2f} N off, one reading's noise is {noise_n:.2f} N"


def _shaken(study: Study, comparison: Comparison) -> str:
    shaken, goal_n = shaken_n(study), ERROR_GOAL * comparison.means["bsfm"]
    return (
        f"{UNBALANCE_N:g} N at 65 Hz, half a period is 8 ms: behind {1000 * delay_s():.0f} ms of dead time no air follows it. "
        f"It takes {shaken:.2f} N of the {goal_n:.2f} N that the goal leaves; what is slower is met, one row below"
    )


def _fast_feed(study: Study, comparison: Comparison) -> str:
    return "the plate's waves pass at 0.5 Hz; a trim behind 0.22 s of delay and lags stays stable up to about that"


REASONS: Final = (
    ("time to stay", _settling),
    ("reciprocating", _moving),
    ("at rest", _at_rest),
    ("slower than", _fast_feed),
    ("spindle on", _shaken),
    ("spindle off", _fast_feed),
)


def summary(study: Study) -> list[str]:
    """Return the goal in sentences."""
    rows = [row for row in judge_goals(study) if row.ours]
    sentences = []
    for goal, words in (
        (ERROR_GOAL, f"at most {ERROR_GOAL:g} of the largest error"),
        (SETTLING_GOAL, f"at most {SETTLING_GOAL:g} of the settling time"),
    ):
        these = [row for row in rows if row.comparison.goal == goal]
        met = sum(row.ours == MET for row in these)
        sentences.append(f"Goal {words}: the gateway's controller meets it in {met} of {len(these)} measures.")
    allowed = ", ".join(f"{allowed_ratio(study, band_n):.2f} for {band_n:g} N" for band_n in SETTLING_S)
    return [*sentences, f"Settling time that the regulator allows at best, as a share of the paper's law: {allowed}."]
