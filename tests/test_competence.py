"""The verdict on competence, on the paper's experiments and by following its own advice."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.errors import SceneError
from avneo_fem.geometry.competence import range_text
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


def test_policy_error_is_one_readable_line() -> None:
    """Truth: the reason, the cusp at fault and lengths that would do, and the way out."""
    with pytest.raises(SceneError) as caught:
        build({**SCENES[2], "competence": {"policy": "error"}})
    text = str(caught.value)
    assert len(text) < 600
    for words in (
        "cusp 1 is too small for cusps 0 and 2",
        "no common factor helps",
        '"warn" would',
    ):
        assert words in text


def test_advice_for_one_cusp_works() -> None:
    """Truth: either end of each range advised for Experiment 2 makes its valve competent; half a
    millimetre beyond does not."""
    reason = experiment(2, "code").competence_reason.split("changed alone, ")[1]
    for index, radius in ((0, 13.0), (2, 11.0)):
        words = reason.split(f"cusp {index} of ")[1].split(" mm")[0]
        low, high = (float(x) for x in words.split(" to "))
        for length, good in ((low, True), (high, True), (low - 0.5, False), (high + 0.5, False)):
            cusps = [{"template": dict(cusp["template"])} for cusp in SCENES[2]["cusp"]]
            cusps[index]["template"] = {"free_edge_length": length, "belly_radius": radius}
            assert build({**SCENES[2], "cusp": cusps}).competent is good
    assert "cusp 1" not in reason  # no length of cusp 1 alone would do


def test_the_cusp_at_fault_is_named() -> None:
    """Truth: of Experiment 3's cusps, cusp 1 shortened by a tenth is the shortest for its chord of
    15.871 mm; equal cusps on equal chords have none at fault."""
    data = quasi_optimal(0.95)
    data["cusp"][1]["template"]["free_edge_length"] *= 0.9
    data["competence"] = {"maximum_nu": 1.0}
    length = data["cusp"][1]["template"]["free_edge_length"]
    reason = build(data).competence_reason
    assert (
        "too small to close, shortest for its chord is cusp 1 with free_edge_length ="
        f" {length:.4g} mm = {length / 15.8711:.4g} a_1"
    ) in reason
    alike = build({"competence": {"minimum_nu": 0.7}}).competence_reason
    assert (
        "too large; all free_edge_length times 0.6153 give nu* = 1 (23.99, 23.99, 23.99 mm)"
        in alike
    )


def test_a_common_factor_that_would_do() -> None:
    """Truth: nu*/nu_max and nu*/nu_min for Experiment 1, nu* = 12 cos(1/48) / 19.5 = 0.615251."""
    reason = build({"competence": {"minimum_nu": 0.7}}).competence_reason
    assert "times 0.58596 to 0.87893 would do" in reason


def test_range_text() -> None:
    """Truth: rounded inwards, so that both ends written are within; in full where too narrow."""
    assert range_text(None) == "none"
    assert range_text((22.853001, 47.98899)) == "22.854 to 47.988"
    assert range_text((22.853001, 47.98899), 4, "-") == "22.86-47.98"
    assert range_text((0.0228531, 0.0479899)) == "0.022854 to 0.047989"
    assert range_text((12344.1, 23400.0)) == "12345 to 23400"
    assert range_text((21.03, 48.2), 4) == "21.03 to 48.20"
    assert range_text((22.8531, 22.8532)) == "22.853100000000001 to 22.853200000000001"
