#!/usr/bin/env python3
"""The error figures of two fixed pictures, by other people's programs: what src/report/errors_tests.rs holds ours to.

    pip install numpy scipy flip-evaluator && python3 tools/figures/error_figures.py

The pictures are exact in 32-bit floats. SSIM by SciPy's filters as Wang et al. define it (Gaussian window of 11 x 11,
sigma 1.5), windows normalised at borders; FLIP by NVIDIA's own evaluator on sRGB bytes.
"""

import flip_evaluator
import numpy as np
from scipy.ndimage import gaussian_filter

WIDTH, HEIGHT = 48, 32
y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.int64)

# Radiance.
base = (x * 7 + y * 13) % 17 / 8 + 0.25
reference = np.stack([base, 0.5 * base, 0.25 * base], -1)
picture = reference * (1 + ((x * 5 + y * 3) % 11 - 5) / 32)[..., None]

squared = (picture - reference) ** 2
print("rmse", np.sqrt(squared.mean()))
relative = squared / (reference**2 + 1e-2 * reference.mean() ** 2)
print("relative mse", relative.mean())
print("energy", picture.mean() / reference.mean())
of_pixels = np.sort(np.sqrt(relative.mean(-1)).ravel())
print("p95", of_pixels[int(np.ceil(0.95 * of_pixels.size)) - 1])

luminance = np.array([0.2126, 0.7152, 0.0722])
a, b = picture @ luminance, reference @ luminance
largest = np.sort(b.ravel())[int(np.ceil(0.95 * b.size)) - 1]


def blur(plane):
    filtered = lambda p: gaussian_filter(p, 1.5, mode="constant", truncate=5 / 1.5)
    return filtered(plane) / filtered(np.ones_like(plane))


mean_a, mean_b = blur(a), blur(b)
var_a, var_b, cov = blur(a * a) - mean_a**2, blur(b * b) - mean_b**2, blur(a * b) - mean_a * mean_b
c1, c2 = (0.01 * largest) ** 2, (0.03 * largest) ** 2
ssim = (2 * mean_a * mean_b + c1) * (2 * cov + c2) / ((mean_a**2 + mean_b**2 + c1) * (var_a + var_b + c2))
print("ssim", ssim.mean())

# Bytes of a display.
channel = np.arange(3)
shown = (x[..., None] * 5 + y[..., None] * 3 + channel * 53) % 256
changed = (shown + (x[..., None] * 11 + y[..., None] * 7 + channel * 29) % 41) % 256
of = lambda image: (image / 255).astype(np.float32)
flip, mean, _ = flip_evaluator.evaluate(of(shown), of(changed), "LDR", applyMagma=False, parameters={"ppd": 67})
flip = np.sort(np.asarray(flip).reshape(HEIGHT, WIDTH, -1)[..., 0].ravel())
print("flip mean", mean, "p95", flip[int(np.ceil(0.95 * flip.size)) - 1])
