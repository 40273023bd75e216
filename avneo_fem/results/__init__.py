"""Results of a run: independent verification, surfaces, history and pictures.

Nothing in this package imports the solver: it works on plain arrays, so that what it says about
a result shares no code with what produced it (design.md §2, §5).
"""
