"""The paper's experiments on the twin, side by side with the paper's numbers. A tool: matplotlib is welcome here.

In the order of the work: paper_values (what the paper says), experiments (its rig, its calibration, its laws and its
exercises, run on the twin), comparison (ratios with intervals), study (all of it), verdicts and goals with bounds (what
it says), figures and report (what people look at). `reproduce` is the command.
"""
