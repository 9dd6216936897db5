"""The paper's quarter joint by Kratos: ``python3 kratos_joint.py --case plastic --steps 20 --output
r.json``.

Needs KratosMultiphysics with its structural, contact, constitutive laws and linear solvers
applications, and gmsh (all of PyPI), and nothing of archord but `joint_script` beside it.

- Bodies: bilinear quadrilaterals with a mean volume change (B-bar), nodes on the circles. Kratos'
contact in planes knows edges with two nodes alone.
- Contact: Kratos' mortar contact with the augmented Lagrangian, frictionless, pairs on the deformed
mesh (kinematics "current"), where the joint yields pairs of the guess of each step.
- Plasticity: Kratos' J2 law in plane strain (return mapping), perfect.
- Kratos' Newton solver with Eigen's sparse LU.
"""

from __future__ import annotations

import json
from importlib.metadata import version

import KratosMultiphysics as KM
import KratosMultiphysics.ConstitutiveLawsApplication  # registers the J2 law
import KratosMultiphysics.ContactStructuralMechanicsApplication as CSMA
import KratosMultiphysics.LinearSolversApplication  # registers Eigen's solvers
import numpy as np
from joint_script import (
    BLOCK,
    DR,
    ITERATIONS,
    NU,
    PIN,
    SIGY,
    E,
    axis_pressure,
    main,
    mesh_quadrilaterals,
)
from KratosMultiphysics.ContactStructuralMechanicsApplication import (
    alm_contact_process,
    contact_structural_mechanics_static_solver,
)

UNIT = 1e6  # of stress, E*: tolerances of the J2 law are absolute
NEVER = 1e12  # a yield stress that is not reached
# the yield stress at first, and the yield stress that hardening ends at
YIELD = ("YIELD_STRESS", "EXPONENTIAL_SATURATION_YIELD_STRESS")
# Radius of the search over the length of an edge, and gap over this length below which a node
# starts in contact: nodes that start in contact with a gap are pulled, and yield.
SEARCH = {"type_search": "in_radius", "search_factor": 3.5, "active_check_factor": 1e-4}

SOLVER = {
    "solver_type": "Static",
    "model_part_name": "Joint",
    "domain_size": 2,
    "analysis_type": "non_linear",
    "model_import_settings": {"input_type": "use_input_model_part"},
    "time_stepping": {"time_step": 1.0},
    "contact_settings": {
        "mortar_type": "ALMContactFrictionless",
        "fancy_convergence_criterion": False,
        "contact_residual_relative_tolerance": 1e-8,
        "contact_residual_absolute_tolerance": 1e-13 * UNIT,
    },
    "convergence_criterion": "contact_residual_criterion",
    "residual_relative_tolerance": 1e-8,
    "residual_absolute_tolerance": 1e-13 * UNIT,
    "max_iteration": ITERATIONS,
    "reform_dofs_at_each_step": True,
    "linear_solver_settings": {"solver_type": "LinearSolversApplication.sparse_lu"},
}
CONTACT = {
    "model_part_name": "Joint",
    "contact_model_part": {"0": ["arcs"]},
    "assume_master_slave": {"0": ["arc_pin"]},
    "contact_type": "Frictionless",
    "search_parameters": SEARCH,
}


class Joint:
    """Kratos' model of half of the joint below the pin's diameter."""

    def __init__(self, size: float, growth: float, order: int, plastic: bool) -> None:
        KM.Logger.GetDefaultOutput().SetSeverity(KM.Logger.Severity.WARNING)
        self.model = KM.Model()
        self.part = part = self.model.CreateModelPart("Joint", 2)
        part.ProcessInfo.SetValue(KM.DOMAIN_SIZE, 2)
        # Its full method cycles between sets of touching nodes where the joint yields. The
        # simplified one keeps the pairs of the guess, which P tells in 2 steps, and not in 20.
        contact = SOLVER["contact_settings"] | {"simplified_semi_smooth_newton": plastic}
        settings = KM.Parameters(json.dumps(SOLVER | {"contact_settings": contact}))
        self.solver = contact_structural_mechanics_static_solver.CreateSolver(self.model, settings)
        self.solver.AddVariables()
        self.plastic = plastic
        self._bodies(size, growth)
        self._material()
        self.solver.ImportModelPart()
        self.solver.PrepareModelPart()
        self.solver.AddDofs()
        self._hold()
        self.contact = alm_contact_process.ALMContactProcess(
            self.model, KM.Parameters(json.dumps(CONTACT))
        )
        self.solver.Initialize()
        self.contact.ExecuteInitialize()
        self.contact.ExecuteBeforeSolutionLoop()
        self.nodes = part.Nodes
        self.dofs = 2 * len(self.nodes) + len(self.arc_pin.Nodes)
        self.zero = self._state()

    def _bodies(self, size: float, growth: float) -> None:
        """Both bodies' nodes and elements, and the edges of both arcs as conditions."""
        part = self.part
        self.properties = part.CreateNewProperties(1)
        arcs = part.CreateSubModelPart("arcs")
        element = f"SmallDisplacement{'Bbar' if self.plastic else ''}Element2D4N"
        for name, body in (("pin", PIN), ("block", BLOCK)):
            points, cells, edges = mesh_quadrilaterals(size, growth, body)
            first = part.NumberOfNodes() + 1
            own = part.CreateSubModelPart(name)
            for number, (x, y) in enumerate(points):
                own.CreateNewNode(first + number, x, y, 0.0)
            before = part.NumberOfElements() + 1
            for number, cell in enumerate(cells + first):
                own.CreateNewElement(element, before + number, cell.tolist(), self.properties)
            arc = part.CreateSubModelPart(f"arc_{name}")
            before = part.NumberOfConditions() + 1
            for where in (arcs, arc):
                where.AddNodes(np.unique(edges + first).tolist())
            for number, edge in enumerate(edges + first):
                arc.CreateNewCondition(
                    "LineCondition2D2N", before + number, edge.tolist(), self.properties
                )
            arcs.AddConditions([before + number for number in range(len(edges))])
        self.arc_pin = part.GetSubModelPart("arc_pin")

    def _material(self) -> None:
        """Elastic bodies, or bodies that yield, later."""
        law = "LinearElasticPlaneStrain2DLaw"
        values = {"YOUNG_MODULUS": E * UNIT, "POISSON_RATIO": NU}
        if self.plastic:
            law = "SmallStrainJ2PlasticityPlaneStrain2DLaw"
            values |= {"ISOTROPIC_HARDENING_MODULUS": 0.0, "HARDENING_EXPONENT": 1.0}
            values |= {name: NEVER for name in YIELD}
        material = {"constitutive_law": {"name": law}, "Variables": values, "Tables": {}}
        entry = {"model_part_name": "Joint", "properties_id": 1, "Material": material}
        read = KM.ReadMaterialsUtility(self.model)
        read.ReadMaterials(KM.Parameters(json.dumps({"properties": [entry]})))

    def _hold(self) -> None:
        """Hold the axis and the block's top, and prescribe the height of the pin's diameter."""
        self.top = []
        for node in self.part.GetSubModelPart("pin").Nodes:
            if abs(node.X0) < 1e-9:
                node.Fix(KM.DISPLACEMENT_X)
            if abs(node.Y0 + DR) < 1e-9:
                node.Fix(KM.DISPLACEMENT_Y)
                self.top.append(node)
        for node in self.part.GetSubModelPart("block").Nodes:
            on_top = abs(node.Y0) < 1e-9
            if abs(node.X0) < 1e-9 or on_top:
                node.Fix(KM.DISPLACEMENT_X)
            if on_top:
                node.Fix(KM.DISPLACEMENT_Y)

    def _state(self):
        """Displacements ``(2 n,)``, then multipliers ``(n,)``, of all nodes."""
        of_nodes = KM.VariableUtils().GetSolutionStepValuesVector
        u = np.array(of_nodes(self.nodes, KM.DISPLACEMENT, 0, 2))
        pressure = CSMA.LAGRANGE_MULTIPLIER_CONTACT_PRESSURE
        return np.concatenate([u, np.array(of_nodes(self.nodes, pressure, 0))])

    def _restore(self, state) -> None:
        """Write a `_state` into the nodes, and move them."""
        n = len(self.nodes)
        write = KM.VariableUtils().SetSolutionStepValuesVector
        write(self.nodes, KM.DISPLACEMENT, KM.Vector(state[: 2 * n]), 0)
        write(self.nodes, CSMA.LAGRANGE_MULTIPLIER_CONTACT_PRESSURE, KM.Vector(state[2 * n :]), 0)
        KM.VariableUtils().UpdateCurrentPosition(self.nodes, KM.DISPLACEMENT)

    def elastic(self, delta: float):
        """The state at ``delta`` of bodies that do not yield; from then on they do."""
        start = self.zero.copy()
        n_pin = self.part.GetSubModelPart("pin").NumberOfNodes()  # the first nodes
        start[1 : 2 * n_pin : 2] = -delta
        found = self.solve(start, delta)[0]
        if self.plastic:
            for name in YIELD:
                self.properties.SetValue(KM.KratosGlobals.GetVariable(name), SIGY * UNIT)
        return found

    def solve(self, guess, delta: float):
        """State of equilibrium from ``guess`` on, and iterations."""
        solver = self.solver
        solver.AdvanceInTime(self.part.ProcessInfo[KM.TIME])
        self._restore(guess)
        for node in self.top:
            node.SetSolutionStepValue(KM.DISPLACEMENT_Y, -delta)
        self.contact.ExecuteInitializeSolutionStep()
        solver.InitializeSolutionStep()
        solver.Predict()
        if not solver.SolveSolutionStep():
            raise RuntimeError("no equilibrium")
        return self._state(), int(self.part.ProcessInfo[KM.NL_ITERATION_NUMBER])

    def commit(self) -> None:
        """Take over the plastic strain of the state that was solved last."""
        self.solver.FinalizeSolutionStep()
        self.contact.ExecuteFinalizeSolutionStep()

    def results(self) -> dict[str, float | None]:
        """Force of the whole joint, and pressure on the axis from the pressures at nodes."""
        force = sum(node.GetSolutionStepValue(KM.REACTION_Y) for node in self.top)
        nodes = self.arc_pin.Nodes
        angle = np.array([np.arctan2(node.X0, -node.Y0 - DR) for node in nodes])
        pressure = np.array(
            [-node.GetValue(CSMA.AUGMENTED_NORMAL_CONTACT_PRESSURE) for node in nodes]
        )
        return {"P": -2 * force / UNIT, "p0": axis_pressure(angle, pressure / UNIT)}


if __name__ == "__main__":
    main(Joint, "current", version("KratosMultiphysics"), orders=(1,))
