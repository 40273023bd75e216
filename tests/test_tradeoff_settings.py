"""Settings of a study: the default ones, and what can be asked for."""

from __future__ import annotations

import pytest

from avneo_fem.errors import SceneError
from avneo_fem.scene import FIDELITIES, Scene, parse_scene
from avneo_fem.scene_overrides import overridden, parse_overrides
from avneo_fem.tradeoff.settings import (
    REFERENCE,
    SECOND_PATH,
    Setting,
    chosen_settings,
    default_settings,
    second_path,
)

DEFAULTS = default_settings(Scene())


def test_default_settings() -> None:
    """Truth: the four fidelities are there; every setting makes a scene, no two the same one, and
    no two share a folder."""
    names = [setting.name for setting in DEFAULTS]
    assert set(names) > set(FIDELITIES)
    scenes = [parse_scene(overridden({}, parse_overrides(s.overrides))) for s in DEFAULTS]
    assert all(a != b for k, a in enumerate(scenes) for b in scenes[:k])
    slugs = [setting.slug for setting in DEFAULTS]
    assert len(set(slugs)) == len(slugs)
    assert all(slug and "/" not in slug and " " not in slug for slug in slugs)


def test_changes_that_change_nothing_are_left_out() -> None:
    """Truth: a scene without bending has no variant without it, one that starts on its last mesh
    none that starts on a finer one."""
    plain = parse_scene({"material": {"bending": False}, "mesh": {"refinements": 0}})
    names = [setting.name for setting in default_settings(plain)]
    assert not [name for name in names if "bending" in name or "first mesh" in name]


@pytest.mark.parametrize(("size", "other"), [(0.7, 2), (3.0, 0), (7.0, 1)])
def test_second_path(size: float, other: int) -> None:
    """Truth: one refinement fewer (of 3 at h = 0.35, 1 at 1.5), or one where there is none."""
    scene = parse_scene({"fidelity": "reference", "mesh": {"size": size}})
    assert scene.refinements == {0.7: 3, 3.0: 1, 7.0: 0}[size]
    found = second_path(Setting(REFERENCE, ("fidelity=reference",)), scene)
    assert found == Setting(SECOND_PATH, ("fidelity=reference", f"mesh.refinements={other}"))


def test_chosen_settings() -> None:
    """Truth: by name or as entries, in the order asked for, with the reference always, and by
    entries of its own where they are given."""
    texts = ["standard", "mine: contact.steps=5  solver.quality=\"approximate\" x='a b'"]
    found = chosen_settings(texts, DEFAULTS)
    mine = Setting("mine", ("contact.steps=5", "solver.quality=approximate", "x=a b"))
    assert [setting.name for setting in found] == ["standard", "mine", REFERENCE]
    assert found[1] == mine
    assert [s.name for s in chosen_settings([REFERENCE], DEFAULTS)] == [REFERENCE]
    own = chosen_settings(["reference: mesh.size=0.5"], DEFAULTS)
    assert own == [Setting(REFERENCE, ("mesh.size=0.5",))]


@pytest.mark.parametrize(
    ("texts", "why"),
    [
        (["best"], "must be one of draft; standard; fine; reference; "),
        ([""], "must be one of"),
        (["draft: a=1"], "must be one of"),
        (["mine: a='1"], "broken quotes"),
        (["draft", "draft"], "once"),
        (["a b: x=1", "a-b: x=2"], "once"),
        (["?: x=1"], "with letters"),
        ([f"{SECOND_PATH}: x=1"], "choose another name"),
    ],
)
def test_bad_settings(texts: list[str], why: str) -> None:
    """Truth: an unknown name, broken quotes and two settings of one folder are bad input."""
    with pytest.raises(SceneError, match=why) as caught:
        chosen_settings(texts, DEFAULTS)
    assert caught.value.key == "--settings"
