"""The paper's experiments on the twin, side by side with the paper's numbers. A tool: matplotlib is welcome here.

Modules in the order of the work: paper_values (what the paper says), rigs (copies of its rig), calibration (ladder and
fits), laws (who turns a wanted force into volts), bench and trials (run laws on rigs), exercises (Figs. 7, 8, 9), limit
(what the regulator's physics allows), comparison (ratios with intervals), study (all of it), verdicts* and goals (what
it says), drawing, figures* and report (what people look at). `reproduce` is the command.
"""
