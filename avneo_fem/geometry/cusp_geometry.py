"""One cusp: its template, its suture line and how the one is stitched to the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from avneo_fem.errors import SceneError
from avneo_fem.geometry.stitching import StitchingMap
from avneo_fem.geometry.suture_line import AorticSutureLine
from avneo_fem.geometry.template import CuspTemplate, corner_height_for, free_edge_length_for
from avneo_fem.scene_tables import Template

__all__ = ["CuspGeometry", "stitching_of"]

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

    def suture_joints(self) -> Array:
        """Arc lengths (2,) on the template of the ends of the suture line's straight parts [mm].

        Next to the commissures the line is straight (Fig. 7); where it begins to turn, a mesh
        should have a node: then the row of triangles at the corner meets no bend.
        """
        return self.stitching.template_arc_length(self.suture_line.breaks[[1, -2]])

    def sutured_tangent(self, s_csl: ArrayLike) -> Array:
        """tau_asl(gamma(s)), unit vectors (n, 3) (paper §3.1)."""
        return self.suture_line.tangent(self.stitching.annulus_arc_length(s_csl))

    def sutured_conormal(self, s_csl: ArrayLike) -> Array:
        """b_asl(gamma(s)), unit vectors (n, 3) (paper §3.1, §3.2 step 4)."""
        return self.suture_line.conormal(self.stitching.annulus_arc_length(s_csl))


def stitching_of(
    index: int, template: CuspTemplate, line: AorticSutureLine, gather: float, key: str
) -> StitchingMap:
    """Stitching map of one cusp.

    Parameters
    ----------
    gather : float
        alpha_sl.
    key : str
        Scene name of the template's table, for errors.

    Raises
    ------
    SceneError
        When J_sl is out of range; says which free edge lengths or corner heights would do.
    """
    try:
        return StitchingMap(template.suture_length, line.length, gather, key)
    except SceneError as error:
        raise SceneError(
            f"{key}.free_edge_length",
            template.parameters.free_edge_length,
            f"cusp {index} does not fit its suture line: {error.valid};"
            f" {_that_would_do(template.parameters, line.length, gather)}",
        ) from None


def _that_would_do(given: Template, line: float, gather: float) -> str:
    """The free edge lengths, and the corner heights, for which J_sl is in range."""
    high, height = (
        free_edge_length_for(gather * line, given),
        corner_height_for(gather * line, given),
    )
    if high is None:
        text = (
            "no free_edge_length would do: pi belly_radius + 2 corner_height must be below"
            f" {gather * line:.6g} mm"
        )
    else:
        low = free_edge_length_for(line, given)
        low = 2.0 * given.belly_radius if low is None else low
        text = f"between {low:.6g} and {high:.6g} mm would do, all else kept"
    if height is None:
        return text
    low = corner_height_for(line, given)
    above = "below" if low is None else f"between {low:.6g} and"
    return f"{text}; or corner_height {above} {height:.6g} mm"
