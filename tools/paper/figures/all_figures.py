"""All figures by their short names."""

from collections.abc import Callable
from typing import Final

from matplotlib import pyplot
from matplotlib.figure import Figure

from paper.figures.drawing import STYLE
from paper.figures.fits import figure_4, figure_5, figure_6
from paper.figures.ratios_and_limit import limit_figure, ratio_figure
from paper.figures.runs import figure_7, figure_8, figure_9, settling_figure
from paper.study import Study

FIGURES: Final[dict[str, tuple[str, Callable[[Study], Figure]]]] = {
    "fig4": ("Fig. 4: pooled fits over the measured loop", figure_4),
    "fig5": ("Fig. 5: fits per direction", figure_5),
    "fig6": ("Fig. 6: residual over the order", figure_6),
    "fig7": ("Fig. 7: validation with a reciprocating command", figure_7),
    "fig8": ("Fig. 8: steps from no load to 5 .. 40 N", figure_8),
    "fig8-times": (
        "Fig. 8, its times: settling per target, and the fastest that the regulator allows",
        settling_figure,
    ),
    "fig9": ("Fig. 9: tracking under feed, as the load cell sees it", figure_9),
    "ratios": ("Ours beside the paper's law: ratios with 95 % intervals over the seeds", ratio_figure),
    "limit": ("The regulator's limit, one step in detail", limit_figure),
}


def draw(study: Study) -> dict[str, Figure]:
    """Draw every figure, by its short name. The caller closes them."""
    with pyplot.rc_context(STYLE):
        return {name: make(study) for name, (_, make) in FIGURES.items()}
