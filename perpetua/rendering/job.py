"""The render job as files: job.json and one .npy per array, which ``blender_scripts/render/render_frames.py`` reads.

A file of arrays is named after its content, so job.json alone says whether two jobs are the same.
"""

import dataclasses
import hashlib
import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Shaped

from perpetua.io.files import file_sha256, write_json
from perpetua.machine.devices import cpu_threads, machine_share
from perpetua.machine.scripts import scripts_sha256
from perpetua.rendering.config import PROCESS_SETTINGS, RenderConfig
from perpetua.rendering.sensor import noise_seed, view_gains
from perpetua.resources import SCRIPT_FOLDER
from perpetua.scene.actor import ActorMesh
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import AreaLight, Material, Room, SceneObject
from perpetua.seeding import StageSeed

RENDER_SCRIPT = SCRIPT_FOLDER / "render" / "render_frames.py"
JOB_FILE = "job.json"
PENDING_FILE = "pending.json"
EXPOSURE_FILE = "exposure.json"
FRAME_FOLDER = "frames"
# For pictures that belong to no sequence.
NO_SEED = StageSeed(0, 0, "render")

Settings = dict[str, Any]


def write_job(
    folder: Path,
    room: Room,
    actors: tuple[ActorMesh, ...],
    cameras: tuple[CameraPath, ...],
    config: RenderConfig,
    device: str,
    near_m: Mapping[int, float],
    seed: StageSeed = NO_SEED,
) -> Path:
    """Writes a job into an existing folder; what an earlier, different job left there is removed.

    ``near_m`` holds, by number of camera, where its view begins, if not at the camera. ``seed`` decides how cameras
    deviate from ideal ones.

    Returns:
        The path of job.json.
    """
    writer = _ArrayWriter(folder)
    job: Settings = {
        "scripts": scripts_sha256((RENDER_SCRIPT,)),
        "frames": len(cameras[0].world_from_camera),
        "room": _room_settings(room, writer),
        "actors": [_actor_settings(actor, writer) for actor in actors],
        "cameras": [
            _camera_settings(camera, near_m.get(camera.camera), writer)
            | {"gains": _gains(camera, config, seed, writer)}
            for camera in cameras
        ],
        "noise_seed": noise_seed(seed),
        "settings": config.model_dump(mode="json", exclude=set(PROCESS_SETTINGS)),
    }
    digest = hashlib.sha256(json.dumps(job, sort_keys=True).encode()).hexdigest()
    path = folder / JOB_FILE
    if _stored_digest(path) != digest:
        shutil.rmtree(folder / FRAME_FOLDER, ignore_errors=True)
        (folder / EXPOSURE_FILE).unlink(missing_ok=True)
    blend_path = None if room.blend_path is None else str(room.blend_path.resolve())
    fraction = machine_share()
    job |= {
        "digest": digest,
        "blend_path": blend_path,
        "device": device,
        "threads": cpu_threads(config.threads, fraction),
        "worker": fraction.worker,
        "workers": fraction.workers,
    }
    write_json(path, job)
    return path


class _ArrayWriter:
    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._written: set[str] = set()

    def write(self, name: str, values: Shaped[np.ndarray, "*shape"]) -> str:
        """Writes an array and returns its file's name."""
        values = np.ascontiguousarray(values)
        digest = hashlib.sha256(f"{values.dtype.str}{values.shape}".encode())
        digest.update(values.data)
        file = f"{name}_{digest.hexdigest()[:24]}.npy"
        if file not in self._written:
            temporary = self._folder / "array.tmp"
            with temporary.open("wb") as stream:
                np.save(stream, values, allow_pickle=False)
            temporary.replace(self._folder / file)
            self._written.add(file)
        return file


def _stored_digest(path: Path) -> str | None:
    try:
        return str(json.loads(path.read_text(encoding="utf-8"))["digest"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _room_settings(room: Room, writer: _ArrayWriter) -> Settings:
    if room.blend_path is not None:
        return {"blend_sha256": file_sha256(room.blend_path)}
    return {
        "objects": [_object_settings(obj, writer) for obj in room.objects],
        "lights": [_light_settings(light) for light in room.lights],
        "sky": None if room.sky is None else dataclasses.asdict(room.sky),
    }


def _object_settings(obj: SceneObject, writer: _ArrayWriter) -> Settings:
    if obj.material is None:
        raise ValueError(f"object '{obj.name}' has no material, and the room has no .blend that holds one")
    return {
        "name": obj.name,
        "object_index": obj.object_index,
        "vertices_m": writer.write("vertices_m", obj.mesh.vertices_m.astype(np.float32)),
        "faces": writer.write("faces", obj.mesh.faces),
        "material": _material_settings(obj.material, writer),
    }


def _material_settings(material: Material, writer: _ArrayWriter) -> Settings:
    return {
        "name": material.name,
        "base_color": list(material.base_color),
        "second_color": list(material.second_color),
        "roughness": material.roughness,
        "metallic": material.metallic,
        "pattern": material.pattern,
        "scale_m": material.scale_m,
        "image": None if material.image is None else writer.write("image", material.image),
        "emission_w_m2": material.emission_w_m2,
    }


def _light_settings(light: AreaLight) -> Settings:
    return {
        "position_m": list(light.position_m),
        "direction": list(light.direction),
        "size_m": list(light.size_m),
        "power_w": light.power_w,
        "color": list(light.color),
    }


def _actor_settings(actor: ActorMesh, writer: _ArrayWriter) -> Settings:
    parts = [
        {
            "name": part.name,
            "faces": writer.write("faces", part.faces),
            "uv": writer.write("uv", part.uv),
            "material": _material_settings(part.material, writer),
        }
        for part in actor.parts
    ]
    return {
        "name": f"actor_{actor.actor}",
        "object_index": actor.object_index,
        "vertices_m": writer.write("vertices_m", actor.vertices_m),
        "parts": parts,
    }


def _gains(camera: CameraPath, config: RenderConfig, seed: StageSeed, writer: _ArrayWriter) -> str | None:
    gains = view_gains(config.sensor, camera.camera, len(camera.world_from_camera), seed)
    return None if gains is None else writer.write("gains", gains)


def _camera_settings(camera: CameraPath, near_m: float | None, writer: _ArrayWriter) -> Settings:
    intrinsics = camera.intrinsics
    return {
        "camera": camera.camera,
        "near_m": near_m,
        "world_from_camera": writer.write("world_from_camera", camera.world_from_camera),
        "intrinsics": {
            "fx_px": float(intrinsics.fx_px),
            "fy_px": float(intrinsics.fy_px),
            "cx_px": float(intrinsics.cx_px),
            "cy_px": float(intrinsics.cy_px),
            "width_px": int(intrinsics.width_px),
            "height_px": int(intrinsics.height_px),
        },
    }
