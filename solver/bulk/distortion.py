"""How far cells are strained, turned and turned inside out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import basix
import numpy as np
from dolfinx import fem

from archord.geometry.basis import Array, cell_basis
from archord.geometry.strain import PointStrain
from archord.materials.kinematics import SPACE, Ints, Kinematics


class Distortion(NamedTuple):
    """The largest principal ``strain`` at the middle of a cell, of the body with this ``tag``; the
    largest ``angle`` by which one turns, in radians; and how many cells are turned ``inside_out``,
    at a corner at least."""

    strain: float = 0.0
    tag: int = -1
    angle: float = 0.0
    inside_out: int = 0

    def joined(self, other: Distortion) -> Distortion:
        """The distortion of the cells of both."""
        strain, tag = max(self[:2], other[:2])
        angle = max(self.angle, other.angle)
        return Distortion(strain, tag, angle, self.inside_out + other.inside_out)


class DistortionMeter:
    """Measures the distortion of bodies, whose ``cells`` are given by their tags."""

    def __init__(
        self, V: fem.FunctionSpace, cells: Mapping[int, Ints], kinematics: Kinematics
    ) -> None:
        self.V = V
        self.cells = cells
        self.kinematics = kinematics
        self._gradients: dict[int, PointStrain] = {}

    def __call__(self, u: Array) -> Distortion:
        """The distortion of this rank's cells at the nodal displacements ``u`` ``(n_nodes, d)``."""
        worst = Distortion()
        distortion = _in_space if self.kinematics.dimension == 3 else _in_plane
        for tag in self.cells:
            gradient = self._gradient(tag)(u)
            worst = worst.joined(distortion(tag, gradient))
        return worst

    def _gradient(self, tag: int) -> PointStrain:
        """The displacement gradient at the middle of a body's cells, then at their corners."""
        if tag not in self._gradients:
            cells = self.cells[tag]
            corners = basix.geometry(self.V.mesh.basix_cell())
            X = np.vstack([corners.mean(axis=0), corners])
            degree = self.V.element.basix_element.degree
            basis = cell_basis(self.V.mesh, degree, cells, X)
            dofs = self.V.dofmap.list[cells]
            self._gradients[tag] = PointStrain(self.kinematics, basis, dofs, large=True)
        return self._gradients[tag]


def _in_plane(tag: int, gradient: Array) -> Distortion:
    """The distortion in a plane or around an axis at displacement gradients ``(n, 1 + corners,
    k)``, whose hoop strain, if there is one, comes behind the four in the plane."""
    xx, yy, xy, yx = np.moveaxis(gradient[..., :4], -1, 0)
    hoop = gradient[..., 4:]
    flipped = (1 + xx) * (1 + yy) <= xy * yx
    inside_out = flipped | (hoop <= -1).any(axis=-1)
    mean = np.abs(xx + yy) / 2
    in_plane = mean + np.hypot(xx - yy, xy + yx) / 2
    principal = np.maximum(in_plane, np.abs(hoop).max(axis=-1, initial=0.0))
    turned = np.abs(yx - xy) / 2
    return Distortion(
        strain=float(principal[:, 0].max(initial=0.0)),
        tag=tag,
        angle=float(turned[:, 0].max(initial=0.0)),
        inside_out=int(inside_out.any(axis=1).sum()),
    )


def _in_space(tag: int, gradient: Array) -> Distortion:
    """The distortion in space at displacement gradients ``(n, 1 + corners, 9)``."""
    H = np.zeros((*gradient.shape[:2], 3, 3))
    for k, (component, derivative) in enumerate(SPACE.terms):
        H[..., component, derivative] = gradient[..., k]
    at_middle = H[:, 0]
    transposed = np.swapaxes(at_middle, 1, 2)
    principal = np.linalg.eigvalsh((at_middle + transposed) / 2)
    turned = np.linalg.norm(at_middle - transposed, axis=(1, 2)) / np.sqrt(8)
    inside_out = np.linalg.det(np.eye(3) + H) <= 0
    return Distortion(
        strain=float(np.abs(principal).max(initial=0.0)),
        tag=tag,
        angle=float(turned.max(initial=0.0)),
        inside_out=int(inside_out.any(axis=1).sum()),
    )
