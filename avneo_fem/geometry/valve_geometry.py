"""Geometry of a whole valve: three cusps, their suture lines and the verdict on their sizes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from avneo_fem.errors import SceneError
from avneo_fem.geometry.commissure import (
    commissure_angles,
    commissure_directions,
    contact_lengths,
)
from avneo_fem.geometry.commissure_plane import CommissurePlane
from avneo_fem.geometry.competence import Verdict, competence_verdict
from avneo_fem.geometry.root import CylinderRoot
from avneo_fem.geometry.stitching import StitchingMap
from avneo_fem.geometry.suture_line import AorticSutureLine
from avneo_fem.geometry.template import CuspTemplate, free_edge_length_for
from avneo_fem.geometry.triple_contact import TripleContactPoint, triple_contact_point
from avneo_fem.scene import Scene

__all__ = ["CuspGeometry", "ValveGeometry", "commissure_plane"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CuspGeometry:
    """One cusp: template, the line on the wall, and how the one is stitched to the other.

    ``thickness`` is H [mm]. In the methods ``s_csl`` (n,) are arc lengths on the template's
    suture line, in [0, l_c] [mm] from corner N_0.
    """

    index: int
    template: CuspTemplate
    suture_line: AorticSutureLine
    stitching: StitchingMap
    thickness: float

    def sutured_position(self, s_csl: ArrayLike) -> Array:
        """r_asl(gamma(s)), points (n, 3) [mm] (paper §3.2, step 2)."""
        return self.suture_line.point(self.stitching.annulus_arc_length(s_csl))

    def sutured_tangent(self, s_csl: ArrayLike) -> Array:
        """tau_asl(gamma(s)), unit vectors (n, 3) (paper §3.1)."""
        return self.suture_line.tangent(self.stitching.annulus_arc_length(s_csl))

    def sutured_conormal(self, s_csl: ArrayLike) -> Array:
        """b_asl(gamma(s)), unit vectors (n, 3) (paper §3.1, §3.2 step 4)."""
        return self.suture_line.conormal(self.stitching.annulus_arc_length(s_csl))


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
                _stitching(i, templates[i], lines[i], scene.stitching.gather_ratio, keys[i]),
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


def _stitching(
    index: int, template: CuspTemplate, line: AorticSutureLine, gather: float, key: str
) -> StitchingMap:
    """Stitching map of one cusp; its error says which free edge length would do."""
    try:
        return StitchingMap(template.suture_length, line.length, gather, key)
    except SceneError as error:
        high = free_edge_length_for(gather * line.length, template.parameters)
        if high is None:
            valid = (
                "; no free_edge_length would do: pi belly_radius + 2 corner_height must be below"
                f" {gather * line.length:.6g} mm"
            )
        else:
            low = free_edge_length_for(line.length, template.parameters)
            low = 2.0 * template.parameters.belly_radius if low is None else low
            valid = f"; between {low:.6g} and {high:.6g} mm would do, all else kept"
        raise SceneError(
            f"{key}.free_edge_length",
            template.parameters.free_edge_length,
            f"cusp {index} does not fit its suture line: {error.valid}{valid}",
        ) from None
