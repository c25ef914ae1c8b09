"""Whether tracks, and the triangles stored for them, are where the meshes have them: in metres, not by what is seen."""

import numpy as np
from jaxtyping import Float64, Int64

from perpetua.audit.config import AuditConfig
from perpetua.audit.files import SequenceFiles
from perpetua.audit.report import Check
from perpetua.scene.scene import Scene


def check_on_meshes(
    files: SequenceFiles, table: dict[str, np.ndarray], scene: Scene, bounds: AuditConfig, frames: list[int]
) -> Check:
    """Each track is the recorded barycentric point of the recorded face of its object's mesh, at some frames; and so
    is the triangle in ``surface_xyz.npy``, where there is one."""
    worst_m, where = 0.0, ""
    for frame in frames:
        corner_m = _corners(scene, frame, table["object_index"], table["face"])
        point_m = (table["barycentric"][:, :, None] * corner_m).sum(axis=1)
        stored = {"tracks_xyz.npy": point_m[:, None]}
        if "surface_xyz.npy" in files.arrays:
            stored["surface_xyz.npy"] = corner_m
        for name, meshed_m in stored.items():
            given_m = np.asarray(files.arrays[name][frame], np.float64).reshape(meshed_m.shape)
            away_m = np.linalg.norm(given_m - meshed_m, axis=2).max(axis=1)
            track = int(np.nan_to_num(away_m, nan=np.inf).argmax())
            if not away_m[track] <= worst_m:
                worst_m = float(np.nan_to_num(away_m[track], nan=np.inf))
                where = f"{name}[{frame}, {track}] is {worst_m:.3g} m from face {table['face'][track]} of object "
                where += str(table["object_index"][track])
    passed = worst_m <= bounds.surface_error_m
    return Check("tracks on meshes", passed, worst_m, f"<= {bounds.surface_error_m:g} m", "" if passed else where)


def _corners(
    scene: Scene, frame: int, object_index: Int64[np.ndarray, " P"], face: Int64[np.ndarray, " P"]
) -> Float64[np.ndarray, "P 3 3"]:
    """Corners of faces of objects at a frame; NaN for objects and faces that do not exist."""
    meshes = {obj.object_index: (obj.mesh.vertices_m, obj.mesh.faces) for obj in scene.room.objects}
    meshes |= {actor.object_index: (actor.vertices_m[frame], actor.faces) for actor in scene.actors}
    corner_m = np.full((len(face), 3, 3), np.nan)
    for index in np.unique(object_index).tolist():
        if index in meshes:
            vertices_m, faces = meshes[index]
            tracks = np.flatnonzero((object_index == index) & (face >= 0) & (face < len(faces)))
            corner_m[tracks] = vertices_m[faces[face[tracks]]]
    return corner_m
