"""The list of bad inputs and faults that are tried, as the tests try it; ``docs/robustness.md`` is made of it.

``python -m tests.support.robustness > docs/robustness.md`` writes the page.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tests.support.paths import ROOT

PAGE = ROOT / "docs" / "robustness.md"


@dataclass(frozen=True)
class BadInput:
    """Something wrong with an input: ``spoil`` makes it so in a folder; ``says`` is part of the message."""

    what: str
    spoil: Callable[[Path], None]
    says: str

    def __str__(self) -> str:
        return self.what


@dataclass(frozen=True)
class Fault:
    """Something that goes wrong on the way, what happens then, and the test that shows it: file and function."""

    what: str
    outcome: str
    file: str
    test: str


# Each has a test that kills, fills, damages or breaks for real, and then looks at what is left.
FAULTS = (
    Fault(
        "kill -9 of a run in any stage, or while it publishes",
        "the same command goes on; the same bytes",
        "blender/test_end_to_end.py",
        "test_killed_while_rendering_ends_in_the_same_bytes",
    ),
    Fault(
        "kill -9 while Blender is being loaded",
        "Blender ends before it begins",
        "machine/test_blender.py",
        "test_parent_that_is_killed_while_blender_is_loaded_leaves_no_worker",
    ),
    Fault(
        "Ctrl-C, or SIGTERM as a scheduler sends it",
        "exit code 130 at once, no process left, how to go on is said",
        "blender/test_end_to_end.py",
        "test_told_to_stop_it_stops_cleanly_and_says_how_to_go_on",
    ),
    Fault(
        "a newer version of Perpetua on a folder of finished sequences",
        "exit code 2, nothing is touched; --replace makes them anew",
        "cli/test_cli.py",
        "test_sequences_of_another_version_are_named_and_kept",
    ),
    Fault(
        "two runs on one folder at once",
        "each stage and frame is made by one of them; both end with all rooms; the bytes of a run on a cluster",
        "cluster/test_slurm.py",
        "test_a_disturbed_cluster_makes_the_bytes_of_two_local_runs",
    ),
    Fault(
        "on a cluster: a task requeued, one out of time, one cancelled, a node that loses its power",
        "what was lost is made again, nothing else; submit schedules what is missing; the bytes of a local run",
        "cluster/test_slurm.py",
        "test_a_disturbed_cluster_makes_the_bytes_of_two_local_runs",
    ),
    Fault(
        "disk full in the middle of a stage",
        "DiskError: free space; what the stage left is removed; the same command goes on",
        "pipeline/test_faults.py",
        "test_full_disk_says_so_and_the_same_call_goes_on",
    ),
    Fault(
        "disk too small for the rooms asked for",
        "exit code 2 before anything is made",
        "pipeline/test_faults.py",
        "test_disk_is_looked_at_before_work_begins",
    ),
    Fault(
        "file system out of files",
        "exit code 2 before anything is made",
        "pipeline/test_faults.py",
        "test_files_are_counted_too",
    ),
    Fault(
        "output folder read-only",
        "exit code 2: cannot write to --out",
        "pipeline/test_faults.py",
        "test_read_only_folder_is_refused_before_work_begins",
    ),
    Fault(
        "quota, rights, failing disk, lost file server, too many open files",
        "DiskError with the remedy of each",
        "pipeline/test_faults.py",
        "test_every_fault_of_a_disk_has_a_remedy",
    ),
    Fault(
        "memory runs out in a stage",
        "OutOfMemoryError: lower --workers or sizes",
        "pipeline/test_faults.py",
        "test_memory_that_runs_out_says_so",
    ),
    Fault(
        "stage file with a flipped bit, cut short, emptied or removed; manifest cut short",
        "found by SHA-256; made again; the same bytes",
        "pipeline/test_faults.py",
        "test_damaged_stage_is_made_again_with_what_follows",
    ),
    Fault(
        "kept work damaged under `tracks` or `verify --deep`",
        "exit code 2 names the file",
        "pipeline/test_bad_work.py",
        "test_damaged_work_is_not_used",
    ),
    Fault(
        "clock that jumps between years",
        "nothing changes",
        "pipeline/test_faults.py",
        "test_clock_that_jumps_changes_nothing",
    ),
    Fault(
        "power failure after a sequence was put in place",
        "its files were flushed to disk before",
        "pipeline/test_bad_work.py",
        "test_a_sequence_is_on_disk_before_it_has_its_name",
    ),
    Fault(
        "rendered frame cut short, flipped, removed; its record damaged",
        "rendered again",
        "rendering/test_render.py",
        "test_damaged_frames_are_found_and_removed",
    ),
    Fault(
        "Blender crashes in a frame",
        "restarted at that frame, finished ones kept",
        "rendering/test_render.py",
        "test_finished_frames_are_kept_after_a_crash",
    ),
    Fault(
        "Blender crashes at the same frame again and again",
        "RenderError with its last lines after max_restarts",
        "rendering/test_render.py",
        "test_restarts_are_limited_and_the_error_says_why",
    ),
    Fault(
        "Blender hangs",
        "ended after frame_timeout_s without progress, restarted",
        "rendering/test_render.py",
        "test_a_hang_is_ended_and_the_frame_tried_again",
    ),
    Fault(
        "Blender ends well without its frames",
        "restarted, then RenderError",
        "rendering/test_render.py",
        "test_a_worker_that_ends_well_without_its_frames_is_a_failure",
    ),
    Fault(
        "Blender writes garbage",
        "the frame is removed and rendered again",
        "rendering/test_render.py",
        "test_garbage_is_rendered_again",
    ),
    Fault(
        "Blender writes garbage without end",
        "RenderError; other frames stay",
        "rendering/test_render.py",
        "test_garbage_without_end_is_an_error_that_leaves_the_other_frames",
    ),
    Fault(
        "Blender killed by a signal, as when memory runs out",
        "the signal and memory are named",
        "machine/test_blender.py",
        "test_death_by_signal_is_named",
    ),
    Fault(
        "Blender silent, with children of its own",
        "all of them are ended",
        "machine/test_blender.py",
        "test_silence_ends_the_process_and_its_children",
    ),
    Fault(
        "Blender without its system libraries",
        "exit code 2 names the packages",
        "machine/test_blender.py",
        "test_missing_system_library_names_the_packages",
    ),
    Fault(
        "Blender program that is none",
        "exit code 2 names the setting",
        "machine/test_blender.py",
        "test_unknown_program_is_named",
    ),
    Fault(
        "one room of many fails",
        "the others are finished; exit code 1 and a list",
        "cluster/test_local_workers.py",
        "test_one_failing_room_does_not_stop_the_others",
    ),
    Fault(
        ".glb that is cut short",
        "exit code 2",
        "rooms/files/test_checks.py",
        "test_a_sound_glb_passes_and_a_truncated_one_does_not",
    ),
    Fault("scene whose lengths lie", "exit code 2", "rooms/files/test_checks.py", "test_lengths_that_lie_are_refused"),
    Fault(
        "scene that refers to files outside its folder",
        "exit code 2; they are not read",
        "rooms/files/test_checks.py",
        "test_uris_that_lead_out_are_refused",
    ),
    Fault(
        ".obj whose material library lies elsewhere",
        "exit code 2",
        "rooms/files/test_checks.py",
        "test_material_libraries_of_an_obj_stay_at_home",
    ),
    Fault(
        "scene with too many triangles",
        "exit code 2 before Blender opens it",
        "rooms/files/test_checks.py",
        "test_triangles_are_counted_as_often_as_they_are_shown",
    ),
    Fault(
        "scene with damaged tables, or JSON nested 100,000 deep",
        "exit code 2",
        "rooms/files/test_checks.py",
        "test_damaged_tables_are_refused",
    ),
    Fault(
        "picture or letter named as a scene",
        "exit code 2",
        "rooms/files/test_checks.py",
        "test_what_is_not_the_format_is_refused",
    ),
    Fault(
        ".blend with scripts, drivers and outputs",
        "nothing of it runs",
        "blender/test_scene_file.py",
        "test_nothing_in_a_blend_runs_and_nothing_of_it_is_kept",
    ),
    Fault(
        "scenes without floor, empty, tiny, huge, with NaN",
        "exit code 2 says which rule",
        "blender/test_scene_file.py",
        "test_bad_scenes_say_what_is_wrong",
    ),
    Fault(
        ".bvh that breaks a rule or ends early",
        "exit code 2 names the line",
        "motion/recorded/test_clips.py",
        "test_bvh_files_that_break_a_rule_say_which",
    ),
    Fault(
        "motion .npz that is a zip bomb",
        "exit code 2 before it is unpacked",
        "motion/recorded/test_clips.py",
        "test_a_file_that_unpacks_to_too_much_is_refused",
    ),
    Fault(
        "motion with NaN, no frames, wrong shapes",
        "exit code 2",
        "motion/recorded/test_clips.py",
        "test_files_that_cannot_be_motion_are_refused",
    ),
    Fault(
        "MakeHuman binding that is broken, or links outside its folder",
        "exit code 2 names file, line and rule",
        "actors/bodies/test_makehuman_clothes.py",
        "test_links_that_lead_outside_are_refused",
    ),
    Fault(
        "SMPL-X file with a pickle inside, or of another model",
        "exit code 2; nothing of it runs",
        "actors/bodies/test_smplx_body.py",
        "test_nothing_of_a_file_is_run",
    ),
    Fault(
        "predictions with hostile members",
        "exit code 2; nothing of them runs",
        "evaluation/test_predictions.py",
        "test_hostile_members_raise_and_run_nothing",
    ),
    Fault(
        "sequence with a pickle that calls a function",
        "exit code 2; it is not called",
        "io/test_restricted_pickle.py",
        "test_a_command_does_not_run",
    ),
)


def page() -> str:
    """The page, as Markdown."""
    from tests.audit.test_bad_sequences import BAD_SEQUENCES
    from tests.config.test_bad_config import BAD_FILES, BAD_SETTINGS
    from tests.pipeline.test_bad_work import BAD_RUNS, BAD_STAGES

    lines = [
        "# What was tried, and what happens",
        "",
        "This page is made of lists that the tests use (`python -m tests.support.robustness > docs/robustness.md`);",
        "a test compares them. Bad input ends with exit code 2 and a message, and nothing is written or run. Work that",
        "fails ends with exit code 1; the same command goes on from what is finished.",
        "",
        "| fault | what happens | shown by |",
        "|---|---|---|",
        *(f"| {fault.what} | {fault.outcome} | `tests/{fault.file}` |" for fault in FAULTS),
    ]
    for title, cases in (
        ("Sequences", BAD_SEQUENCES),
        ("Config files", BAD_FILES),
        ("Work and runs", (*BAD_STAGES, *BAD_RUNS)),
    ):
        lines += ["", f"## {title}", "", "| input | the message says |", "|---|---|"]
        lines += [f"| {case.what} | {case.says} |" for case in cases]
    lines += ["", "## Settings", "", "| `--set` | the message says |", "|---|---|"]
    lines += [f"| `{assignment[:60]}` | {says} |" for assignment, says in BAD_SETTINGS]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(page(), end="")
