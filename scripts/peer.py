#!/usr/bin/python3
"""The rubber block of meshes/rubber-block/case.yml as a script on FEniCSx, SNES and MUMPS: a reference
for run times.

The script computes this one scene only:
- unit-thickness plane strain on n by n bilinear quadrilaterals;
- compressible neo-Hookean rubber with full integration;
- penalty contact with the plane y = 0 at the nodes of the base, weighted by the current area;
- Coulomb friction regularised by a velocity, with the smooth law, which suits Newton's method better;
- Newmark's average acceleration;
- a frictionless static start in four increments.
UFL derives residual and tangent. Newton's method (SNES with backtracking) factorises every tangent
with MUMPS. The script is serial. Debian's package python3-dolfinx-real provides the dependencies.
docs/performance/against-a-script.md has the measurements.

usage: peer.py N FORCES.csv [STEPS]
Writes t and the forces of the plane on the block; prints counts and CPU seconds as JSON.
"""

import json
import sys
import time

import numpy as np
import ufl
from dolfinx import fem, mesh
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc

YOUNG, POISSON, DENSITY = 5e6, 0.45, 1700.0
COMPLIANCE, FRICTION, STICK_VELOCITY = 1e-10, 1.0, 1e-3
PRESS, SPEED, STEP, STEPS, INCREMENTS = -0.05, 1.0, 5e-4, 140, 4
BETA, GAMMA = 0.25, 0.5
SECANTS = 5
FORCE = 3.7e5  # force on the plane at the start: the scale of residuals


class Balance:
    """Residual and tangent of a form, in the interface of SNES."""

    def __init__(self, residual, unknown, conditions):
        self.unknown, self.conditions = unknown, conditions
        self.residual = fem.form(residual)
        self.tangent = fem.form(ufl.derivative(residual, unknown))
        self.matrix = petsc.create_matrix(self.tangent)
        self.vector = petsc.create_vector(self.residual)
        self.seconds = dict(residual=0.0, tangent=0.0, total=0.0)
        self.newton = 0
        self.snes = PETSc.SNES().create(MPI.COMM_SELF)
        self.snes.setFunction(self.evaluate, self.vector)
        self.snes.setJacobian(self.assemble, self.matrix)
        self.snes.setType("newtonls")
        PETSc.Options()["snes_linesearch_type"] = "bt"
        self.snes.setFromOptions()
        solver = self.snes.getKSP()
        solver.setType("preonly")
        solver.getPC().setType("lu")
        solver.getPC().setFactorSolverType("mumps")

    def evaluate(self, snes, x, f):
        start = time.process_time()
        x.copy(self.unknown.vector)
        with f.localForm() as local:
            local.set(0.0)
        petsc.assemble_vector(f, self.residual)
        petsc.apply_lifting(f, [self.tangent], [self.conditions], [x], -1.0)
        petsc.set_bc(f, self.conditions, x, -1.0)
        self.seconds["residual"] += time.process_time() - start

    def assemble(self, snes, x, matrix, preconditioner):
        start = time.process_time()
        matrix.zeroEntries()
        petsc.assemble_matrix(matrix, self.tangent, self.conditions)
        matrix.assemble()
        self.seconds["tangent"] += time.process_time() - start

    def solve(self, scale, tolerance):
        """Runs Newton's method until the residual is `tolerance` times the force `scale`; returns whether it
        converged."""
        start = time.process_time()
        self.snes.setTolerances(rtol=0.0, atol=tolerance * scale, stol=0.0, max_it=12)
        before, x = self.unknown.vector.copy(), self.unknown.vector.copy()
        self.snes.solve(None, x)
        self.newton += self.snes.getIterationNumber()
        self.seconds["total"] += time.process_time() - start
        converged = self.snes.getConvergedReason() > 0
        (x if converged else before).copy(self.unknown.vector)
        return converged


def main():
    cells, table = int(sys.argv[1]), sys.argv[2]
    tolerance, steps = 1e-9, int(sys.argv[3]) if len(sys.argv) > 3 else STEPS
    domain = mesh.create_rectangle(
        MPI.COMM_SELF, [(0.0, 0.0), (0.48, 0.5)], [cells, cells], mesh.CellType.quadrilateral
    )
    space = fem.VectorFunctionSpace(domain, ("CG", 1))
    u, u0, v0, a0 = (fem.Function(space) for _ in range(4))
    test = ufl.TestFunction(space)

    base = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[1], 0.0))
    tags = mesh.meshtags(domain, 1, np.sort(base), np.full(len(base), 1, dtype=np.int32))
    top = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[1], 0.5))
    clamped = [fem.locate_dofs_topological(space.sub(i), 1, top) for i in range(2)]
    along, down = (fem.Constant(domain, 0.0) for _ in range(2))
    conditions = [fem.dirichletbc(along, clamped[0], space.sub(0)), fem.dirichletbc(down, clamped[1], space.sub(1))]

    volume = ufl.Measure("dx", domain, metadata={"quadrature_degree": 2})
    sole = ufl.Measure(
        "ds", domain, subdomain_data=tags, metadata={"quadrature_rule": "GLL", "quadrature_degree": 1}
    )(1)

    shear, lame = YOUNG / (2 * (1 + POISSON)), YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
    gradient = ufl.variable(ufl.Identity(2) + ufl.grad(u))
    jacobian = ufl.det(gradient)
    energy = shear / 2 * (ufl.tr(gradient.T * gradient) - 2 - 2 * ufl.ln(jacobian)) + lame / 2 * ufl.ln(jacobian) ** 2
    internal = ufl.inner(ufl.diff(energy, gradient), ufl.grad(test)) * volume

    area = ufl.sqrt((1 + u[0].dx(0)) ** 2 + u[1].dx(0) ** 2)
    gap = ufl.SpatialCoordinate(domain)[1] + u[1]
    pressure = ufl.conditional(ufl.le(gap, 0), -gap / COMPLIANCE, 0.0)
    normal = -pressure * test[1] * area * sole

    dt = STEP
    acceleration = (u - u0 - dt * v0) / (BETA * dt**2) - (1 / (2 * BETA) - 1) * a0
    velocity = v0 + dt * ((1 - GAMMA) * a0 + GAMMA * acceleration)
    speed = velocity[0]
    sense = speed / ufl.sqrt(speed**2 + STICK_VELOCITY**2)
    friction = FRICTION * pressure * sense * test[0] * area * sole
    last = fem.Function(space)  # velocity of the previous iterate, for the secant of the law
    secant = speed / ufl.sqrt(last[0]**2 + STICK_VELOCITY**2)
    lagged = FRICTION * pressure * secant * test[0] * area * sole
    inertia = DENSITY * ufl.inner(acceleration, test) * volume

    begin = time.process_time()
    press = Balance(internal + normal, u, conditions)
    for increment in range(1, INCREMENTS + 1):
        down.value = PRESS * increment / INCREMENTS
        if not press.solve(FORCE * increment / INCREMENTS, tolerance):
            raise SystemExit("no static equilibrium")

    motion = Balance(internal + normal + inertia + friction, u, conditions)
    slow = Balance(internal + normal + inertia + lagged, u, conditions)
    total = [fem.form(pressure * area * sole), fem.form(-FRICTION * pressure * sense * area * sole)]
    v1, a1 = fem.Function(space), fem.Function(space)
    v0.x.array[:] = 0.0
    u0.x.array[:] = u.x.array
    v0.x.array[clamped[0]] = SPEED
    rows = []

    def acceleration_of(end):
        return (end - u0.x.array - STEP * v0.x.array) / (BETA * STEP**2) - (1 / (2 * BETA) - 1) * a0.x.array

    def velocity_of(end):
        return v0.x.array + STEP * ((1 - GAMMA) * a0.x.array + GAMMA * acceleration_of(end))

    def advance(end):
        """Computes one step. Where slip reverses, Newton's method cycles between the branches of the law; the
        secant of the law breaks the cycle."""
        along.value = SPEED * end
        tries = 0
        while not motion.solve(FORCE, tolerance):
            if (tries := tries + 1) > 10:
                return False
            for _ in range(SECANTS):
                last.x.array[:] = velocity_of(u.x.array)
                slow.solve(FORCE, tolerance)
        v1.x.array[:], a1.x.array[:] = velocity_of(u.x.array), acceleration_of(u.x.array)
        rows.append([end] + [fem.assemble_scalar(form) for form in total])
        for old, new in ((u0, u), (v0, v1), (a0, a1)):
            old.x.array[:] = new.x.array
        return True

    done = next((step for step in range(steps) if not advance((step + 1) * STEP)), steps)
    if done < steps:
        print(f"no balance at {(done + 1) * STEP} s", file=sys.stderr)
    seconds = time.process_time() - begin
    np.savetxt(table, rows, delimiter=",", header="t [s],f_n [N],f_t [N]", comments="")
    newton = press.newton + motion.newton + slow.newton
    parts = {key: sum(balance.seconds[key] for balance in (press, motion, slow)) for key in press.seconds}
    print(json.dumps(dict(
        cells=cells, steps=done, newton=newton, cpu=round(seconds, 2), cpu_per_newton_ms=round(1e3 * seconds / newton, 1),
        residual=round(parts["residual"], 2), tangent=round(parts["tangent"], 2),
        factorise_and_solve=round(parts["total"] - parts["residual"] - parts["tangent"], 2),
    )))


main()
