"""Triangulation of the flat templates."""
