#!/usr/bin/env python3
"""A stand-in for ``kimodo_gen``: strict about its arguments, faithful in its files, quick to start.

It plays one recorded stride (``stride_<word>.npz`` beside it, made by ``write_strides``) along the root2d path it is
given. Its environment makes it fail: FAKE_KIMODO=exit|sleep|nan|short|joints|far|keys|nothing.
"""

import argparse
import json
import os
import sys
import time
from pathlib import Path

import numpy as np

FPS = 30
MODELS = {"Kimodo-SOMA-RP-v1": 77, "Kimodo-SOMA-SEED-v1": 77, "Kimodo-SMPLX-RP-v1": 22}
PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19)
TRUNK = ["pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle", "right_ankle"]
SMPLX = [*TRUNK, "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head"] + [
    f"{side}_{name}" for name in ("shoulder", "elbow", "wrist") for side in ("left", "right")
]
ARM = {"Shoulder": "collar", "Arm": "shoulder", "ForeArm": "elbow", "Hand": "wrist"}
LEG = {"Leg": "hip", "Shin": "knee", "Foot": "ankle", "ToeBase": "foot", "ToeEnd": "foot"}


def soma_joints() -> list[str]:
    """For each of SOMA's 77 joints, in order, the SMPL-X joint that it moves with."""
    joints = ["pelvis", "spine1", "spine2", "spine3", "neck", "neck", "head", "head", "head", "head", "head"]
    for side in ("left", "right"):
        joints += [f"{side}_{name}" for name in ARM.values()] + [f"{side}_wrist"] * 24
    for side in ("left", "right"):
        joints += [f"{side}_{name}" for name in LEG.values()]
    return joints


def parse() -> argparse.Namespace:
    """The arguments that the program documents; anything else ends it."""
    parser = argparse.ArgumentParser("kimodo_gen")
    parser.add_argument("prompt")
    parser.add_argument("--model", choices=sorted(MODELS), required=True)
    parser.add_argument("--duration", required=True)
    parser.add_argument("--constraints", required=True)
    parser.add_argument("--output", required=True)
    parser.add_argument("--num_transition_frames", type=int, default=5)
    parser.add_argument("--seed", type=int, required=True)
    return parser.parse_args()


def check(arguments: argparse.Namespace) -> tuple[np.ndarray, np.ndarray]:
    """The path and heading of the constraints, after every rule of the interface has been checked."""
    prompts = [text for text in arguments.prompt.split(".") if text.strip()]
    durations = [float(word) for word in arguments.duration.split(" ")]
    frames = [int(duration * FPS) for duration in durations]
    if len(prompts) != len(frames):
        raise SystemExit(f"{len(prompts)} prompts and {len(frames)} durations")
    if max(frames) > 10 * FPS or min(frames) < 1 or max(durations) > 10.0:
        raise SystemExit(f"a prompt makes at most 10 s, not {max(durations)}")
    (constraint,) = json.loads(Path(arguments.constraints).read_text(encoding="utf-8"))
    if set(constraint) != {"type", "frame_indices", "smooth_root_2d", "global_root_heading"}:
        raise SystemExit(f"unknown keys in {sorted(constraint)}")
    path, heading = np.array(constraint["smooth_root_2d"]), np.array(constraint["global_root_heading"])
    if constraint["type"] != "root2d" or constraint["frame_indices"] != list(range(sum(frames))):
        raise SystemExit("a dense root2d path is expected")
    if path.shape != (sum(frames), 2) or heading.shape != path.shape:
        raise SystemExit(f"shapes {path.shape}, {heading.shape}")
    if np.abs(path[0]).max() > 1e-9 or np.abs(heading[0] - (1.0, 0.0)).max() > 1e-6:
        raise SystemExit("the path must begin at the origin and face +Z")
    if np.abs(np.linalg.norm(heading, axis=1) - 1.0).max() > 1e-4:
        raise SystemExit("headings must be unit vectors")
    return path, heading


def walk(stride: dict[str, np.ndarray], path: np.ndarray, heading: np.ndarray, seed: int) -> dict[str, np.ndarray]:
    """The stride along the path: rotations, pelvis and contacts of the 22 SMPL-X joints, Y up."""
    turn = np.unwrap(np.arctan2(heading[:, 1], heading[:, 0]))
    step = np.linalg.norm(np.diff(path, axis=0), axis=1) + 0.25 * np.abs(np.diff(turn))
    step = np.convolve(np.pad(step, 4, "edge"), np.ones(9) / 9, "valid")
    count = len(stride["rotation"])
    phase = np.concatenate([[0.0], np.cumsum(step)]) / float(stride["length"]) * count
    row = (phase + np.random.default_rng(seed).uniform(0, count)).astype(int) % count
    pace = np.clip(np.append(step, step[-1]) * FPS / 0.7, 0.0, 1.0)[:, None]
    mixed = pace[..., None, None] * stride["rotation"][row] + (1 - pace)[..., None, None] * stride["rotation"].mean(0)
    left, _, right = np.linalg.svd(mixed)
    yaw = np.tile(np.eye(3), (len(turn), 1, 1, 1))
    yaw[:, 0, 0, 0] = yaw[:, 0, 2, 2] = np.cos(turn)
    yaw[:, 0, 0, 2] = np.sin(turn)
    yaw[:, 0, 2, 0] = -np.sin(turn)
    rotation = yaw @ (left @ right)
    sway = np.einsum("tij,tj->ti", yaw[:, 0], stride["offset"][row] * (pace, 1.0)[0])
    root = np.stack([path[:, 0] + sway[:, 0], stride["offset"][row][:, 1], path[:, 1] + sway[:, 2]], axis=1)
    contacts = np.where(pace < 0.3, 1.0, stride["contacts"][row])
    return {"rotation": rotation, "root": root, "contacts": contacts, "path": path, "heading": heading}


def save(path: Path, motion: dict[str, np.ndarray], rest: np.ndarray, joints: list[str], broken: str) -> None:
    """The documented arrays, single precision."""
    rotation, place = motion["rotation"], np.repeat(motion["root"][:, None], 22, axis=1)
    local = rotation.copy()
    for joint, parent in enumerate(PARENTS):
        if parent >= 0:
            place[:, joint] = place[:, parent] + rotation[:, parent] @ (rest[joint] - rest[parent])
            local[:, joint] = np.swapaxes(rotation[:, parent], 1, 2) @ rotation[:, joint]
    index = [SMPLX.index(name) for name in joints]
    if broken == "nan":
        place[7] = np.nan
    if broken == "far":
        place = place + np.linspace(0.0, 3.0, len(place))[:, None, None]
    arrays = {
        "posed_joints": place[:, index],
        "global_rot_mats": rotation[:, index],
        "local_rot_mats": local[:, index],
        "foot_contacts": motion["contacts"],
        "root_positions": motion["root"],
        "smooth_root_pos": np.insert(motion["path"], 1, motion["root"][:, 1], axis=1),
        "global_root_heading": motion["heading"],
    }
    if broken == "keys":
        del arrays["global_rot_mats"]
    shortened = {name: values[:-20] if broken == "short" else values for name, values in arrays.items()}
    np.savez(path, **{name: values.astype(np.float32) for name, values in shortened.items()})


def main() -> None:
    """What the command does."""
    arguments, broken = parse(), os.environ.get("FAKE_KIMODO", "")
    if broken == "sleep":
        time.sleep(60)
    if broken == "exit":
        print("torch.OutOfMemoryError: CUDA out of memory", file=sys.stderr)
        raise SystemExit(3)
    path, heading = check(arguments)
    folder = Path(__file__).parent
    words = {name.stem.partition("_")[2] for name in folder.glob("stride_*.npz")} - {"walk"}
    word = next((word for word in sorted(words) if word in arguments.prompt), "walk")
    stride = dict(np.load(folder / f"stride_{word}.npz"))
    with (folder / "calls.txt").open("a", encoding="utf-8") as log:
        log.write(json.dumps(sys.argv[1:]) + "\n")
    joints = SMPLX if MODELS[arguments.model] == 22 else soma_joints()
    joints = [*joints, "head"] if broken == "joints" else joints
    if broken != "nothing":
        motion = walk(stride, path, heading, arguments.seed)
        save(Path(arguments.output + ".npz"), motion, stride["rest"], joints, broken)


if __name__ == "__main__":
    main()
