"""The continuation that brings one flat template into the root, stage by stage."""
