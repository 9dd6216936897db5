"""Products and lengths of arrays of vectors, and which numbers count as alike."""

from __future__ import annotations

import numpy as np

from archord.materials.material import Array

ALIKE = 1e-7  # relative difference of values that images in a mirror have, too


def unit(vectors: Array) -> Array:
    """The ``vectors`` ``(..., d)`` over their lengths."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def crossed(a: Array, b: Array) -> Array:
    """The component ``(...)`` out of the plane of the products ``a x b`` of vectors ``(...,
    2)``."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
