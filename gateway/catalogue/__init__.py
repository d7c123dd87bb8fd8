"""The catalogue of effects: one entry for each physical cause by which a real rig may differ from the simulated one.

An entry is all that the project knows of an effect beside its term in the twin: its number in the register
residual_cause, name, family, words, parameters of the plant with bounds, the columns that it needs, where a search begins,
the experiment that shows it, and what control does about it or why not. Everything else is derived from here:

    numbers and names of the register and of the map       gateway/registers/residual_cause.py
    the search, its groups, what a recording cannot show   gateway/diagnosis
    experiments and plans                                  gateway/diagnosis/experiments
    what control compensates, and why not                  gateway/profiles/rigs/compensated_effects.py
    what moves around the tool in the closed loop          gateway/service/closed_loop/schedule.py
    the tables of `effects` and of the reports             gateway/cli, gateway/reports

So the catalogue stands below the registers and not within the diagnosis that uses most of it: a register must know the
numbers, and imports run one way. It is data without arithmetic and imports no more of the project than gateway.defaults, so
that reading it costs no numpy; parts of experiments stand here by name, and diagnosis/experiments/blocks.py says what each
does.

To add an effect: its term in gateway/twin, one entry in the file of its family (contact and tool has two: contact.py and
tool_motion.py), an example in tests/diagnosis/hidden.py. What entries of several families need is in shared.py.
"""
