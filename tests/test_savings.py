"""What is not asked for or does not act yet is neither built nor asked; what a search leaves out
changes no answer. (Congruent cusps: test_congruence; one cusp alone: test_suture_valve.)"""

from __future__ import annotations

import tomllib
from collections import Counter
from typing import Any
from unittest import mock

import numpy as np
import pytest

from avneo_fem.constraints import layer_clearance, layer_pairs
from avneo_fem.constraints.layer_clearance import LayerClearance
from avneo_fem.constraints.pair_distance import pair_distance
from avneo_fem.equilibrium import shell_model
from avneo_fem.geometry.bezier_arcs import CUTS, BezierArcs
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.scene import load_scene, parse_scene
from avneo_fem.stages.suturing import CuspSuturing
from layer_cases import THICKNESS, fold, strip
from meshes import disc
from run_cases import SMALL
from savings import FIRST, Row, all_arcs, calls_by_stage, too_early
from shell_cases import shell
from test_suturing import set_up
from valve_cases import DEMOS


@pytest.mark.parametrize(("bending", "forms"), [(False, 0), (True, 3)])
def test_bending_forms(bending: bool, forms: int) -> None:
    """Truth: directors appear in energy, residual and tangent of a shell, and in no form of a
    membrane, for which no bending density is made, either: of four compiled forms each."""
    compiled: list[Any] = []
    compile_form = shell_model.compat.compile_form

    def compiling(form: Any) -> Any:
        compiled.append(form)
        return compile_form(form)

    with (
        mock.patch.object(shell_model.compat, "compile_form", compiling),
        mock.patch.object(
            shell_model, "bending_energy_density", wraps=shell_model.bending_energy_density
        ) as energy,
        mock.patch.object(
            shell_model, "bending_force_density", wraps=shell_model.bending_force_density
        ) as force,
    ):
        model = shell(disc(2), bending=bending)
    assert len(compiled) == 4
    state = model.space.ufl_element()
    foreign = [
        [c for c in form.coefficients() if c.ufl_function_space().ufl_element() != state]
        for form in compiled
    ]
    assert sum(bool(others) for others in foreign) == forms
    assert (energy.call_count, force.call_count) == (bending, bending)


@pytest.fixture(scope="module")
def stages() -> dict[str, Counter[str]]:
    """Calls in each stage of the small scene's first cusp."""
    scene = tomllib.loads(SMALL)
    scene["contact"]["steps"], scene["solver"]["clamp_steps"] = 2, 1
    found, result = calls_by_stage(ValveInput.from_scene(parse_scene(scene)))
    assert result.failure is None
    return found


def test_terms_before_their_stage(stages: dict[str, Counter[str]]) -> None:
    """Truth: design.md §3: wall from the hinged edge on, clamp from the clamped edge on, wedge from
    its own stage on, layers when penalties are raised; not one call before, and from then on as
    many as the shell has."""
    names = list(stages)
    assert names == [
        "placement",
        "boundary",
        "hinged_edge",
        "clamped_edge",
        "contact_wedge",
        "first_row",
        "root_wall",
        "equilibrium",
    ]
    for term, first in {**FIRST, "layers": "root_wall"}.items():
        place = names.index(first)
        assert [stages[name][term] for name in names[:place]] == [0] * place
        assert all(stages[name][term] > 0 for name in names[place:])
    for name in names[names.index("clamped_edge") :]:
        assert stages[name]["clamp"] == stages[name]["barrier"] == stages[name]["shell"]
        assert stages[name]["wall"] == stages[name]["shell"]


def test_distances_of_a_wedge_that_does_not_act(stages: dict[str, Counter[str]]) -> None:
    """Truth: before its stage the wedge's distance is computed once a level, for the results
    (and, by the set-up, for the room next to the commissures, before the first)."""
    for name in ("boundary", "hinged_edge", "clamped_edge"):
        assert stages[name]["wedge's distances"] == stages[name]["levels"]
    assert stages["boundary"]["shell"] > 10 * stages["boundary"]["levels"]


def test_too_early_is_told(stages: dict[str, Counter[str]]) -> None:
    """Truth: one call of the wedge while the edge is clamped is found; none is there."""
    assert too_early(stages) == []
    wrong = {name: Counter(calls) for name, calls in stages.items()}
    wrong["clamped_edge"]["wedge"] += 1
    assert too_early(wrong) == ["wedge in clamped_edge"]


def test_layers_are_made_when_asked() -> None:
    """Truth: a set-up makes no table of layers; a search that is asked for is made once."""
    with mock.patch.object(layer_clearance, "LayerPairs", wraps=layer_clearance.LayerPairs) as made:
        setup = set_up()
        assert made.call_count == 0
        for _ in range(2):
            setup.layers.energy(setup.start)
        assert made.call_count == 1


@pytest.mark.parametrize("clearance", [THICKNESS, 0.0])
def test_no_clearance_of_layers(clearance: float) -> None:
    """Truth: a strip folded to a tenth of its thickness: with a clearance pairs act; without, the
    distance of not one pair is computed, in the template or in space, and nothing acts."""
    mesh, pairs, asked = strip(), [], clearance > 0
    points = fold(mesh, THICKNESS / 10)

    def looking(corners: Any, is_edges: bool) -> Any:
        pairs.append(len(corners))
        return pair_distance(corners, is_edges)

    with (
        mock.patch.object(layer_clearance, "pair_distance", looking),
        mock.patch.object(layer_pairs, "pair_distance", looking),
    ):
        term = LayerClearance(mesh, THICKNESS, clearance, 1.0, 16.0, 0.1)
        gradient, hessian = term.gradient(points), term.hessian(points)
    assert (sum(pairs) > 0) is asked
    assert (term.active(points) > 0) is asked
    assert bool(np.abs(gradient).max() > 0) is asked
    assert (hessian.nnz > 0) is asked


class Stop(Exception):
    """Far enough."""


@pytest.mark.parametrize(("layers", "adds"), [({"clearance": 0.0}, False), ({}, True)])
def test_no_clearance_no_term(layers: dict[str, float], adds: bool) -> None:
    """Truth: where penalties are raised, layers.clearance = 0 adds no term to what is solved; by
    default one is added."""
    setup = set_up(layers=layers)
    suturing = CuspSuturing(setup, lambda _index, _record: None)
    suturing.levels.clear()  # right to the end
    with mock.patch.object(setup.relaxation, "settle", side_effect=Stop), pytest.raises(Stop):
        suturing.run()
    assert (setup.layers in setup.system.terms) is adds


@pytest.mark.parametrize("lam", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("number", [1, 2, 3])
def test_arcs_that_are_left_out(number: int, lam: float) -> None:
    """Truth: the quintics of all arcs give the same distances, gradients and Hessians; fewer than a
    quarter of them are solved for points all over the root."""
    given = ValveInput.from_scene(load_scene(DEMOS / f"experiment_{number}.toml"))
    field = given.wedges.wedge(0, lam)
    points = np.random.default_rng(number).uniform(-11.0, 11.0, (500, 3))
    solved: list[int] = []
    candidates = BezierArcs.candidates

    def counting(arcs: BezierArcs, *place: Any) -> Any:
        pairs = candidates(arcs, *place)
        solved.append(len(pairs[0]))
        return pairs

    with mock.patch.object(BezierArcs, "candidates", counting):
        found = field.evaluate(points)
    with all_arcs():
        brute = field.evaluate(points)
    for one, two in zip(found, brute, strict=True):
        np.testing.assert_allclose(one, two, rtol=0, atol=1e-10)
    assert solved[0] < 0.25 * 2 * CUTS * len(points)


def test_a_missed_comparison_is_told() -> None:
    """Truth: the ratio is the cost over that without; what does not agree is marked in the line."""
    row = Row("x", "ms", 1.0, 4.0, "nodes agree to 1 mm", False)
    assert row.line == "| x | ms | 1 | 4 | 0.25 | **missed:** nodes agree to 1 mm |"
    assert Row("x", "ms", 1.0, 3.0).line == "| x | ms | 1 | 3 | 0.33 |  |"
