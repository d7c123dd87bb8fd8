"""Two figures of ours: the ratios, and one step beside the fastest that the regulator allows."""

import numpy as np
from matplotlib.figure import Figure

from paper import paper_values
from paper.experiments.closed_loop import STEP_S
from paper.experiments.limit import bang_bang_v, holding_v, responses
from paper.experiments.rigs import paper_plant
from paper.figures.drawing import COLOUR, LABEL, RED, sheet
from paper.study import Study


def ratio_figure(study: Study) -> Figure:
    """Draw ours beside the paper's law: ratios with 95 % intervals over the seeds."""
    rows = study.comparisons[::-1]
    figure, axes = sheet(1, 1, (9.0, 0.36 * len(rows) + 1.1))
    panel = axes[0][0]
    for at, row in enumerate(rows):
        ratio, colour = row.ratios["ours"], COLOUR["ours"]
        panel.plot((ratio.low, ratio.high), (at, at), color=colour, linewidth=2.5, solid_capstyle="butt")
        panel.plot(ratio.mean, at, "o", color=colour, markersize=5, label="" if at else LABEL["ours"])
        if row.goal is not None:
            panel.plot((row.goal,) * 2, (at - 0.4, at + 0.4), color=RED, linewidth=1.2, label="" if at else "goal")
    panel.axvline(1.0, color="0.3", linewidth=0.9)
    panel.set(
        xscale="log", xlim=(0.02, 2.5), xticks=(0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0), ylim=(-0.6, len(rows) - 0.4)
    )
    panel.set_xticklabels(["0.02", "0.05", "0.1", "0.2", "0.5", "1", "2"])
    panel.set_xlabel("ratio to the paper's BSFM (1: equal, left: better)")
    panel.minorticks_off()
    panel.set_yticks(range(len(rows)), [row.name for row in rows])
    panel.grid(axis="y", visible=False)
    figure.legend(loc="outside lower center", ncols=3)
    return figure


def limit_figure(study: Study, target_n: float = 20.0, band_n: float = 1.0) -> Figure:
    """Draw one step in detail: the paper's, our and the fastest command with the forces they make."""
    figure, axes = sheet(2, 1, (9.0, 5.0), sharex=True)
    case, plant = paper_values.TARGETS_N.index(target_n), paper_plant()
    for name in ("bsfm", "ours"):
        record = study.steps.of(name, 0, case)
        axes[0][0].step(record.tick_s, record.command_v[:, 0], where="post", color=COLOUR[name], label=LABEL[name])
        axes[1][0].plot(record.step_s, record.force_n[:, 0], color=COLOUR[name])
    best = next(row for row in study.limits if row.target_n == target_n and row.band_n == band_n)
    volts = bang_bang_v([(best.up_ms, best.down_ms)], holding_v(plant, target_n))
    time_s = np.arange(len(volts)) * STEP_S
    axes[0][0].step(time_s, volts[:, 0], where="post", color="0.1", linewidth=1.0, label=f"fastest into {band_n:g} N")
    axes[1][0].plot(time_s + STEP_S, responses(plant, volts)[:, 0], color="0.1", linewidth=1.0)
    axes[1][0].axhspan(target_n - band_n, target_n + band_n, color="0.92", linewidth=0.0)
    axes[1][0].axvline(plant.regulator.delay_s, color="0.6", linewidth=0.8, linestyle=":")
    axes[0][0].set(ylabel="command (V)", title=f"step from no load to {target_n:g} N")
    axes[1][0].set(ylabel="force (N)", xlabel="time (s); dotted: dead time; grey: band", xlim=(0.0, 0.6))
    axes[0][0].legend(loc="upper right")
    return figure
