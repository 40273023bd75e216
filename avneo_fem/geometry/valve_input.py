"""A scene with all the geometry that follows from it."""

from __future__ import annotations

from dataclasses import dataclass

from avneo_fem.geometry.contact_wedge import ContactWedgeFamily
from avneo_fem.geometry.suture_room import require_suture_room
from avneo_fem.geometry.symmetry import require_symmetry
from avneo_fem.geometry.valve_geometry import ValveGeometry
from avneo_fem.scene import Scene

__all__ = ["ValveInput"]


@dataclass(frozen=True)
class ValveInput:
    """A scene with the geometry that follows from it.

    Attributes
    ----------
    scene : Scene
    geometry : ValveGeometry
        Templates, suture lines, commissures and triple contact point.
    wedges : ContactWedgeFamily
        The contact wedges of the three cusps by ``contact.method``, lambda = 0 ... 1.
    """

    scene: Scene
    geometry: ValveGeometry
    wedges: ContactWedgeFamily

    @classmethod
    def from_scene(cls, scene: Scene) -> ValveInput:
        """Build and check the geometry.

        Raises
        ------
        SceneError
            When the scene is geometrically impossible, which includes a contact wedge whose two
            curves cross at one of the run's lambda or that leaves out its own suture line, and
            symmetry planes of a valve without symmetry.
        """
        geometry = ValveGeometry.from_scene(scene)
        require_symmetry(scene, geometry.commissures)
        wedges = ContactWedgeFamily(
            geometry.commissures,
            geometry.triple_contact.point,
            geometry.contact_lengths,
            scene.contact.omega,
            scene.contact.method,
        )
        for index in range(3):
            for lam in wedges.levels(scene.contact.steps):
                wedges.wedge(index, lam)
        require_suture_room(scene, geometry, wedges)
        return cls(scene, geometry, wedges)

    def seen_from(self, index: int) -> ValveInput:
        """The same valve with cusp ``index`` as cusp 0, turned about the axis accordingly.

        Congruent cusps then have the same numbers, to the last bit: so they come out the same.
        """
        if index == 0:
            return self
        cusps = self.scene.cusp[index:] + self.scene.cusp[:index]
        ratio = self.scene.commissures.chord_ratio
        commissures = self.scene.commissures.model_copy(
            update={"chord_ratio": ratio[index:] + ratio[:index]}
        )
        scene = self.scene.model_copy(update={"cusp": cusps, "commissures": commissures})
        return ValveInput.from_scene(scene)
