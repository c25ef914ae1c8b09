"""Clips as tensors: what is in them, and that resizing keeps the geometry."""

from pathlib import Path

import numpy as np
import pytest
import torch
from torch.utils.data import DataLoader

from perpetua.errors import InputError, SequenceFormatError
from perpetua.formats.config import OUTPUTS
from perpetua.formats.reader import Sequence, read_sequence
from perpetua.formats.resize import PixelCentreResize
from perpetua.formats.torch_dataset import Clip, SequenceDataset
from perpetua.scene.scene import Scene
from perpetua.testing.synthetic_sequence import write_scene

FRAMES, VIEWS, WIDTH_PX, HEIGHT_PX, TRACKS = 6, 3, 96, 72, 200


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Scene, Sequence]:
    folder = tmp_path_factory.mktemp("train") / "seed5-room0000"
    scene, _ = write_scene(folder)
    return folder, scene, read_sequence(folder)


def test_a_whole_clip_is_the_sequence(made: tuple[Path, Scene, Sequence]) -> None:
    folder, _, sequence = made
    clip = SequenceDataset([folder])[0]
    assert clip.name == folder.name
    assert clip.images.shape == (VIEWS, FRAMES, 3, HEIGHT_PX, WIDTH_PX) and clip.images.dtype == torch.uint8
    for index, view in enumerate(sequence.views):
        assert view.depth_m is not None and view.foreground is not None
        np.testing.assert_array_equal(clip.images[index, 4].permute(1, 2, 0).numpy(), view.image(4))
        np.testing.assert_array_equal(clip.depth_m[index].numpy(), view.depth_m)
        np.testing.assert_array_equal(clip.foreground[index].numpy(), view.foreground)
        np.testing.assert_array_equal(clip.camera_from_world[index].numpy(), view.camera_from_world)
        np.testing.assert_array_equal(clip.visible[index].numpy(), view.visible)
        fx, fy, cx, cy = view.intrinsics_px.tolist()
        assert clip.intrinsics_px[index].tolist() == [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]
    np.testing.assert_array_equal(clip.tracks_m.numpy(), sequence.tracks_m)
    np.testing.assert_array_equal(clip.queries_xytv.numpy(), sequence.queries_xytv)


def _at_queries(clip: Clip) -> tuple[np.ndarray, np.ndarray]:
    """Which tracks have a query, and the (view, frame, track) of each."""
    asked = np.flatnonzero(np.isfinite(clip.queries_xytv.numpy()).all(axis=1))
    _, _, frame, view = clip.queries_xytv.numpy()[asked].T
    return asked, np.stack([view.astype(int), frame.astype(int), asked])


def test_subsets_of_views_and_frames_hold_what_was_asked(made: tuple[Path, Scene, Sequence]) -> None:
    folder, _, sequence = made
    clips = SequenceDataset([folder], views=(2, 0), clip_frames=2, clip_stride=1, frame_step=2)
    assert [clips[index].frames.tolist() for index in range(len(clips))] == [[0, 2], [1, 3], [2, 4], [3, 5]]
    clip = clips[1]
    assert clip.views.tolist() == [2, 0]
    np.testing.assert_array_equal(clip.tracks_m.numpy(), sequence.tracks_m[[1, 3]])
    np.testing.assert_array_equal(clip.images[1, 1].permute(1, 2, 0).numpy(), sequence.views[0].image(3))
    np.testing.assert_array_equal(clip.visible[0].numpy(), sequence.views[2].visible[[1, 3]])
    np.testing.assert_array_equal(clip.camera_from_world[0].numpy(), sequence.views[2].camera_from_world[[1, 3]])
    asked, place = _at_queries(clip)
    np.testing.assert_array_equal(asked, np.flatnonzero(clip.visible.any(0).any(0).numpy()))
    assert 0 < len(asked) < TRACKS
    assert clip.visible.numpy()[tuple(place)].all()
    np.testing.assert_allclose(clip.pixel_px.numpy()[tuple(place)], clip.queries_xytv.numpy()[asked, :2], atol=1e-4)
    assert len({(view, frame) for view, frame in place[:2].T.tolist()}) == 4


def test_clips_of_a_sequence_do_not_overlap_by_default(made: tuple[Path, Scene, Sequence]) -> None:
    clips = SequenceDataset([made[0], made[0]], clip_frames=4)
    assert [clips[index].frames.tolist() for index in range(len(clips))] == [[0, 1, 2, 3]] * 2
    assert SequenceDataset([made[0]], frame_step=4)[0].frames.tolist() == [0, 4]


def test_resized_depth_puts_the_walls_where_they_are(made: tuple[Path, Scene, Sequence]) -> None:
    """At 20 x 72 every new pixel centre is an old one, so unprojected walls must stay exactly plane."""
    folder, scene, _ = made
    clip = SequenceDataset([folder], clip_frames=1, size_px=(20, HEIGHT_PX))[0]
    assert clip.images.shape[3:] == clip.depth_m.shape[2:] == (HEIGHT_PX, 20)
    assert clip.intrinsics_px[0, 0, 0] == pytest.approx(scene.cameras[0].intrinsics.fx_px * 19 / 95, rel=1e-6)
    assert clip.intrinsics_px[0, 0, 2] == pytest.approx(19 / 2)
    columns, rows = np.meshgrid(np.arange(20), np.arange(HEIGHT_PX))
    for view in range(VIEWS):
        ray = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(clip.intrinsics_px[view].numpy()).T
        pose = clip.camera_from_world[view, 0].double().numpy()
        world = (ray * clip.depth_m[view, 0].numpy()[..., None] - pose[:3, 3]) @ pose[:3, :3]
        shell = world[scene.views[view].object_index[0][:, ::5] == 1]
        off = np.abs(np.concatenate([shell - [3.0, 2.5, 2.8], shell - [-3.0, -2.5, 0.0]], axis=1)).min(axis=1)
        assert len(shell) > 500 and off.max() < 1e-4


def test_resized_pixels_and_queries_follow_the_pixel_centres(made: tuple[Path, Scene, Sequence]) -> None:
    folder, _, _ = made
    whole, small = SequenceDataset([folder])[0], SequenceDataset([folder], size_px=(48, 30))[0]
    scale = torch.tensor([47 / 95, 29 / 71])
    seen = whole.visible
    torch.testing.assert_close(small.pixel_px[seen], whole.pixel_px[seen] * scale, rtol=1e-5, atol=1e-4)
    torch.testing.assert_close(small.queries_xytv[:, :2], whole.queries_xytv[:, :2] * scale, rtol=1e-5, atol=1e-4)
    assert torch.equal(small.queries_xytv[:, 2:], whole.queries_xytv[:, 2:])
    homogeneous = torch.cat([whole.tracks_m, torch.ones(FRAMES, TRACKS, 1)], dim=2)
    camera = torch.einsum("vtij,tpj->vtpi", small.camera_from_world[:, :, :3], homogeneous)
    image = torch.einsum("vij,vtpj->vtpi", small.intrinsics_px, camera)
    torch.testing.assert_close((image[..., :2] / image[..., 2:])[seen], small.pixel_px[seen], rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("size_px", [(25, 17), (49, 36), (96, 72), (301, 143)])
def test_a_ramp_stays_the_ramp_of_its_pixel_centres(size_px: tuple[int, int]) -> None:
    """Linear pictures tell any shift: a hundredth of a pixel is more than what is allowed for."""
    columns, rows = np.meshgrid(np.arange(97.0), np.arange(73.0))
    ramp = np.stack([2.0 * columns, 3.0 * rows, columns + rows], axis=2).astype(np.uint8)
    resized = PixelCentreResize((97, 73), size_px).image(ramp).astype(float)
    new_columns, new_rows = np.meshgrid(
        np.arange(size_px[0]) * 96.0 / (size_px[0] - 1), np.arange(size_px[1]) * 72.0 / (size_px[1] - 1)
    )
    wanted = np.stack([2.0 * new_columns, 3.0 * new_rows, new_columns + new_rows], axis=2)
    inner = (slice(1, -1), slice(1, -1))
    # Half a grey level is lost to rounding, and nothing else.
    assert np.abs(resized - wanted)[inner].max() < 0.5 + 1e-3
    assert np.abs((resized - wanted)[inner].mean(axis=(0, 1))).max() < 0.05


def test_a_fine_pattern_becomes_grey_and_does_not_alias() -> None:
    stripes = np.tile(np.where(np.arange(96) % 2 == 0, 0, 255)[None, :, None], (72, 1, 3)).astype(np.uint8)
    small = PixelCentreResize((96, 72), (24, 18)).image(stripes)
    assert np.abs(small[:, 1:-1].astype(float) - 127.5).max() < 12.0


def test_same_size_changes_no_pixel() -> None:
    picture = np.random.default_rng(1).integers(0, 256, (11, 13, 3)).astype(np.uint8)
    resize = PixelCentreResize((13, 11), (13, 11))
    np.testing.assert_array_equal(resize.image(picture), picture)
    np.testing.assert_array_equal(resize.nearest(picture[..., 0]), picture[..., 0])


@pytest.mark.filterwarnings("ignore:This DataLoader will create:UserWarning")
def test_workers_give_the_same_batches(made: tuple[Path, Scene, Sequence]) -> None:
    clips = SequenceDataset([made[0]], views=(1,), clip_frames=2, size_px=(32, 24))
    batches = list(DataLoader(clips, batch_size=3, num_workers=2))
    assert len(batches) == 1 and batches[0].images.shape == (3, 1, 2, 3, 24, 32) and batches[0].labels == {}
    for row in range(len(clips)):
        clip = clips[row]
        for field, batch in zip(clip._fields, batches[0], strict=True):
            if field not in ("name", "labels"):
                torch.testing.assert_close(batch[row], getattr(clip, field), rtol=0, atol=0, equal_nan=True)


def test_depth_and_masks_can_be_left_out(made: tuple[Path, Scene, Sequence], tmp_path: Path) -> None:
    copy = tmp_path / "bare"
    for path in made[0].rglob("*.npy"):
        if path.name not in ("depth.npy", "foreground_mask.npy"):
            (copy / path.relative_to(made[0])).parent.mkdir(parents=True, exist_ok=True)
            (copy / path.relative_to(made[0])).write_bytes(path.read_bytes())
    with pytest.raises(SequenceFormatError, match=r"0/depth.npy' is missing"):
        SequenceDataset([copy])[0]
    clip = SequenceDataset([copy], depth=False, foreground=False)[0]
    assert clip.depth_m.numel() == clip.foreground.numel() == 0 and clip.images.numel() > 0


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"views": (0, 3)}, r"among 0\.\.2 .* not \(0, 3\)"),
        ({"clip_frames": 4, "frame_step": 2}, "spans 7 frames and .* has 6"),
        ({"clip_frames": 0}, "clip_frames must be at least 1, not 0"),
        ({"size_px": (1, 9)}, "at least 2 pixels"),
    ],
)
def test_settings_that_do_not_fit_are_errors(
    settings: dict[str, object], message: str, made: tuple[Path, Scene, Sequence]
) -> None:
    with pytest.raises(InputError, match=message):
        SequenceDataset([made[0]], **settings)[0]  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def labelled(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Scene]:
    folder = tmp_path_factory.mktemp("labelled") / "seed5-room0000"
    scene, _ = write_scene(folder, OUTPUTS)
    return folder, scene


def test_labels_come_as_they_are_stored(labelled: tuple[Path, Scene]) -> None:
    folder, scene = labelled
    clip = SequenceDataset([folder], views=(2, 0), clip_frames=2, clip_stride=4, labels=OUTPUTS)[1]
    assert clip.frames.tolist() == [4, 5]
    np.testing.assert_array_equal(clip.labels["object_index"][1].numpy(), scene.views[0].object_index[4:])
    normal = np.load(folder / "2/normals.npy")[4:]
    np.testing.assert_array_equal(clip.labels["normals"][0].permute(0, 2, 3, 1).numpy(), normal)
    for name, channels in (("flow", 2), ("scene_flow", 3)):
        stored = np.load(folder / f"2/{name}.npy")
        assert clip.labels[name].shape == (2, 2, channels, HEIGHT_PX, WIDTH_PX)
        np.testing.assert_array_equal(clip.labels[name][0, 0].permute(1, 2, 0).numpy(), stored[4])
        assert not clip.labels[name][:, 1].any(), "the last frame has no next one"
    assert clip.labels["flow_state"][0, 0].any() and not clip.labels["flow_state"][:, 1].any()
    between, state = clip.labels["view_flow"], clip.labels["view_flow_state"]
    assert between.shape == (2, 2, 2, 2, HEIGHT_PX, WIDTH_PX) and state.shape == (2, 2, 2, HEIGHT_PX, WIDTH_PX)
    np.testing.assert_array_equal(between[1, 0, 1].permute(1, 2, 0).numpy(), np.load(folder / "0/flow_to_2.npy")[5])
    np.testing.assert_array_equal(state[0, 1].numpy(), np.load(folder / "2/flow_to_0_state.npy")[4:])
    assert not between[0, 0].any() and not state[1, 1].any()


def test_resized_flow_is_in_resized_pixels(labelled: tuple[Path, Scene]) -> None:
    """Corner pixels stay corner pixels, and each new pixel has the flow of the nearest old one."""
    folder, _ = labelled
    clip = SequenceDataset([folder], size_px=(191, 36), labels=("flow", "view_flow"))[0]
    old, new = np.load(folder / "1/flow.npy")[2], clip.labels["flow"][1, 2].permute(1, 2, 0).numpy()
    scale = np.array([190 / 95, 35 / 71], np.float32)
    for corner in ((0, 0), (0, -1), (-1, 0), (-1, -1)):
        np.testing.assert_allclose(new[corner], old[corner] * scale, rtol=1e-6)
    assert clip.labels["flow_state"].shape == (VIEWS, FRAMES, 36, 191)
    np.testing.assert_allclose(
        clip.labels["view_flow"][0, 2, 0, :, 0, 0].numpy(), np.load(folder / "0/flow_to_2.npy")[0, 0, 0] * scale
    )


def test_labels_that_cannot_be_had_are_refused(
    labelled: tuple[Path, Scene], made: tuple[Path, Scene, Sequence]
) -> None:
    with pytest.raises(InputError, match="labels must be among object_index, normals"):
        SequenceDataset([labelled[0]], labels=("albedo",))
    with pytest.raises(InputError, match="frame_step must be 1"):
        SequenceDataset([labelled[0]], frame_step=2, clip_frames=2, labels=("flow",))
    with pytest.raises(InputError, match="at least two views"):
        SequenceDataset([labelled[0]], views=(1,), labels=("view_flow",))
    with pytest.raises(SequenceFormatError, match=r"normals\.npy' is missing: make the sequence with this label"):
        SequenceDataset([made[0]], labels=("normals",))[0]
    assert SequenceDataset([made[0]])[0].labels == {}
