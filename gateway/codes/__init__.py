"""The one table of codes: every refusal, alarm and error with its code, number, exception, title, cause and cure.

E: around the gateway (ports, network, files). W: a master's request was refused. A: the rig behaves otherwise than it should.
`explain`, the registers' numbers and bits, the map's value names, Modbus exceptions and severities of the log derive from here;
a new code is an entry here and the place that raises it. Nothing is imported by the package itself, for the guardian and the
terminal's start read parts of it only.
"""
