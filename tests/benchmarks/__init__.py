"""How fast it all is: measurements side by side, see ``python tests/benchmarks --help``.

A section is a function from `measure.Options` to a list of `result.Result`; `sections.SECTIONS`
names them all.
"""
