"""The measured figures that the documentation quotes: one module per group of figures.

A group is a module with `FIGURES`, what it measures and which target each figure has, and
`measure(options) -> Measured`. `suite.GROUPS` lists them in the order in which they run.
"""
