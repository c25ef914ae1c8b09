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
SURFACE = "surface_xyz.npy"
