"""Measured against simulated: what the model gets wrong, the named cause, the extended model, the gain on unseen data.

In the order of the work: measurement (what came in), excerpt, input_checks (wrong units, swapped columns) and columns_option
(what corrects them); bench/ (recordings beside the twin); noise/ (spectrum, whitening, the floor that rests prove);
model_fit/ (the base model, what is remembered at the first row, and the mathematics of it); search/ (direct_evidence, what
the readings tell by themselves; hints, candidates, model_comparison, acceptance and search: naming effects of
gateway/catalogue; significance: what is a finding); residuals/ (what is left); experiments/ (what the recording cannot show,
and what to record next); verdict and notes, diagnose (the whole), changes/ (what has changed between two recordings), result
(the answer). Pure: time and chance are arguments.
"""

from gateway.catalogue.all_effects import BY_NAME, EFFECTS
from gateway.catalogue.effect import Effect, Parameter
from gateway.diagnosis.changes.compare_recordings import find_changes
from gateway.diagnosis.diagnose import Options, diagnose
from gateway.diagnosis.measurement import Measurement
from gateway.diagnosis.result import Diagnosis, Verdict

__all__ = [
    "BY_NAME",
    "EFFECTS",
    "Diagnosis",
    "Effect",
    "Measurement",
    "Options",
    "Parameter",
    "Verdict",
    "diagnose",
    "find_changes",
]
