"""Three cusps: which are congruent, which process solves which, and all of them together."""
