"""Geometry of a whole valve: three cusps, their suture lines and the verdict on their sizes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avneo_fem.errors import SceneError
from avneo_fem.geometry.commissure import (
    commissure_angles,
    commissure_directions,
    contact_lengths,
)
from avneo_fem.geometry.commissure_plane import CommissurePlane
from avneo_fem.geometry.competence import Verdict, competence_verdict
from avneo_fem.geometry.cusp_geometry import CuspGeometry, stitching_of
from avneo_fem.geometry.root import CylinderRoot
from avneo_fem.geometry.suture_line import AorticSutureLine
from avneo_fem.geometry.template import CuspTemplate
from avneo_fem.geometry.triple_contact import TripleContactPoint, triple_contact_point
from avneo_fem.scene import Scene

__all__ = ["CuspGeometry", "ValveGeometry", "commissure_plane"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ValveGeometry:
    """What the paper's section 3 calls the input geometry, checked.

    Attributes
    ----------
    root : CylinderRoot
    commissures : CommissurePlane
        A_i, midpoint of the chord between the end of the ASL of cusp i+1 and the start of that of
        cusp i+2 [mm].
    cusps : tuple of CuspGeometry
    commissure_lengths, contact_lengths : (3,) float64
        l_i and c_i [mm] (paper section 3.3).
    triple_contact : TripleContactPoint
    verdict : Verdict
        Whether it can close, why or why not, and what would help (paper section 3.4, step 1).
    """

    root: CylinderRoot
    commissures: CommissurePlane
    cusps: tuple[CuspGeometry, CuspGeometry, CuspGeometry]
    commissure_lengths: Array
    contact_lengths: Array
    triple_contact: TripleContactPoint
    verdict: Verdict

    @property
    def competent(self) -> bool:
        """Whether the cusps can close the valve."""
        return self.verdict.competent

    @property
    def competence_reason(self) -> str:
        """Why, or why not and what would help, in one line."""
        return self.verdict.reason

    @classmethod
    def from_scene(cls, scene: Scene) -> ValveGeometry:
        """Build the geometry of a scene.

        Raises
        ------
        SceneError
            For the first of: a template that does not exist, chords that form no triangle, a gap
            that leaves no suture line, a stitching ratio out of range, inconsistent lengths, and,
            with ``competence.policy = "error"``, a valve that is not competent.
        """
        common = all(cusp.template == scene.cusp[0].template for cusp in scene.cusp)
        keys = ["template" if common else f"cusp.{i}.template" for i in range(3)]
        templates = [
            CuspTemplate(cusp.template, key) for cusp, key in zip(scene.cusp, keys, strict=True)
        ]
        lines = _suture_lines(scene)
        cusps = [
            CuspGeometry(
                i,
                templates[i],
                lines[i],
                stitching_of(i, templates[i], lines[i], scene.stitching.gather_ratio, keys[i]),
                templates[i].thickness,
            )
            for i in range(3)
        ]
        plane = _plane(lines)
        lengths = np.array([template.intercommissural_length for template in templates])
        contact = contact_lengths(lengths)
        triple = triple_contact_point(plane.points, contact)
        verdict = competence_verdict(triple, plane, lengths, contact, scene.competence)
        if not verdict.competent and scene.competence.policy == "error":
            raise SceneError(
                "competence.policy", "error", f'{verdict.reason}; "warn" would go on all the same'
            )
        for array in (lengths, contact, triple.point):
            array.flags.writeable = False
        root = CylinderRoot(scene.root.radius)
        return cls(root, plane, (cusps[0], cusps[1], cusps[2]), lengths, contact, triple, verdict)


def commissure_plane(scene: Scene) -> CommissurePlane:
    """Commissures of a scene, whatever its templates are.

    Raises
    ------
    SceneError
        For chords that form no triangle, or a gap that leaves no suture line.
    """
    return _plane(_suture_lines(scene))


def _plane(lines: list[AorticSutureLine]) -> CommissurePlane:
    """A_i: midpoints between the ends of neighbouring suture lines (paper section 3.1)."""
    sums = [lines[(i + 1) % 3].ends[1] + lines[(i + 2) % 3].ends[0] for i in range(3)]
    return CommissurePlane(np.array(sums) / 2.0)


def _suture_lines(scene: Scene) -> list[AorticSutureLine]:
    """Suture lines of the three cusps; w_i = (2 alpha_i - gap/R) R (design.md section 1)."""
    radius, gap = scene.root.radius, scene.commissures.gap
    alpha = commissure_angles(scene.commissures.chord_ratio)
    if gap >= 2.0 * radius * alpha.min():
        raise SceneError(
            "commissures.gap",
            gap,
            f"leaves no room for the suture line of cusp {int(alpha.argmin())}:"
            f" must be below its arc of {2.0 * radius * alpha.min():.6g} mm",
        )
    start = np.roll(commissure_directions(alpha), -1) + gap / (2.0 * radius)
    common = all(cusp.suture_line == scene.cusp[0].suture_line for cusp in scene.cusp)
    return [
        AorticSutureLine(
            radius,
            float(start[i]),
            float(2.0 * alpha[i] * radius - gap),
            scene.cusp[i].suture_line,
            "suture_line" if common else f"cusp.{i}.suture_line",
        )
        for i in range(3)
    ]
