"""Draws a batch of clips with their tracks: what a model would be trained on.

    python docs/examples/show_batch.py FOLDER [--size 128] [--out batch.png]

FOLDER holds sequences. Rows are views of the batch's clips, columns are times.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
import torch
from torch.utils.data import DataLoader

import perpetua
from perpetua.formats import Clip, SequenceDataset

CLIPS, TIMES, TRACKS = 2, 4, 64


def main() -> None:
    """Reads the command line, loads one batch, draws it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--size", type=int, default=128, help="width and height of images, pixels")
    parser.add_argument("--out", type=Path, default=Path("batch.png"))
    options = parser.parse_args()

    clips = SequenceDataset(
        perpetua.sequences(options.folder), views=(0, 1), clip_frames=TIMES, size_px=(options.size, options.size)
    )
    order = torch.Generator().manual_seed(0)
    loader = DataLoader(clips, batch_size=CLIPS, shuffle=True, generator=order, collate_fn=list)
    batch = next(iter(loader))
    for clip in batch:
        print(f"{clip.name}: images {tuple(clip.images.shape)}, tracks {tuple(clip.tracks_m.shape)}")
    rows = [draw_row(clip, view) for clip in batch for view in range(len(clip.views))]
    cv2.imwrite(str(options.out), np.concatenate(rows)[:, :, ::-1])
    print(f"wrote {options.out}")


def draw_row(clip: Clip, view: int) -> np.ndarray:
    """One view of a clip at all its times, side by side, RGB; a track is a dot where it is seen, else a ring."""
    colors = np.random.default_rng(0).integers(64, 256, (TRACKS, 3)).tolist()
    # Every so many, so that moving tracks and still ones are among them.
    chosen = np.linspace(0, clip.tracks_m.shape[1] - 1, TRACKS).astype(int)
    pictures = []
    for time in range(len(clip.frames)):
        picture = np.ascontiguousarray(clip.images[view, time].permute(1, 2, 0).numpy())
        for color, track in zip(colors, chosen, strict=True):
            pixel_px = clip.pixel_px[view, time, track].numpy()
            if np.isfinite(pixel_px).all() and (np.abs(pixel_px) < 10_000).all():
                seen = bool(clip.visible[view, time, track])
                x_px, y_px = np.rint(pixel_px).astype(int).tolist()
                cv2.circle(picture, (x_px, y_px), 2, color, cv2.FILLED if seen else 1, cv2.LINE_AA)
        pictures.append(picture)
    return np.concatenate(pictures, axis=1)


if __name__ == "__main__":
    main()
