"""The report of a run: what was asked for, what came out, and whether it was verified."""

from __future__ import annotations

import json
import math
import resource
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from avneo_fem import __version__
from avneo_fem.geometry.contact_wedge import ContactWedgeFamily
from avneo_fem.geometry.resizing import Resizing
from avneo_fem.geometry.valve_geometry import ValveGeometry
from avneo_fem.results.verdict import ValveVerification
from avneo_fem.results.writing import written_whole
from avneo_fem.scene import Scene
from avneo_fem.stages.record import CuspResult

__all__ = ["build_report", "geometry_report", "sizing_report", "to_json", "write_report"]


def geometry_report(geometry: ValveGeometry, wedges: ContactWedgeFamily) -> dict[str, Any]:
    """The ``geometry`` part of the report (design.md §2); also what ``avneo check`` prints."""
    plane, triple, cusps = geometry.commissures, geometry.triple_contact, geometry.cusps
    return {
        "commissures": plane.points.tolist(),
        "normal": plane.normal.tolist(),
        "circumradius": float(plane.circumradius),
        "chord_lengths": plane.chord_lengths.tolist(),
        "commissure_lengths": geometry.commissure_lengths.tolist(),
        "contact_lengths": geometry.contact_lengths.tolist(),
        "triple_contact_point": triple.point.tolist(),
        "nu_star": float(triple.nu_star),
        "triple_point_case": triple.case,
        "competent": geometry.competent,
        "competence_reason": geometry.competence_reason,
        "free_edge_advice": asdict(geometry.verdict.advice),
        "asl_length": [float(cusp.suture_line.length) for cusp in cusps],
        "csl_length": [float(cusp.template.suture_length) for cusp in cusps],
        "stitching_ratio": [float(cusp.stitching.stitching_ratio) for cusp in cusps],
        "contact_method": wedges.method,
        "sigma": None if wedges.sigma is None else wedges.sigma.tolist(),
    }


def sizing_report(sizes: Resizing) -> dict[str, Any]:
    """What ``avneo size`` prints: lengths in mm, per cusp."""
    rebuilt = sizes.rebuilt
    return {
        "chord_lengths": sizes.chord_lengths.tolist(),
        "present": {
            "free_edge_length": sizes.present.tolist(),
            "belly_radius": sizes.present_radii.tolist(),
            "nu_star": sizes.present_nu,
            "problem": sizes.present_problem,
        },
        "quasi_optimal": {
            "free_edge_length": sizes.quasi_optimal.tolist(),
            "change": (sizes.quasi_optimal - sizes.present).tolist(),
            "belly_radius": sizes.radii.tolist(),
            "stitching_ratio": [float(cusp.stitching.stitching_ratio) for cusp in rebuilt.cusps],
            "nu_star": float(rebuilt.triple_contact.nu_star),
            "competent": rebuilt.competent,
            "competence_reason": rebuilt.competence_reason,
        },
        "free_edge_length_for_nu_1": sizes.closing.tolist(),
        "verified": sizes.verified,
    }


def build_report(
    scene: Scene,
    geometry: dict[str, Any],
    results: list[CuspResult],
    verification: ValveVerification,
    failures: list[str],
    seconds: float,
    ranks: int,
    versions: dict[str, str],
) -> dict[str, Any]:
    """Assemble report.json (keys as in design.md §2)."""
    cusps = []
    for result, measured in zip(results, verification.cusps, strict=True):
        largest, rms = measured.clamp_error_deg
        cusps.append(
            {
                "index": result.index,
                "cells": len(result.mesh.triangles),
                "nodes": len(result.mesh.points),
                "dofs": result.dofs,
                "stages": [asdict(record) for record in result.records],
                **asdict(measured),
                "clamp_error_deg": {"largest": largest, "rms": rms},
                "energy_mn_mm": result.energy,
                "condition": result.condition,
                "failure": result.failure,
                "copied_from": result.copied_from,
            }
        )
    compile_seconds = max(result.compile_seconds for result in results)
    return {
        "scene": {"name": scene.name, **scene.model_dump(mode="json")},
        "versions": {"avneo_fem": __version__, **versions},
        "fidelity": scene.fidelity,
        "mesh_size_mm": scene.mesh_size,
        "verified": not failures,
        "failures": failures,
        "geometry": geometry,
        "cusps": cusps,
        "valve": {
            "cusp_intersections": verification.cusp_intersections,
            "min_distance_mm": verification.min_distance_mm,
            "min_wall_distance_mm": verification.min_wall_distance_mm,
        },
        "timing": {
            "total_s": seconds,
            "jit_s": compile_seconds,
            "solve_s": sum(result.seconds for result in results),
            **_shares(results),
            "peak_rss_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
            "ranks": ranks,
        },
    }


def _shares(results: list[CuspResult]) -> dict[str, float]:
    """Seconds of ``solve_s`` by what was done, copied cusps apart."""
    total: dict[str, float] = {}
    for result in results:
        if result.copied_from is None:
            for name, seconds in result.shares.items():
                total[f"{name}_s"] = total.get(f"{name}_s", 0.0) + seconds
    return total


def _plain(value: Any) -> Any:
    """JSON has no NaN or infinity: they become null."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def to_json(report: dict[str, Any]) -> str:
    """Report as JSON text."""
    return json.dumps(_plain(report), indent=2) + "\n"


def write_report(path: Path, report: dict[str, Any]) -> None:
    """Write report.json, whole or not at all."""
    with written_whole(path) as temporary:
        temporary.write_text(to_json(report), encoding="utf-8")
