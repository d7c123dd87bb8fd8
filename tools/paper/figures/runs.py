"""Figs. 7, 8 and 9, redrawn from the runs of the paper's rig."""

from matplotlib.figure import Figure

from paper import paper_values
from paper.experiments import exercises
from paper.experiments.trials import settled_s
from paper.figures.drawing import COLOUR, LABEL, sheet
from paper.study import Study


def figure_7(study: Study) -> Figure:
    """Draw Fig. 7: validation with a reciprocating command."""
    figure, axes = sheet(3, 1, (9.0, 7.2), sharex=True)
    wished = study.validation.of("bsfm")
    top, middle, bottom = axes[:, 0]
    top.plot(wished.tick_s, wished.desired_n[:, 0], color="0.2", linewidth=1.0, label="desired")
    for name in ("psfm", "bsfm"):
        width = {"psfm": 2.6, "bsfm": 1.1}[name]  # the two lie on each other
        top.plot(
            wished.step_s,
            study.validation.of(name).force_n[:, 0],
            color=COLOUR[name],
            linewidth=width,
            label=LABEL[name],
        )
    for panel, names in ((middle, ("psfm", "bsfm")), (bottom, ("bsfm", "ours"))):
        for name in names:
            width = 2.6 if name == "psfm" else 1.1
            error_n = study.validation.of(name).error_n[:, 0]
            panel.plot(wished.step_s, error_n, color=COLOUR[name], linewidth=width, label=LABEL[name])
        panel.axhline(0.0, color="0.4", linewidth=0.8)
        panel.set(ylabel="error (N)", ylim=(-2.0, 2.9))
    top.set(
        ylabel="force (N)",
        title=f"(a) reciprocating command, {exercises.PACE_N_PER_S:g} N/s (assumed)",
        ylim=(-8.0, 40.0),
    )
    middle.set_title("(b) error = force minus desired: the paper's laws")
    bottom.set_title("(c) the same exercise with ours")
    bottom.set_xlabel("time (s)")
    top.legend(loc="lower center", ncols=3)
    for panel in (middle, bottom):
        panel.legend(loc="upper center", ncols=3)
    return figure


def figure_8(study: Study) -> Figure:
    """Draw Fig. 8: steps from no load."""
    figure, axes = sheet(1, 3, (9.0, 3.6), sharex=True, sharey=True)
    for panel, name, letter in zip(axes.ravel(), ("bsfm", "psfm", "ours"), "abc", strict=True):
        for case, target_n in enumerate(paper_values.TARGETS_N):
            record = study.steps.of(name, 0, case)
            panel.axhspan(target_n - 1.0, target_n + 1.0, color="0.93", linewidth=0.0)
            panel.plot(record.step_s, record.force_n[:, 0], color=COLOUR[name])
        panel.set(xlim=(0.0, 1.0), title=f"({letter}) {LABEL[name]}")
        panel.grid(axis="y", visible=False)
        panel.set_xlabel("time (s); grey: target ±1 N")
    axes[0][0].set(ylabel="force (N)", yticks=[0, *paper_values.TARGETS_N])
    return figure


def settling_figure(study: Study) -> Figure:
    """Draw the settling times of Fig. 8, and the fastest that the regulator allows."""
    figure, axes = sheet(1, 2, (9.0, 3.9), sharey=True)
    for panel, (band_n, (low_s, mean_s, high_s)) in zip(axes[0], paper_values.SETTLING_S.items(), strict=True):
        panel.axhspan(low_s, high_s, color="#2a78d6", alpha=0.1, linewidth=0.0, label="the paper's range")
        panel.axhline(mean_s, color="#2a78d6", alpha=0.5, linewidth=1.0, linestyle=":", label="the paper's mean")
        for name, marker in (("bsfm", "o"), ("ours", "s")):
            times_s = study.steps.score(settled_s(band_n), name)[0]
            panel.plot(
                paper_values.TARGETS_N, times_s, marker + "-", color=COLOUR[name], markersize=4, label=LABEL[name]
            )
        rows = [row for row in study.limits if row.band_n == band_n]
        best_s = [row.settled_s for row in rows]
        panel.plot(paper_values.TARGETS_N, best_s, "k.--", linewidth=0.9, label="fastest command 0 .. 10 V")
        panel.set(xlabel="step to (N)", title=f"to stay within {band_n:g} N", ylim=(0.0, 0.65))
    axes[0][0].set_ylabel("time (s)")
    figure.legend(*axes[0][1].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def figure_9(study: Study) -> Figure:
    """Draw Fig. 9: tracking under feed, as the load cell sees it."""
    figure, axes = sheet(4, 2, (9.0, 9.6), sharex="row", sharey="row")
    for case, (force_n, feed, spinning) in enumerate(exercises.CONDITIONS):
        panel = axes[_row(force_n, feed)][int(spinning)]
        for name in ("bsfm", "ours"):
            record = study.tracking.of(name, 0, case)
            shown = record.tick_s <= exercises.FEED_FROM_S + exercises.TRAVEL_M / feed
            panel.plot(
                record.tick_s[shown], record.measured_n[shown, 0], color=COLOUR[name], linewidth=0.7, label=LABEL[name]
            )
        panel.axhspan(force_n - 2.0, force_n + 2.0, color="0.93", linewidth=0.0)
        panel.axvline(exercises.FEED_FROM_S, color="0.6", linewidth=0.8, linestyle=":")
        words = f"{force_n:g} N, {feed * 1000:g} mm/s, spindle {'on' if spinning else 'off'}"
        panel.set(
            title=f"({'bd'[feed > 0.01] if spinning else 'ac'[feed > 0.01]}) {words}",
            ylim=(force_n - 4.0, force_n + 4.0),
        )
    for row in axes:
        row[0].set_ylabel("measured force (N)")
    for panel in axes[-1]:
        panel.set_xlabel("time (s); dotted: feed begins; grey: ±2 N")
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def _row(force_n: float, feed_m_per_s: float) -> int:
    """Fig. 9's panels, slow feed first."""
    return 2 * int(feed_m_per_s > 0.01) + int(force_n > 12.0)
