"""Whether the pressure is one that the sheet can carry without being blown up."""

from __future__ import annotations

from avneo_fem.scene import Scene

__all__ = ["inflation", "inflation_warning"]

#: above it triangles come out several times as long as the mesh was made for (docs/extremes.md)
_MOST = 1.0


def inflation(scene: Scene) -> float:
    """P R / (E H) of the thinnest cusp, by which a tube is strained while that is small."""
    thinnest = min(cusp.template.thickness for cusp in scene.cusp)
    stiffness = scene.material.young_modulus * thinnest
    return scene.diastolic_pressure * scene.root.radius / stiffness


def inflation_warning(scene: Scene) -> str | None:
    """What is wrong with pressure, modulus and thickness, and what would do; None if nothing is.

    The membrane energies have no limit of extension: a sheet under too much pressure becomes a
    balloon whose triangles are several times as long as the mesh was made for. At a ratio of 2 it
    may still be verified, at 20 nothing is.
    """
    strain = inflation(scene)
    if strain <= _MOST:
        return None
    return (
        f"P R / (E H) = {strain:.2g}: the pressure stretches the sheet several times over; with"
        f" diastolic_pressure below {scene.diastolic_pressure * _MOST / strain:.3g} kPa, or"
        f" young_modulus above {scene.material.young_modulus * strain / _MOST:.4g} kPa, the ratio"
        f" is below {_MOST:g}"
    )
