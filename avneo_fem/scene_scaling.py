"""The same scene in other units: every length, stress and force of it multiplied."""

from __future__ import annotations

import re
from typing import Any

from avneo_fem.errors import SceneError
from avneo_fem.scene_fields import entry_schema
from avneo_fem.scene_schema import Scene

__all__ = ["scaled_scene", "unit_of"]

_UNIT = re.compile(r"\[(mm|kPa|mN|degrees)\]")


def unit_of(schema: dict[str, Any]) -> str:
    """Unit of a scene entry as its description states it; "" for a pure number."""
    found = _UNIT.search(schema.get("description", ""))
    return found.group(1) if found else ""


def _spelled_out(scene: Scene) -> dict[str, Any]:
    """The scene's entries with the defaults that follow from H and h as numbers.

    They are written out, so that a scaled scene states every length it uses.

    Raises
    ------
    SceneError
        When the cusps differ in thickness: such a default is then no single number.
    """
    thickness = {cusp.template.thickness for cusp in scene.cusp}
    if len(thickness) > 1:
        raise SceneError("template.thickness", sorted(thickness), "must be the same for all cusps")
    h = thickness.pop()
    data = scene.model_dump(mode="json")
    for table, key, value in (
        ("contact", "clearance", h / 2),
        ("wall", "clearance", h / 2),
        ("wall", "taper", scene.wall_taper(h)),
        ("layers", "clearance", scene.layer_clearance(h)),
        ("layers", "unrestricted", scene.layers_unrestricted(h)),
        ("solver", "barrier_distance", min(0.3 * h, 0.2 * scene.mesh_size)),
        ("solver", "inside_tolerance", scene.inside_tolerance(h)),
        ("mesh", "refinements", scene.refinements),
    ):
        if data[table][key] is None:
            data[table][key] = value
    return data


def _scaled(data: Any, path: tuple[str | int, ...], factors: dict[str, float]) -> Any:
    if isinstance(data, dict):
        return {key: _scaled(value, (*path, key), factors) for key, value in data.items()}
    if isinstance(data, list):
        return [_scaled(value, (*path, i), factors) for i, value in enumerate(data)]
    factor = factors.get(unit_of(entry_schema(path) or {}), 1.0)
    return data if data is None or factor == 1.0 else data * factor


def scaled_scene(scene: Scene, length: float = 1.0, stress: float = 1.0) -> dict[str, Any]:
    """Scene whose lengths, stresses and forces are those of ``scene`` times constants.

    All entries are stated, none left to its default, so its valve is that of ``scene`` with all
    positions times ``length``: nothing in the method knows a millimetre.

    Parameters
    ----------
    scene : Scene
        Cusps of one thickness.
    length, stress : float
        Factors of what is in mm and in kPa; what is in mN grows by stress times length squared.

    Returns
    -------
    dict
        What :func:`avneo_fem.scene.parse_scene` takes and a TOML file holds.

    Raises
    ------
    SceneError
        When the cusps differ in thickness.
    """
    factors = {"mm": length, "kPa": stress, "mN": stress * length**2}
    data = _scaled(_spelled_out(scene), (), factors)
    return {
        key: {name: item for name, item in value.items() if item is not None}
        if isinstance(value, dict)
        else value
        for key, value in data.items()
    }
