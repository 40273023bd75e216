"""The picture of the valve: what is where in it, by parallel projection."""

from __future__ import annotations

import colorsys
import ctypes

import numpy as np
import pytest
from matplotlib.image import imread

from avneo_fem.results.drawing import Drawing
from avneo_fem.results.pictures import Panel, PictureError, draw_grid, draw_valve

RADIUS = 12.0
SIZE = (1000, 350)
HUES = {"orange": 37, "blue": 202, "green": 147, "red": 0, "bright green": 120}


def cusp(index: int, n: int = 30) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A pocket from the axis to an elliptic suture line, about the angle 180° + 120° index."""
    s, v = np.meshgrid(np.linspace(-1.0, 1.0, n), np.linspace(0.0, 1.0, n))
    angle = np.pi + 2.0 * np.pi / 3.0 * index + s * (np.pi / 3.0 - 0.04)
    depth = -12.0 * np.sqrt(np.clip(1.0 - s**2, 0.0, 1.0)) * (1.0 - v)
    radius = RADIUS * (1.0 - v * np.sqrt(np.clip(1.0 - s**4, 0.0, 1.0)))
    depth += 0.4 * np.sin(18.0 * s) * np.sin(np.pi * v)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), depth], axis=-1)
    node = np.arange(n * n).reshape(n, n)
    a, b, c, d = (q.ravel() for q in (node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]))
    triangles = np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return points.reshape(-1, 3), triangles, points[0]


@pytest.fixture(scope="module")
def picture(tmp_path_factory) -> np.ndarray:
    """The drawn valve, pixels (rows, columns, 3) in 0 … 1."""
    path = tmp_path_factory.mktemp("picture") / "valve.png"
    cusps = [cusp(index) for index in range(3)]
    angle = 2.0 * np.pi / 3.0 * np.arange(3)
    commissures = RADIUS * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    draw_valve(
        path,
        [(points, triangles) for points, triangles, _ in cusps],
        RADIUS,
        [line for *_, line in cusps],
        commissures,
        triple_contact_point=np.array([0.0, 0.0, 0.5]),
        title="test",
        size=SIZE,
    )
    assert [file.name for file in path.parent.iterdir()] == ["valve.png"]
    return imread(path)[..., :3]


def at(picture: np.ndarray, view: int, x: float, y: float) -> str:
    """Name of the colour nearest in hue where (x, y) [mm] is in view 0 (aorta) or 1."""
    column = SIZE[0] / (3.0 + 0.33)
    scale = SIZE[1] / (2.0 * 1.3 * RADIUS)  # pixels per mm
    across = column * (view + 0.5) + (scale * x if view == 0 else -scale * x)
    red, green, blue = picture[round(SIZE[1] / 2.0 - scale * y), round(across)]
    hue = colorsys.rgb_to_hls(red, green, blue)[0]
    if max(red, green, blue) - min(red, green, blue) < 0.05:
        return "grey"
    return min(HUES, key=lambda name: abs((360.0 * hue - HUES[name] + 180.0) % 360.0 - 180.0))


@pytest.mark.parametrize("view", [0, 1])
def test_each_cusp_is_where_it_should_be(picture, view):
    """Truth: cusp i lies about 180° + 120° i; seen from the ventricle left and right swap."""
    for index, colour in enumerate(("orange", "blue", "green")):
        angle = np.pi + 2.0 * np.pi / 3.0 * index
        for turn in (-0.6, -0.2, 0.2, 0.6):
            x, y = 7.0 * np.cos(angle + turn), 7.0 * np.sin(angle + turn)
            assert at(picture, view, x, y) == colour, (view, index, turn)


def test_commissures_and_triple_contact_point(picture):
    """Truth: red at the commissures, seen from the aorta; bright green on the axis."""
    for angle in (0.0, 2.0 * np.pi / 3.0, 4.0 * np.pi / 3.0):
        assert at(picture, 0, RADIUS * np.cos(angle), RADIUS * np.sin(angle)) == "red"
    assert at(picture, 0, 0.0, 0.0) == "bright green"


def test_background_is_white_and_labels_are_there(picture):
    """Truth: the corners are white; dark text below each view and in the legend."""
    assert picture.shape == (SIZE[1], SIZE[0], 3)
    for row, column in ((0, 0), (0, -1), (-1, 0), (-1, -1)):
        assert (picture[row, column] == 1.0).all()
    column = SIZE[0] / 3.33
    dark = picture.max(axis=2) < 0.4
    for view in range(3):
        assert dark[-30:, int(view * column) : int((view + 1) * column)].sum() > 30
    assert dark[:, int(3.0 * column) :].sum() > 100


def test_root_is_translucent(picture):
    """Truth: the side view shows the wall's reddish tint on white, which no cusp has."""
    column = SIZE[0] / 3.33
    side = picture[:, int(2.0 * column) : int(3.0 * column)]
    tint = (side.min(axis=2) > 0.8) & (side[..., 0] - side[..., 1] > 0.02)
    assert tint.mean() > 0.05


def test_machine_without_egl_is_a_clear_error(tmp_path, monkeypatch):
    """Truth: with no display and no libEGL there is one line naming the package, and no file."""

    def missing(name: str) -> None:
        raise OSError(f"{name}: cannot open shared object file")

    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(ctypes, "CDLL", missing)
    points, triangles, line = cusp(0, 5)
    with pytest.raises(PictureError, match="libegl1"):
        draw_valve(tmp_path / "valve.png", [(points, triangles)], RADIUS, [line], points[:3])
    assert list(tmp_path.iterdir()) == []


def test_grid_of_valves(tmp_path):
    """Truth: every valve is in its own field, seen as asked; an empty field is white; cusp 0 lies
    left of the axis from the aorta, right of it from the ventricle."""
    points, triangles, line = cusp(0)
    drawing = Drawing([(points, triangles)], RADIUS, [line], points[:3], None, ())
    above, below = (Panel(drawing, f"from the {name}", name) for name in ("aorta", "ventricle"))
    draw_grid(tmp_path / "grid.png", [[above, None], [None, below]], field=(300, 300))
    found = imread(tmp_path / "grid.png")[..., :3]
    assert found.shape == (600, 600, 3)
    assert (found[:300, 300:] == 1.0).all()
    assert (found[300:, :300] == 1.0).all()
    hue = np.array([[colorsys.rgb_to_hls(*pixel)[0] for pixel in row] for row in found[::5, ::5]])
    vivid = np.ptp(found[::5, ::5], axis=2) > 0.4
    orange = vivid & (np.abs(360.0 * hue - HUES["orange"]) < 12.0)
    assert orange[:60, :30].sum() > 5 * orange[:60, 30:60].sum()
    assert orange[60:, 90:].sum() > 5 * orange[60:, 60:90].sum()
    assert orange[:60, :30].sum() > 100


@pytest.mark.parametrize("widths", [(), (0,), (1, 2)])
def test_grid_must_be_one(tmp_path, widths):
    """Truth: no rows, empty rows and rows of different lengths are refused, and leave no file."""
    with pytest.raises(ValueError, match="one length"):
        draw_grid(tmp_path / "grid.png", [[None] * width for width in widths])
    assert list(tmp_path.iterdir()) == []
