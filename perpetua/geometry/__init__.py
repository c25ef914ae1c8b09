"""Meshes, frames and transforms, pinhole projection, ray casting. World: Z up, metres; camera: OpenCV axes."""
