"""Rerun recordings: cameras, images, depth, meshes and tracks on a timeline, to look at in Rerun's viewer.

::

    <sequence>.rrd, timelines "frame" and "time" (seconds)
        world                          right-handed, Z up, metres
        world/view_<i>                 pose of the camera, at every frame
        world/view_<i>/image           pinhole; the JPEG of the frame
        world/view_<i>/image/tracks    pixels of the tracks that the view sees
        world/view_<i>/depth           pinhole; depth along Z, rounded to millimetres
        world/tracks/<object>          positions of the tracks on an object, in the object's colour
        world/trails                   where the moving tracks were in the last frames
        world/room, world/shell        meshes of the room, its walls and ceiling apart   } where the run's
        world/people                   meshes of the people, at every frame              } work area is kept

Rerun counts pixels from the corner of the top-left one, so pixels are half a pixel more than ours. A recording holds
the time of its making, so equal sequences do not give equal bytes.
"""

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64, Int64, UInt8

from perpetua.errors import EnvironmentSetupError
from perpetua.formats.rerun_layout import viewer_layout
from perpetua.formats.rerun_meshes import entity_name, still_meshes, vertex_colours, vertex_normals
from perpetua.formats.source import HALF_PIXEL_PX, ExportSource, image_size_px
from perpetua.geometry.transforms import invert_rigid
from perpetua.machine.extras import missing_extra
from perpetua.scene.scene import Scene

TRAIL_FRAMES = 12
MOVING_M = 0.05
_MILLIMETRES_PER_METRE = 1000.0
_FARTHEST_MM = 65535.0


class RerunRecording:
    """A recording for Rerun's viewer."""

    def write(self, source: ExportSource, folder: Path) -> None:
        """Writes ``<sequence>.rrd`` into ``folder``.

        Raises:
            EnvironmentSetupError: Rerun's SDK is not installed.
        """
        save_recording(source, folder / f"{source.name}.rrd")


def save_recording(source: ExportSource, target: Path) -> None:
    """Writes a recording.

    Raises:
        EnvironmentSetupError: Rerun's SDK is not installed.
    """
    rr = _sdk()
    stream = rr.RecordingStream("perpetua", recording_id=source.name)
    stream.save(str(target))
    _record(rr, stream, source)


def open_viewer(source: ExportSource) -> None:
    """Starts Rerun's viewer, or takes the one that runs, and sends it the recording.

    Raises:
        EnvironmentSetupError: Rerun's SDK is not installed, or its viewer does not start.
    """
    rr = _sdk()
    stream = rr.RecordingStream("perpetua", recording_id=source.name)
    try:
        stream.spawn()
    except (RuntimeError, OSError) as error:
        raise EnvironmentSetupError(
            f"Rerun's viewer does not start ({error}): give --out FILE.rrd, and open that file elsewhere"
        ) from None
    _record(rr, stream, source)


def _sdk() -> Any:
    try:
        return import_module("rerun")
    except ImportError:
        raise missing_extra("a Rerun recording", "rerun-sdk", "rerun") from None


def _record(rr: Any, stream: Any, source: ExportSource) -> None:
    # Made the active one: the viewer would go on with the layout of another sequence, of other views.
    stream.send_blueprint(viewer_layout(source), make_active=True, make_default=True)
    stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    pixels_px = tuple(source.track_pixel_px(view) for view in range(len(source.sequence.views)))
    recording = _Recording(rr, stream, source, pixels_px, _track_colours(source), _tracks_by_object(source))
    for view in range(len(source.sequence.views)):
        recording.log_pinholes(view)
    if source.meshes is not None:
        recording.log_still_meshes(source.meshes)
    for frame in range(len(source.sequence.tracks_m)):
        stream.set_time("frame", sequence=frame)
        stream.set_time("time", duration=frame / source.fps)
        for view in range(len(source.sequence.views)):
            recording.log_view(view, frame)
        recording.log_tracks(frame)
        if source.meshes is not None:
            recording.log_people(source.meshes, frame)
    stream.flush(blocking=True)
    stream.disconnect()


@dataclass(frozen=True)
class _Recording:
    """A sequence on its way into a recording; ``rr`` is the SDK, ``stream`` its open recording."""

    rr: Any
    stream: Any
    source: ExportSource
    pixels_px: tuple[Float64[np.ndarray, "F P 2"], ...]
    colours: UInt8[np.ndarray, "P 3"]
    groups: dict[str, Int64[np.ndarray, " _"]]

    def log_pinholes(self, index: int) -> None:
        """What does not change of a view."""
        view = self.source.sequence.views[index]
        fx_px, fy_px, cx_px, cy_px = view.intrinsics_px.tolist()
        pinhole = self.rr.Pinhole(
            focal_length=[fx_px, fy_px],
            principal_point=[cx_px + HALF_PIXEL_PX, cy_px + HALF_PIXEL_PX],
            resolution=image_size_px(view),
            camera_xyz=self.rr.ViewCoordinates.RDF,
            image_plane_distance=0.4,
        )
        self.stream.log(f"world/view_{index}/image", pinhole, static=True)
        if view.depth_m is not None:
            self.stream.log(f"world/view_{index}/depth", pinhole, static=True)

    def log_still_meshes(self, meshes: Scene) -> None:
        """The room, and of the people what does not move: triangles and colours."""
        for still in still_meshes(self.source, meshes):
            mesh = self.rr.Mesh3D(
                vertex_positions=still.vertices_m,
                triangle_indices=still.faces,
                vertex_normals=vertex_normals(still.vertices_m.astype(np.float32), still.faces),
                albedo_factor=still.colour,
            )
            self.stream.log(still.path, mesh, static=True)
        for actor in meshes.actors:
            surface = self.rr.Mesh3D.from_fields(triangle_indices=actor.faces, vertex_colors=vertex_colours(actor))
            self.stream.log(self._person_path(actor.object_index), surface, static=True)

    def log_people(self, meshes: Scene, frame: int) -> None:
        """Where the vertices of the people are at a frame."""
        for actor in meshes.actors:
            vertices_m = np.asarray(actor.vertices_m[frame])
            normals = vertex_normals(vertices_m, actor.faces)
            moved = self.rr.Mesh3D.from_fields(vertex_positions=vertices_m, vertex_normals=normals)
            self.stream.log(self._person_path(actor.object_index), moved)

    def _person_path(self, object_index: int) -> str:
        return f"world/people/{entity_name(self.source, object_index)}"

    def log_view(self, index: int, frame: int) -> None:
        """Pose, image, depth and seen tracks of a view at a frame."""
        view, path = self.source.sequence.views[index], f"world/view_{index}"
        pose = invert_rigid(view.camera_from_world[frame].astype(np.float64))
        self.stream.log(path, self.rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3]))
        image = self.rr.EncodedImage(contents=view.jpeg[frame].tobytes(), media_type="image/jpeg")
        self.stream.log(f"{path}/image", image)
        if view.depth_m is not None:
            depth_mm = np.rint(self.source.depth_m(index, frame) * _MILLIMETRES_PER_METRE)
            # What is too far for 16 bits is shown as nothing, not as near.
            depth_mm = np.where(depth_mm > _FARTHEST_MM, 0.0, depth_mm).astype(np.uint16)
            self.stream.log(f"{path}/depth", self.rr.DepthImage(depth_mm, meter=_MILLIMETRES_PER_METRE))
        seen = np.flatnonzero(view.visible[frame])
        pixel_px = self.pixels_px[index][frame, seen] + HALF_PIXEL_PX
        points = self.rr.Points2D(pixel_px, colors=self.colours[seen], radii=1.5)
        self.stream.log(f"{path}/image/tracks", points)

    def log_tracks(self, frame: int) -> None:
        """Tracks by object, and lines behind those that moved within the trail: static ones would only clutter."""
        tracks_m = self.source.sequence.tracks_m
        for name, chosen in self.groups.items():
            points = self.rr.Points3D(tracks_m[frame, chosen], colors=self.colours[chosen], radii=0.012)
            self.stream.log(f"world/tracks/{name}", points)
        trail_m = tracks_m[max(0, frame - TRAIL_FRAMES) : frame + 1]
        moving = np.flatnonzero(np.ptp(trail_m, axis=0).max(axis=1) > MOVING_M)
        lines = self.rr.LineStrips3D(np.swapaxes(trail_m[:, moving], 0, 1), colors=self.colours[moving])
        self.stream.log("world/trails", lines)


def _tracks_by_object(source: ExportSource) -> dict[str, Int64[np.ndarray, " _"]]:
    """Tracks of each object under the name that its mesh has."""
    return {
        entity_name(source, index): np.flatnonzero(source.track_object == index)
        for index in np.unique(source.track_object).tolist()
    }


def _track_colours(source: ExportSource) -> UInt8[np.ndarray, "P 3"]:
    """One colour per object: people bright, objects pale."""
    palette = {index: source.object_colour(index) for index in np.unique(source.track_object).tolist()}
    return np.array([palette[index] for index in source.track_object.tolist()], np.uint8).reshape(-1, 3)
