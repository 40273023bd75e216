"""Checkpoints: what comes back, and what counts as absent."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from avneo_fem.scene import Scene, parse_scene
from avneo_fem.stages.checkpoint import Checkpoint, CheckpointStore
from avneo_fem.stages.record import Snapshot, StageRecord


def checkpoint(seed: int = 0) -> Checkpoint:
    """Something with every kind of content."""
    random = np.random.default_rng(seed)
    points = random.normal(size=(4, 3))
    return Checkpoint(
        state=random.normal(size=17),
        directors=random.normal(size=(5, 3)),
        levels_done=7,
        penalty_stiffness=(32.0, 64.0, 1e4),
        clamp_reference=random.normal(size=3),
        wedge_clearance=random.normal(size=4),
        records=[StageRecord("boundary", 0.1, 12, "converged", 1e-5, 0.5, 2)],
        snapshots=[Snapshot("boundary", 0.1, points, {"wall_distance": points[:, 0]})],
        finished=True,
        residual=1e-9,
        failure="root_wall: why",
    )


def store(folder: Path, scene: Scene | None = None, version: str = "1") -> CheckpointStore:
    return CheckpointStore(folder / "checkpoints", scene or Scene(), version)


def test_round_trip(tmp_path: Path) -> None:
    """Truth: what was saved, bit for bit, by another store of the same scene; each cusp its own;
    the last save counts."""
    first, second = checkpoint(1), checkpoint(2)
    store(tmp_path).save(0, checkpoint(3))
    store(tmp_path).save(0, first)
    store(tmp_path).save(2, second)
    for index, saved in ((0, first), (2, second)):
        found = store(tmp_path).load(index)
        assert found is not None
        np.testing.assert_array_equal(found.state, saved.state)
        np.testing.assert_array_equal(found.directors, saved.directors)
        np.testing.assert_array_equal(found.clamp_reference, saved.clamp_reference)
        assert found.records == saved.records
        shot, original = found.snapshots[0], saved.snapshots[0]
        np.testing.assert_array_equal(shot.points, original.points)
        assert (shot.name, shot.parameter, set(shot.fields)) == ("boundary", 0.1, {"wall_distance"})
        for name in ("levels_done", "penalty_stiffness", "finished", "residual", "failure"):
            assert getattr(found, name) == getattr(saved, name)
    assert store(tmp_path).load(1) is None
    names = sorted(path.name for path in (tmp_path / "checkpoints").iterdir())
    assert names == ["cusp_0.checkpoint", "cusp_2.checkpoint"]


@pytest.mark.parametrize(
    "change",
    [
        {"diastolic_pressure": 8.000001},
        {"mesh": {"size": 0.71}},
        {"cusp": [{}, {"template": {"thickness": 0.4}}, {}]},
        {"name": "other"},
        {"fidelity": "fine"},
    ],
)
def test_another_scene_is_absent(tmp_path: Path, change: dict) -> None:
    """Truth: any other entry anywhere in the scene makes it another run; written-out defaults do
    not."""
    store(tmp_path).save(0, checkpoint())
    assert store(tmp_path, parse_scene(change)).load(0) is None
    assert store(tmp_path, parse_scene({"mesh": {"size": 0.7}})).load(0) is not None


def test_another_version_is_absent(tmp_path: Path) -> None:
    """Truth: a checkpoint of another version of the program is not gone on from."""
    store(tmp_path).save(0, checkpoint())
    assert store(tmp_path, version="2").load(0) is None


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"nonsense",
        b"\x80\x05\x95",
        b"\x80\x04K\x01.",  # a number
        b"cno_such_module\nname\n.",
        pickle.dumps(("key", "no checkpoint")),
        pickle.dumps([1, 2, 3]),
        np.random.default_rng(1).bytes(500),
    ],
)
def test_unreadable_is_absent(tmp_path: Path, content: bytes) -> None:
    """Truth: neither foreign bytes nor a foreign pickle are taken for a checkpoint, or raise."""
    saved = store(tmp_path)
    saved.save(0, checkpoint())
    saved.path(0).write_bytes(content)
    assert saved.load(0) is None


@pytest.mark.parametrize("share", [0.1, 0.5, 0.999])
def test_half_written_is_absent(tmp_path: Path, share: float) -> None:
    """Truth: a truncated file (a disk that lost its end) is not gone on from."""
    saved = store(tmp_path)
    saved.save(0, checkpoint())
    data = saved.path(0).read_bytes()
    saved.path(0).write_bytes(data[: int(share * len(data))])
    assert saved.load(0) is None


def test_right_key_but_no_checkpoint(tmp_path: Path) -> None:
    """Truth: the key alone does not make a checkpoint."""
    saved = store(tmp_path)
    saved.save(0, checkpoint())
    saved.path(0).write_bytes(pickle.dumps((saved.key, {"state": 1})))
    assert saved.load(0) is None


def test_a_failed_save_keeps_the_old_one(tmp_path: Path) -> None:
    """Truth: what cannot be pickled leaves the last checkpoint and no other file."""
    saved, first = store(tmp_path), checkpoint(1)
    saved.save(0, first)
    broken = checkpoint(2)
    broken.failure = lambda: None  # type: ignore[assignment]
    with pytest.raises((pickle.PicklingError, AttributeError)):
        saved.save(0, broken)
    found = saved.load(0)
    assert found is not None
    np.testing.assert_array_equal(found.state, first.state)
    assert [path.name for path in saved.folder.iterdir()] == ["cusp_0.checkpoint"]


def test_clear(tmp_path: Path) -> None:
    """Truth: all checkpoints go, with what a kill left of one, and the folder when it is empty;
    foreign files stay; a run without any is no error."""
    saved = store(tmp_path)
    saved.clear()
    assert not saved.folder.exists()
    for index in range(3):
        saved.save(index, checkpoint())
    (saved.folder / ".cusp_1-123-abcd.checkpoint").write_bytes(b"half")
    saved.clear()
    assert not saved.folder.exists()
    saved.save(1, checkpoint())
    (saved.folder / "notes.txt").write_text("mine")
    saved.clear()
    assert [path.name for path in saved.folder.iterdir()] == ["notes.txt"]
