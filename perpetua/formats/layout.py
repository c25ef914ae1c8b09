"""Names of the benchmark layout's files. F frames, P tracks; one folder 0, 1, 2, ... per view.

::

    tracks_xyz.npy             (F,P,3) float32   world positions, shared by all views
    queries_xytv.npy           (P,4)   float32   x, y in the queried view, 0-based frame, 0-based view
    <view>/images_jpeg_bytes.npy    (F,)    object    1-D uint8 arrays of JPEG bytes
    <view>/intrinsics.npy           (4,)    float32   fx, fy, cx, cy in pixels
    <view>/extrinsics_w2c.npy       (F,4,4) float32   world to camera, OpenCV axes
    <view>/visibility.npy           (F,P)   bool
    <view>/depth.npy                (F,H,W) float32   metres along Z, 0 = none
    <view>/foreground_mask.npy      (F,H,W) bool      true on actors

Ours, beside it::

    sequence.json              where it comes from; object, face, barycentric point and class of each track; sha256
    audit.json                 what the checks of the sequence and of its motion found
    surface_xyz.npy            (F,P,3,3) float32  world positions of the corners of each track's triangle
    object_poses.npy           (F,K,4,4) float32  world from object, for the K objects of sequence.json in their order;
                                          a person's frame is the pelvis (X forward, Y left), an object's stands upright
                                          in the middle of its box
    object_boxes.npy           (F,K,2,3) float32  lowest and highest corner of each object, in its own frame
    <view>/tracks_xy.npy       (F,P,2) float32    pixels of the tracks, also where hidden or off the image; NaN behind
                                          the camera

Labels of every pixel, by ``export.outputs``; where a pixel has no label, numbers are 0 and so is the state::

    <view>/object_index.npy    (F,H,W) uint16     index of the object in sequence.json; 0 = none
    <view>/normals.npy         (F,H,W,3) float32  unit normal of the triangle that the pixel's centre shows, in the
                                          camera's axes (X right, Y down, Z forward), on the side that the camera sees
    <view>/scene_flow.npy      (F-1,H,W,3) float32  metres along the world's axes that the pixel's point goes to the
                                          next frame; exactly 0 on what is rigid
    <view>/flow.npy            (F-1,H,W,2) float32  pixels from the pixel's centre to its point in the next frame
    <view>/flow_state.npy      (F-1,H,W) uint8    1 the next frame shows the point, 2 something hides it, 3 it is off
                                          the image, 0 there is no flow (no surface, or the point is behind the camera)
    <view>/flow_to_<b>.npy     (F,H,W,2) float32  the same to view b at the same frame (in the world nothing moves
    <view>/flow_to_<b>_state.npy (F,H,W) uint8    between views, so their scene flow is 0)
"""

TRACKS = "tracks_xyz.npy"
QUERIES = "queries_xytv.npy"
IMAGES = "images_jpeg_bytes.npy"
INTRINSICS = "intrinsics.npy"
EXTRINSICS = "extrinsics_w2c.npy"
VISIBILITY = "visibility.npy"
DEPTH = "depth.npy"
FOREGROUND = "foreground_mask.npy"
RECORD = "sequence.json"
AUDIT = "audit.json"
# Of the run, in the folder that holds the splits: one JSON object per line.
LOG_FILE = "log.jsonl"
SURFACE = "surface_xyz.npy"
POSES = "object_poses.npy"
BOXES = "object_boxes.npy"
TRACKS_2D = "tracks_xy.npy"
OBJECT_INDEX = "object_index.npy"
NORMALS = "normals.npy"
SCENE_FLOW = "scene_flow.npy"
FLOW = "flow.npy"
FLOW_STATE = "flow_state.npy"


def view_flow(other_view: int) -> str:
    """Name of the flow to another view."""
    return f"flow_to_{other_view}.npy"


def view_flow_state(other_view: int) -> str:
    """Name of the states of the flow to another view."""
    return f"flow_to_{other_view}_state.npy"
