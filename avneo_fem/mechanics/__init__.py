"""Membrane, Kirchhoff-Love bending and loads in UFL. Pure: no meshes, no solvers."""
