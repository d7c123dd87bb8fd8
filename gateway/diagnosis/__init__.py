"""Measured against simulated: what the model gets wrong, the named cause, the extended model, the gain on unseen data.

In the order of the work: measurement (what came in), suspects (wrong units, swapped columns), bench (recordings beside the
twin), base_fit, start (what friction remembers at the first row), direct (what the readings tell by themselves), catalogue
and effect (43 causes and where a search for them begins), scene, candidates, contest and search (naming), noise and gram
(the mathematics of it), screen (what is left), worth (what is a finding), identifiability, floor, diagnose (the whole),
result (the answer). Pure: time and chance are arguments.
"""

from gateway.catalogue.catalogue import BY_NAME, EFFECTS
from gateway.catalogue.effect import Effect, Parameter
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
]
