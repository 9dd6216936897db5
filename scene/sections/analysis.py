"""How a scene is modelled and solved, and what is written: model, solver, steps, output."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from archord.report.by_name import Amounts
from archord.scene.sections.keys import Positive, Section, after, key, require

_STUCK = 1000.0  # coefficient of friction from which points are meant to stick
_COERCIVE = 0.25  # gamma over the trace constant, from which on Nitsche's form is coercive
Accuracy = Annotated[float, Field(ge=1e-5, le=0.1)]
Side = Literal["both", "pin", "block"]


def friction_doubts(frictions: Amounts) -> list[str]:
    """A question for each coefficient, by its key, that may be one in per cent."""
    doubted = {name: friction for name, friction in frictions.items() if 2 < friction < _STUCK}
    return [
        f"{name} = {friction:g} is far above what surfaces have: is it in per cent? Then give "
        f"{friction / 100:g}"
        for name, friction in doubted.items()
    ]


class Modelling(Section):
    """How a problem is modelled and solved."""

    plane: Literal["strain", "stress"] = key("plane strain or plane stress", default="strain")
    strain: Literal["small", "large"] = key(
        "small strains, or large ones by logarithms", default="small"
    )
    kinematics: Literal["current", "reference"] = key(
        "closest points on deformed curves, or fixed", default="current"
    )
    gamma_factor: float = key(
        "Nitsche's gamma over trace constant; coercive above 0.25; with friction twice as much "
        "where one side alone is integrated, as the other is held or loaded",
        default=0.5,
        ge=1e-3,
        le=1e6,
    )
    accuracy: Accuracy | None = key(
        "relative error of P (under a force: of delta) to reach by mesh and steps", other=0.001
    )
    degree: Literal[2, 3] = key(
        "polynomial degree of displacements and of the curved geometry", default=2
    )
    thickness: Positive | None = key(
        "thickness; forces and energies are per unit if absent", "length", other=10.0
    )
    tolerance: float = key(
        "residual over reaction at which Newton stops", default=1e-10, ge=1e-12, le=1e-4
    )
    max_iterations: int = key("Newton iterations before a step is cut", default=25, ge=2, le=1000)

    @after
    def _large(self):
        require(
            self.strain == "small" or self.kinematics == "current",
            "kinematics",
            'must be "current" at large strain',
        )
        return self

    @property
    def doubts(self) -> list[str]:
        """What to warn of before anything is solved."""
        if self.gamma_factor >= _COERCIVE:
            return []
        return [
            f"analysis.gamma_factor = {self.gamma_factor:g} is below {_COERCIVE:g}, where "
            "Nitsche's form is not coercive: forces and pressures may be wrong by a tenth and "
            "more; the default is 0.5"
        ]


class PresetAnalysis(Modelling):
    """How a preset is modelled and solved."""

    friction: float = key(
        "Coulomb's coefficient of friction of all contacts", default=0.0, ge=0, le=1e6
    )


class Analysis(PresetAnalysis):
    """How the joint is modelled and solved."""

    coarse_start: bool = key(
        "guess every step on a fine mesh from a coarser one; false: for comparison", default=True
    )
    integration: Side = key(
        "edge of the contact integral: both (unbiased), or the edge of one body", default="both"
    )


class ProblemAnalysis(Modelling):
    """How a general problem is modelled and solved."""

    plane: Literal["strain", "stress", "axisymmetric", "space"] = key(  # type: ignore[assignment]
        "plane strain, plane stress, bodies of revolution about x = 0 (x is the radius), or bodies "
        "in space, the default for a mesh of tetrahedra or hexahedra",
        default="strain",
    )
    symmetry: int = key(
        "how many times the part makes up the whole; results are of the whole",
        default=1,
        ge=1,
        le=100,
    )

    @after
    def _whole_rings(self):
        is_ring = self.plane == "axisymmetric"
        said = "is for planes: axisymmetric forces are of the whole ring"
        require(not is_ring or self.thickness is None, "thickness", said)
        said = "must be 1, or 2 for a half that is cut across the axis, as bodies are whole rings"
        require(not is_ring or self.symmetry <= 2, "symmetry", said)
        return self

    @property
    def depth(self) -> float | None:
        """The thickness that forces are of, None per unit thickness.

        Forces around an axis are of the whole ring, which has no other thickness; forces in space
        are of whole bodies.
        """
        return 1.0 if self.plane in ("axisymmetric", "space") else self.thickness


class Stepping(Section):
    """Control of the steps between outputs; lengths are in output steps."""

    initial: float = key("length of the first step", default=1.0, gt=0, le=1)
    minimum: float = key("length below which a step is not cut", default=1e-3, gt=0, le=1)
    maximum: float = key("length beyond which a step does not grow", default=1.0, gt=0, le=1)
    growth: float = key("factor on the length after an easy step", default=2.0, ge=1, le=10)
    cutback: float = key("factor on the length after a failed step", default=0.5, ge=0.05, le=0.9)
    target_iterations: int = key(
        "Newton iterations up to which a step was easy", default=15, ge=1, le=1000
    )

    @after
    def _ordered(self) -> Stepping:
        require(
            self.minimum <= self.initial <= self.maximum,
            "initial",
            "must be between stepping.minimum and maximum",
        )
        return self


class Output(Section):
    """What a run writes besides its curves."""

    fields: Literal[False, "cells", "nodes", "points"] = key(
        "write the fields of every step to fields.h5 and fields.xdmf: stress and plastic strain "
        "as means of cells, or also at the nodes, or also at the integration points; false writes "
        "none, true is the default; sweeps: false",
        default="cells",
    )
    contact: bool = key(
        "write the contact along the surfaces at every step to contact.h5; sweeps: false",
        default=True,
    )
    checkpoint: bool = key(
        "write the state after every step to checkpoint.h5, from which a run can be continued; "
        "sweeps: false",
        default=True,
    )

    @model_validator(mode="before")
    @classmethod
    def _level(cls, data: Any) -> Any:
        """True is the default; scenes of older versions have the keys stress (at the nodes) and
        points."""
        if not isinstance(data, dict) or not isinstance(data.get("fields", True), bool):
            return data
        default = cls.model_fields["fields"].default
        old = {
            name: data[name] for name in ("stress", "points") if isinstance(data.get(name), bool)
        }
        level = "nodes" if old.get("stress", default == "nodes") else "cells"
        found = "points" if old.get("points") else level
        return {k: v for k, v in data.items() if k not in old} | {
            "fields": data.get("fields", True) and found
        }


class ProblemOutput(Output):
    """What a run of a general scene writes."""

    fields: Literal[False, "cells", "nodes", "points"] = key(
        str(Output.model_fields["fields"].description), default="nodes"
    )
