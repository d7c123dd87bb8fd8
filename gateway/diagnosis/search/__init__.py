"""The search for causes: evidence, candidates, model comparison, acceptance, and what of it is a finding.

Where its numbers come from: levels of significance are conventions (1 % over all that was tried, intervals of 95 %); limits of
waves and draws bound the time, and the comment says what that costs; the other thresholds were chosen on recordings of the
generator in tests/hidden_effects, so that nothing is found in nothing and no cause is named wrongly there. README (`How often
it is right`) has the rates on recordings that were not used for it.
"""
