"""Labels of every pixel, computed from the meshes: normals, scene flow, optical flow between frames and views."""
