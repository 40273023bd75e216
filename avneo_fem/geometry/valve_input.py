"""A scene with all the geometry that follows from it."""

from __future__ import annotations

from dataclasses import dataclass

from avneo_fem.geometry.contact_wedge import ContactWedgeFamily
from avneo_fem.geometry.valve_geometry import ValveGeometry
from avneo_fem.scene import Scene

__all__ = ["ValveInput"]


@dataclass(frozen=True)
class ValveInput:
    """A scene with the geometry that follows from it."""

    scene: Scene
    geometry: ValveGeometry
    wedges: ContactWedgeFamily

    @classmethod
    def from_scene(cls, scene: Scene) -> ValveInput:
        """Build and check the geometry.

        Raises
        ------
        SceneError
            When the scene is geometrically impossible.
        """
        geometry = ValveGeometry.from_scene(scene)
        wedges = ContactWedgeFamily(
            geometry.commissures.points,
            geometry.triple_contact.point,
            geometry.commissures.normal,
            geometry.contact_lengths,
            scene.contact.omega,
        )
        return cls(scene, geometry, wedges)
