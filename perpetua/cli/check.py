"""Commands that judge: finished sequences, and what a tracker predicts."""

import json
import sys
from pathlib import Path

import click

from perpetua.cli.options import WholeNumber, wide_console
from perpetua.config import Config
from perpetua.errors import InputError


@click.command(short_help="Check finished sequences: layout, projection, depth, visibility.")
@click.argument("folders", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--deep", is_flag=True, help="Also cast rays at the meshes, which the work area must still hold.")
@click.option("--frames", type=WholeNumber(1), default=8, show_default=True, help="Frames that --deep looks at.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def verify(folders: tuple[Path, ...], deep: bool, frames: int, as_json: bool) -> None:
    """Check finished sequences: layout, projection, depth, visibility, queries.

    FOLDERS are sequence folders, or folders that hold some. Exit code 1 if a check fails.
    """
    from perpetua.audit.verify import find_sequences, verify_sequence
    from perpetua.pipeline.work_area import load_scene

    bounds = Config().audit
    reports = []
    for folder in (folder for given in folders for folder in find_sequences(given)):
        scene = load_scene(folder).scene if deep else None
        reports.append(verify_sequence(folder, bounds, scene, frames))
    if as_json:
        click.echo(json.dumps([report.to_json() for report in reports], indent=1))
    else:
        for report in reports:
            wide_console().print(report.table())
    sys.exit(0 if all(report.passed for report in reports) else 1)


@click.command(short_help="Score the tracks that a tracker predicts.")
@click.argument("paths", metavar="[PRED] DIR", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--baseline", type=click.Choice(("still", "flow")),
              help="Instead of PRED, score points that stay, or optical flow lifted with depth.")  # fmt: skip
@click.option("--save", type=click.Path(path_type=Path, dir_okay=False), metavar="NPZ",
              help="With --baseline and one sequence: also write what it predicts, as an example.")  # fmt: skip
@click.option("--score-queries", is_flag=True, help="Also score each track at its own query, as TAPVid-3D does.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, with the scores at each threshold.")
def evaluate(
    paths: tuple[Path, ...], baseline: str | None, save: Path | None, score_queries: bool, as_json: bool
) -> None:
    """Score predicted tracks: average Jaccard (AJ), position accuracy (APD), occlusion accuracy (OA).

    DIR is a sequence, or a folder that holds some. PRED is an .npz file, or for several sequences a folder with one
    <sequence>.npz for each. With C views, F frames and P tracks it holds:

    \b
    visibility            bool   (C,F,P), or (F,P) for world tracks alone
    tracks_xyz_camera     float  (C,F,P,3)  in the axes of each camera at each frame, and/or
    tracks_xyz_world      float  (F,P,3)    in the axes of the first view's camera at the first frame
    track_index           int    (K,)       optional: which tracks these are, where P is only K of them
    geometry_pixels_xytv  int    (G,4)      optional: pixels x, y of frame t, view v, and
    geometry_xyz_world    float  (G,3)      where their surfaces are, for the scores under a Sim(3)

    NaN and absent tracks count as failures. Scale is free: one factor per view, and one for the world, is taken out.
    The module perpetua.evaluation.protocol states every rule.
    """
    from perpetua.evaluation.report import evaluate_baseline, evaluate_files

    if len(paths) != (2 if baseline is None else 1):
        raise InputError("evaluate needs PRED and DIR, or DIR alone with --baseline still or --baseline flow")
    if baseline is None and save is not None:
        raise InputError("--save writes what --baseline predicts: give both, or none")
    if baseline is None:
        report = evaluate_files(paths[0], paths[1], score_queries)
    else:
        report = evaluate_baseline(baseline, paths[0], score_queries, save)
    if as_json:
        click.echo(json.dumps(report.to_json(), indent=1))
    else:
        wide_console().print(report.table())
