"""Measured against simulated: what the model gets wrong, the named cause, the extended model, the gain on unseen data.

In the order of the work: measurement (what came in), excerpt, input_checks (wrong units, swapped columns); search/: bench
(recordings beside the twin), base_fit, initial_state (what is remembered at the first row), direct_evidence (what
the readings tell by themselves), hints, candidates, model_comparison and search (naming one of the effects of
gateway/catalogue), normal_equations and levenberg_marquardt (the mathematics of it), significance (what is a finding);
noise, residual_tests and residual_regressors (what is left), noise_floor, experiments/ (what the recording cannot show, and
what to record next), verdict and notes, diagnose (the whole), against/ (what has changed between two
recordings), result (the answer). Pure: time and chance are arguments.
"""

from gateway.catalogue.all_effects import BY_NAME, EFFECTS
from gateway.catalogue.effect import Effect, Parameter
from gateway.diagnosis.against.compare_recordings import find_changes
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
