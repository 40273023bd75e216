"""Settings that a study compares: a name, and entries of the scene."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass

from avneo_fem.errors import SceneError
from avneo_fem.scene import FIDELITIES, Scene

__all__ = [
    "REFERENCE",
    "SECOND_PATH",
    "Setting",
    "chosen_settings",
    "default_settings",
    "second_path",
]

#: What the others are measured against, and the same reached another way.
REFERENCE, SECOND_PATH = "reference", "reference, second path"


@dataclass(frozen=True)
class Setting:
    """One setting of a study.

    Attributes
    ----------
    name : str
    overrides : tuple of str
        ``KEY=VALUE`` each, as ``--set`` takes them.
    """

    name: str
    overrides: tuple[str, ...]

    @property
    def slug(self) -> str:
        """The name as that of a folder."""
        return re.sub(r"[^A-Za-z0-9.]+", "-", self.name).strip("-.").lower()


def _fidelity(name: str) -> Setting:
    return Setting(name, (f"fidelity={name}",))


def second_path(reference: Setting, scene: Scene) -> Setting:
    """The reference from another first mesh: as fine, but another triangulation and way there.

    One refinement fewer than the reference's ``scene``, or one more where it has none.
    """
    usual = scene.refinements
    other = usual - 1 if usual else 1
    return Setting(SECOND_PATH, (*reference.overrides, f"mesh.refinements={other}"))


def default_settings(standard: Scene) -> list[Setting]:
    """The four fidelities, and one change of them at a time.

    Parameters
    ----------
    standard : Scene
        The scene at fidelity ``standard``: a change that makes no difference to it is left out.
    """
    fewer = max(standard.refinements - 1, 0)
    variants = [
        Setting("standard, approximate", ("fidelity=standard", "solver.quality=approximate")),
        Setting("fine, approximate", ("fidelity=fine", "solver.quality=approximate")),
        Setting("draft, equilibrium", ("fidelity=draft", "solver.quality=equilibrium")),
        Setting("draft, coarser", ("fidelity=draft", f"mesh.size={1.4 * standard.mesh.size:.6g}")),
        Setting(
            "standard, half the boundary steps", ("fidelity=standard", "solver.boundary_steps=10")
        ),
        Setting("standard, half the lambda steps", ("fidelity=standard", "contact.steps=5")),
        Setting("standard, path tolerance 0.1", ("fidelity=standard", "solver.path_tolerance=0.1")),
        Setting("standard, no bending", ("fidelity=standard", "material.bending=false")),
        Setting("standard, finer first mesh", ("fidelity=standard", f"mesh.refinements={fewer}")),
    ]
    if not standard.material.bending:
        variants = [v for v in variants if "material.bending=false" not in v.overrides]
    if not standard.refinements:
        variants = [v for v in variants if not v.overrides[-1].startswith("mesh.refinements")]
    return [*map(_fidelity, FIDELITIES), *variants]


def chosen_settings(texts: Sequence[str], defaults: Sequence[Setting]) -> list[Setting]:
    """The settings that were asked for, and the reference.

    Parameters
    ----------
    texts : sequence of str
        Each the name of a default setting, or ``NAME: KEY=VALUE KEY=VALUE ...`` for one's own;
        values with spaces in quotes. ``reference: KEY=VALUE ...`` measures against that instead.
    defaults : sequence of Setting

    Raises
    ------
    SceneError
        For a name that is none of the defaults', or the same name twice.
    """
    known = {setting.name: setting for setting in defaults}
    wanted = []
    for text in texts:
        name, colon, entries = (part.strip() for part in text.partition(":"))
        if colon and name and (name not in known or name == REFERENCE):
            try:
                wanted.append(Setting(name, tuple(shlex.split(entries))))
            except ValueError as error:
                raise SceneError("--settings", text, f"has broken quotes ({error})") from None
        elif not colon and name in known:
            wanted.append(known[name])
        else:
            raise SceneError(
                "--settings",
                text,
                f"must be one of {'; '.join(known)}; or a new name, a colon and KEY=VALUE ...",
            )
    if REFERENCE not in [setting.name for setting in wanted]:
        wanted.append(known[REFERENCE])
    slugs = [setting.slug for setting in wanted]
    for setting in wanted:
        if setting.name == SECOND_PATH:
            raise SceneError("--settings", setting.name, "is run anyway; choose another name")
        if not setting.slug or slugs.count(setting.slug) > 1:
            raise SceneError("--settings", setting.name, "must be given once, and with letters")
    return wanted
