"""The map of extremes: scenes far from the paper's, and whether each ends as it should."""
