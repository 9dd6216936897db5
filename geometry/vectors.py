"""Products and lengths of arrays of vectors."""

from __future__ import annotations

import numpy as np

from archord.materials.material import Array


def unit(vectors: Array) -> Array:
    """The ``vectors`` ``(..., d)`` over their lengths."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def crossed(a: Array, b: Array) -> Array:
    """The component ``(...)`` out of the plane of the products ``a x b`` of vectors ``(...,
    2)``."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
