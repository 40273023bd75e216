"""The verdict on competence, on the paper's experiments and by following its own advice."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.errors import SceneError
from valve_cases import SCENES, build, experiment, quasi_optimal


def test_competent_and_not() -> None:
    """Truth: Experiments 1 and 3 are competent, 2 falls in case 1 on A_0A_2 (design.md)."""
    assert experiment(1, "code").competent
    assert experiment(3, "code").competent
    valve = experiment(2, "code")
    assert not valve.competent
    assert (valve.triple_contact.case, valve.triple_contact.edge_index) == ("edge", 1)
    assert "A_0A_2" in valve.competence_reason
    assert "0.6031" in valve.competence_reason


def test_advice_for_case_1_works() -> None:
    """Truth: shortening cusps 0 and 2 of Experiment 2 as advised makes (3.2) solvable, not less."""
    reason = experiment(2, "code").competence_reason
    excess = float(reason.split("shorter by ")[1].split(" mm")[0])
    for factor, case in ((1.001, "interior"), (0.999, "edge")):
        lengths = np.array([58.5, 39.0, 48.75]) - factor * excess * np.array([1.0, 0.0, 1.0])
        cusps = [
            {"template": {"free_edge_length": float(x), "belly_radius": 16.0}} for x in lengths
        ]
        assert build({**SCENES[2], "cusp": cusps}).triple_contact.case == case


@pytest.mark.parametrize(("scale", "words"), [(0.9, "too small to close"), (2.2, "too large")])
def test_advice_for_dilation_works(scale: float, words: str) -> None:
    """Truth: nu* out of its limits is reported; all L_f times the given factor give nu* = 1."""
    data = quasi_optimal(scale)
    if scale < 1.0:  # small cusps: a smaller root so that the stitching ratio stays in range
        for cusp in data["cusp"]:
            cusp["template"]["corner_height"] = 16.0
    data["stitching"] = {"gather_ratio": 6.0}
    valve = build(data)
    assert not valve.competent
    assert words in valve.competence_reason
    factor = float(valve.competence_reason.split("times ")[1].split(" ")[0])
    for cusp in data["cusp"]:
        cusp["template"]["free_edge_length"] *= factor
        cusp["template"]["belly_radius"] *= factor  # so that the template still exists
    assert build(data).triple_contact.nu_star == pytest.approx(1.0, abs=1e-3)
    wide = {"minimum_nu": 0.01, "maximum_nu": 100.0}
    assert build({**data, "competence": wide}).competent


def test_policy_error() -> None:
    """Truth: with policy "error" a valve that is not competent is refused with the reason."""
    with pytest.raises(SceneError, match="A_0A_2") as caught:
        build({**SCENES[2], "competence": {"policy": "error"}})
    assert caught.value.key == "competence.policy"
    assert build({"competence": {"policy": "error"}}).competent
