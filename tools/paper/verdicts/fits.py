"""Figs. 4, 5 and 6: which model describes the loop, and of what order."""

from typing import Final

from gateway.bsfm.fit.result import FitResult
from paper import paper_values
from paper.study import Study
from paper.verdicts.verdict import NORM_TOLERANCE, Verdict, near, word

FLAT: Final = {"pfm": 1.005, "bfm": 1.005, "psfm": 1.1, "bsfm": 1.1}
"""An order is enough when its RMS residual is less than so many times that of order 15."""


def needed_order(fits: list[FitResult], flat: float) -> int:
    """Return the smallest order whose RMS residual is that of the highest, nearly."""
    return next(result.order for result in fits if result.rms_n <= flat * fits[-1].rms_n)


def course(study: Study, name: str) -> tuple[tuple[float, float], str]:
    """Return the norm at order 1 and 15, and the words with the RMS and largest residual beside it."""
    first, last = study.fits[name][0], study.fits[name][-1]
    norms = (first.paper_norm, last.paper_norm)
    rest = f"RMS {first.rms_n:.3f} → {last.rms_n:.3f} N, max {first.max_n:.2f} → {last.max_n:.2f} N"
    return norms, f"{norms[0]:.4f} → {norms[1]:.4f} (norm); {rest}"


def norm_line(study: Study, name: str, statement: str, why: str) -> Verdict:
    """Compare a model's norms with the paper's."""
    norms, words = course(study, name)
    paper = paper_values.NORM[name]
    holds = all(near(a, b, NORM_TOLERANCE) for a, b in zip(norms, paper, strict=True))
    where = "Fig. 6(a)" if name in ("pfm", "bfm") else "Fig. 6(b)"
    return Verdict(where, statement, f"{paper[0]:.4f} → {paper[1]:.4f} (norm)", words, word(holds), why)


def order_line(study: Study, names: tuple[str, str], where: str, statement: str, why: str) -> Verdict:
    """Compare the orders needed with the paper's."""
    ours = [needed_order(study.fits[name], FLAT[name]) for name in names]
    paper = [paper_values.ORDER_NEEDED[name] for name in names]
    labels = [f"{name.upper()} {{}}" for name in names]
    return Verdict(where, statement, *(", ".join(labels).format(*v) for v in (paper, ours)), word(ours == paper), why)


def judge_pooled(study: Study) -> list[Verdict]:
    """Judge the models with one curve for both directions."""
    pfm = "one curve runs through the middle of the loop: what remains is half its width, whatever the order"
    size = f"{pfm}; a norm within {NORM_TOLERANCE:.0%} counts, the slide is another one"
    return [
        norm_line(study, "pfm", "Pooled polynomial, orders 1 to 15: cannot describe the loop", size),
        norm_line(study, "bfm", "Pooled rational Bezier, orders 1 to 15: cannot either", size),
        order_line(
            study,
            ("pfm", "bfm"),
            "Fig. 4, 6(a)",
            "Pooled: no gain beyond order",
            "within 0.5 % of the residual at order 15",
        ),
    ]


def judge_per_direction(study: Study) -> list[Verdict]:
    """Judge the models with a curve for each direction."""
    smooth = (
        "the twin's loop is smoother than a real one and its noise averages out over ten groups, so high orders leave less; "
        "the norm's formula is inferred, the paper does not give it"
    )
    psfm = next(result for result in study.fits["psfm"] if result.order == 3).branches
    jump_n = max(
        abs(psfm.rising.value(volts) - psfm.falling.value(volts)) for volts in (0.0, paper_values.LADDER_TOP_V)
    )
    return [
        norm_line(study, "psfm", "Polynomial per direction, orders 1 to 15", smooth),
        norm_line(study, "bsfm", "Rational Bezier per direction, orders 1 to 15", smooth),
        order_line(
            study,
            ("psfm", "bsfm"),
            "Fig. 5, 6(b)",
            "Per direction: order needed",
            "within 10 % of the residual at order 15",
        ),
        Verdict(
            "Fig. 5(b, d)",
            "BSFM is continuous, PSFM piecewise",
            "shown enlarged",
            f"jump at an end: PSFM {jump_n:.3f} N, BSFM 0 N",
            word(jump_n > 0.0),
            "shared end handles; the polynomials' jump is small here because they fit this loop well",
        ),
    ]
