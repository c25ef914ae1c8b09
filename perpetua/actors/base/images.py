"""What painted textures of skin, hair and cloth have in common: seamless noise, and sRGB."""

import numpy as np
from jaxtyping import Float64, UInt8


def tileable_noise(rng: np.random.Generator, size_px: int, cells: int, octaves: int) -> Float64[np.ndarray, "S S"]:
    """Smooth noise around 0 with unit deviation that repeats without a seam."""
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(size_px), np.fft.fftfreq(size_px))) * size_px
    spectrum = np.fft.fft2(rng.standard_normal((size_px, size_px)))
    top = cells * 2.0 ** (octaves - 1)
    falloff = np.where(
        frequency > 0, np.maximum(frequency, cells) ** -1.2 * np.exp(-((frequency / (2.0 * top)) ** 4)), 0.0
    )
    noise = np.fft.ifft2(spectrum * falloff).real
    return np.asarray(noise / max(noise.std(), 1e-12))


def to_srgb(linear: Float64[np.ndarray, "*shape"]) -> UInt8[np.ndarray, "*shape"]:
    """Linear colour in [0, 1] as 8-bit sRGB (IEC 61966-2-1)."""
    clipped = np.clip(linear, 0.0, 1.0)
    encoded = np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1.0 / 2.4) - 0.055)
    return np.round(255.0 * encoded).astype(np.uint8)
