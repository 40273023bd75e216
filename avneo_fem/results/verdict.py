"""What was measured on a result, and whether that is good enough."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

__all__ = ["CuspVerification", "Tolerances", "ValveVerification", "judge"]


@dataclass(frozen=True)
class CuspVerification:
    """What was measured on one cusp; names as in report.json (design.md §2).

    The two closest approaches of its layers are infinite where none come near each other
    (:mod:`avneo_fem.results.layers`). Of the wedge the nodes are judged, and of the triangles the
    distance from the other cusps; how deep their edges cut the wedge's bends is reported.
    """

    residual: float
    suture_error_mm: float
    clamp_error_deg: tuple[float, float]
    outside_root_mm: float
    outside_wedge_mm: float
    edges_outside_wedge_mm: float
    free_edge_sag_mm: float
    self_intersections: int
    min_wall_distance_mm: float
    closest_layers_mm: float
    closest_layers_near_suture_mm: float


@dataclass(frozen=True)
class ValveVerification:
    """What was measured on the valve; names as in report.json (design.md §2)."""

    cusps: tuple[CuspVerification, ...]
    cusp_intersections: int
    min_distance_mm: float
    min_wall_distance_mm: float


@dataclass(frozen=True)
class Tolerances:
    """Largest, and for the three distances smallest, figures of a verified result.

    ``clamp_deg`` applies to the rms angle; by default it is reported but not judged, since flat
    triangles show an angle even where a curved cusp is perfectly clamped. The three distances are
    the clearances asked for between mid-surfaces of different cusps, between mid-surface and wall,
    and between layers of one cusp away from its suture; a cusp may be short of its own by
    ``inside_mm``, so two cusps by twice that.
    """

    residual: float
    inside_mm: float = 0.05
    suture_mm: float = 1e-6
    sag_mm: float = 0.1
    clamp_deg: float = np.inf
    cusp_distance_mm: float = 0.0
    wall_distance_mm: float = 0.0
    layer_distance_mm: float = 0.0

    def __post_init__(self) -> None:
        for entry in fields(self):
            if not getattr(self, entry.name) >= 0.0:
                raise ValueError(f"Tolerances.{entry.name} must not be negative")


def judge(valve: ValveVerification, tolerances: Tolerances) -> list[str]:
    """Why the result is not verified: one line with figures per failure, empty when it is.

    A figure that is not a number fails.
    """
    failures = []
    short = tolerances.inside_mm

    def demand(holds: bool, text: str) -> None:
        if not holds:
            failures.append(text)

    for index, cusp in enumerate(valve.cusps):
        rms = cusp.clamp_error_deg[1]
        for value, limit, what, unit in (
            (cusp.residual, tolerances.residual, "residual", ""),
            (cusp.suture_error_mm, tolerances.suture_mm, "sutured edge off its line by", " mm"),
            (rms, tolerances.clamp_deg, "clamp off its half-plane (rms) by", " degrees"),
            (cusp.outside_root_mm, tolerances.inside_mm, "outside the root by", " mm"),
            (cusp.outside_wedge_mm, tolerances.inside_mm, "beyond its contact wedge by", " mm"),
            (cusp.free_edge_sag_mm, tolerances.sag_mm, "free edge sags by", " mm"),
        ):
            text = f"cusp {index}: {what} {value:.3g}{unit}, allowed {limit:.3g}{unit}"
            demand(value <= limit, text)
        crossed = cusp.self_intersections
        demand(crossed == 0, f"cusp {index}: crosses itself in {crossed} pairs of triangles")
        apart, limit = cusp.closest_layers_mm, tolerances.layer_distance_mm - short
        text = f"cusp {index}: layers come within {apart:.3g} mm, required {limit:.3g} mm"
        demand(apart >= limit, text)
    crossed = valve.cusp_intersections
    demand(crossed == 0, f"valve: cusps cross each other in {crossed} pairs of triangles")
    for value, limit, what in (
        (valve.min_distance_mm, tolerances.cusp_distance_mm - 2.0 * short, "distance of cusps"),
        (valve.min_wall_distance_mm, tolerances.wall_distance_mm - short, "distance from the wall"),
    ):
        demand(value >= limit, f"valve: {what} {value:.3g} mm, required {limit:.3g} mm")
    return failures
