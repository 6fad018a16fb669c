#!/usr/bin/python3
"""A rubber cube on a rigid plane as a script on FEniCSx and SNES: a reference for run times in 3D.

The script computes this one scene only:
- a cube of 0.1 m of n by n by n trilinear hexahedra, pressed by a tenth of its height and dragged at
  1 m/s in a direction at tan = 0.5 to x;
- compressible neo-Hookean rubber with full integration;
- penalty contact with the plane z = 0 at the nodes of the base, weighted by the current area;
- Coulomb friction with the smooth law of velocity, (2.29) of docs/theory.md;
- Newmark's average acceleration;
- a frictionless static start in four increments.
UFL derives residual and tangent. Newton's method is SNES with the line search `cp`. Linear systems are
solved by GMRES with ILU(0), by GMRES with smoothed aggregation (GAMG, with the rigid motions), or by
MUMPS. The script is serial. Debian's package python3-dolfinx-real provides the dependencies.
docs/performance/against-a-script.md has the measurements.

usage: peer3d.py case N STEPS CASE.yml                   writes the same scene as a case of contact-petsc
       peer3d.py ilu|gamg|mumps N STEPS FORCES.csv [OPTIONS OF PETSC]
Writes t and the forces of the plane on the cube; prints counts and CPU seconds as JSON.
"""

import json
import sys
import time

SIDE, YOUNG, POISSON, DENSITY = 0.1, 5e6, 0.45, 1700.0
COMPLIANCE, FRICTION, STICK_VELOCITY = 1e-9, 0.5, 1e-2
PRESS, STEP, INCREMENTS = -0.01, 5e-4, 4
RISE = 0.002  # duration of the rise of the velocity
BETA, GAMMA = 0.25, 0.5
TOLERANCE = 1e-6  # of residuals, over the force on the plane at the start
FORCE = 6e3  # force on the plane at the start

CASE = """title: Cube of scripts/peer3d.py
dimension: 3
bodies:
  cube:
    mesh: {{ box: {{ min: [0, 0, 0], max: [{SIDE}, {SIDE}, {SIDE}], cells: [{cells}, {cells}, {cells}], element: hex8 }} }}
    material: {{ neo_hookean: {{ young_modulus: {YOUNG}, poisson_ratio: {POISSON} }} }}
    density: {DENSITY}
    locking: none
obstacles:
  floor: {{ plane: {{ point: [0, 0, 0], normal: [0, 0, 1] }} }}
contact:
  sole:
    contactor: cube.bottom
    target: floor
    normal: {{ penalty: {{ compliance: {COMPLIANCE} }} }}
    friction: {{ coulomb: {{ coefficient: {FRICTION}, regularization: {{ smooth_stick_velocity: {STICK_VELOCITY} }} }} }}
    initial_overclosure: accept
boundary:
  clamp:
    on: cube.top
    displacement:
      x: "if(t < 0.002, t/2 - 0.001/pi * sin(500*pi*t), t - 0.001)"
      y: "0.5 * if(t < 0.002, t/2 - 0.001/pi * sin(500*pi*t), t - 0.001)"
      z: {PRESS}
start: {{ equilibrium: {{ friction: false, increments: {INCREMENTS} }} }}
time: {{ end: {end}, step: {STEP}, scheme: newmark }}
solver: {{ newton: {{ tolerance: {TOLERANCE} }} }}
output: {{ fields: {{ every: 0 }} }}
"""


def write_case(cells, steps, path):
    """Writes the scene as a case of contact-petsc."""
    with open(path, "w") as file:
        file.write(CASE.format(**globals(), cells=cells, end=f"{steps * STEP:.6g}"))


if len(sys.argv) == 5 and sys.argv[1] == "case":
    write_case(int(sys.argv[2]), int(sys.argv[3]), sys.argv[4])
    sys.exit()
if len(sys.argv) < 5 or sys.argv[1] not in ("ilu", "gamg", "mumps"):
    sys.exit(__doc__)

import petsc4py

petsc4py.init(sys.argv[4:])

import numpy as np
import ufl
from dolfinx import fem, la, mesh
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc


def rigid_motions(space):
    """The six rigid motions of a body at its nodes, which GAMG needs."""
    places = space.tabulate_dof_coordinates()
    x, y, z = places.T
    vectors = [la.create_petsc_vector(space.dofmap.index_map, 3) for _ in range(6)]
    values = [vector.array.reshape(-1, 3) for vector in vectors]
    for axis in range(3):
        values[axis][:, axis] = 1.0
    for motion, (first, second, a, b) in zip(values[3:], [(0, 1, -y, x), (1, 2, -z, y), (2, 0, -x, z)]):
        motion[:, first], motion[:, second] = a, b
    la.orthonormalize(vectors)
    return PETSc.NullSpace().create(vectors=vectors)


class Balance:
    """Residual and tangent of a form, in the interface of SNES."""

    def __init__(self, residual, unknown, conditions, solver):
        self.unknown, self.conditions = unknown, conditions
        self.residual = fem.form(residual)
        self.tangent = fem.form(ufl.derivative(residual, unknown))
        self.matrix = petsc.create_matrix(self.tangent)
        self.matrix.setBlockSize(3)
        self.vector = petsc.create_vector(self.residual)
        self.seconds = dict(residual=0.0, tangent=0.0, total=0.0)
        self.newton = self.krylov = 0
        self.snes = PETSc.SNES().create(MPI.COMM_SELF)
        self.snes.setFunction(self.evaluate, self.vector)
        self.snes.setJacobian(self.assemble, self.matrix)
        self.snes.setType("newtonls")
        options = PETSc.Options()
        ksp = self.snes.getKSP()
        if solver == "mumps":
            settings = dict(ksp_type="preonly", pc_type="lu", pc_factor_mat_solver_type="mumps")
        else:
            settings = dict(ksp_type="gmres", pc_type=solver, ksp_gmres_restart=200, ksp_max_it=2000)
        settings["snes_linesearch_type"] = "cp"
        for name, value in settings.items():
            if not options.hasName(name):
                options[name] = value
        if solver == "gamg":
            self.matrix.setNearNullSpace(rigid_motions(unknown.function_space))
        self.snes.setFromOptions()
        ksp.setFromOptions()

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

    def solve(self, scale):
        """Runs Newton's method until the residual is `TOLERANCE` times the force `scale`."""
        start = time.process_time()
        self.snes.setTolerances(rtol=0.0, atol=TOLERANCE * scale, stol=0.0, max_it=25)
        x = self.unknown.vector.copy()
        self.snes.solve(None, x)
        self.newton += self.snes.getIterationNumber()
        self.krylov += self.snes.getLinearSolveIterations()
        self.seconds["total"] += time.process_time() - start
        if self.snes.getConvergedReason() <= 0:
            raise SystemExit(f"no balance: reason {self.snes.getConvergedReason()} of SNES")
        x.copy(self.unknown.vector)

    def report(self):
        other = self.seconds["residual"] + self.seconds["tangent"]
        return dict(
            newton=self.newton, krylov=self.krylov, cpu=round(self.seconds["total"], 2),
            residual=round(self.seconds["residual"], 2), tangent=round(self.seconds["tangent"], 2),
            solve=round(self.seconds["total"] - other, 2),
        )


def drag_at(t):
    """Displacement of the top along x: the velocity rises smoothly."""
    if t < RISE:
        return t / 2 - RISE / (2 * np.pi) * np.sin(np.pi * t / RISE)
    return t - RISE / 2


def main():
    solver, cells, steps, table = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
    domain = mesh.create_box(
        MPI.COMM_SELF, [(0.0, 0.0, 0.0), (SIDE, SIDE, SIDE)], [cells] * 3, mesh.CellType.hexahedron
    )
    space = fem.VectorFunctionSpace(domain, ("CG", 1))
    u, u0, v0, a0 = (fem.Function(space) for _ in range(4))
    test = ufl.TestFunction(space)

    base = mesh.locate_entities_boundary(domain, 2, lambda x: np.isclose(x[2], 0.0))
    tags = mesh.meshtags(domain, 2, np.sort(base), np.full(len(base), 1, dtype=np.int32))
    top = mesh.locate_entities_boundary(domain, 2, lambda x: np.isclose(x[2], SIDE))
    clamped = [fem.locate_dofs_topological(space.sub(i), 2, top) for i in range(3)]
    drag = [fem.Constant(domain, 0.0) for _ in range(3)]
    conditions = [fem.dirichletbc(drag[i], clamped[i], space.sub(i)) for i in range(3)]

    volume = ufl.Measure("dx", domain, metadata={"quadrature_degree": 2})
    sole = ufl.Measure(
        "ds", domain, subdomain_data=tags, metadata={"quadrature_rule": "GLL", "quadrature_degree": 1}
    )(1)

    shear, lame = YOUNG / (2 * (1 + POISSON)), YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
    gradient = ufl.variable(ufl.Identity(3) + ufl.grad(u))
    jacobian = ufl.det(gradient)
    energy = shear / 2 * (ufl.tr(gradient.T * gradient) - 3 - 2 * ufl.ln(jacobian)) + lame / 2 * ufl.ln(jacobian) ** 2
    internal = ufl.inner(ufl.diff(energy, gradient), ufl.grad(test)) * volume

    along, across = u.dx(0), u.dx(1)
    area_vector = ufl.cross(
        ufl.as_vector((1 + along[0], along[1], along[2])), ufl.as_vector((across[0], 1 + across[1], across[2]))
    )
    area = ufl.sqrt(ufl.inner(area_vector, area_vector))
    gap = ufl.SpatialCoordinate(domain)[2] + u[2]
    pressure = ufl.conditional(ufl.le(gap, 0), -gap / COMPLIANCE, 0.0)
    normal = -pressure * test[2] * area * sole

    dt = STEP
    acceleration = (u - u0 - dt * v0) / (BETA * dt**2) - (1 / (2 * BETA) - 1) * a0
    velocity = v0 + dt * ((1 - GAMMA) * a0 + GAMMA * acceleration)
    slip = ufl.as_vector((velocity[0], velocity[1]))
    sense = slip / ufl.sqrt(ufl.inner(slip, slip) + STICK_VELOCITY**2)
    friction = FRICTION * pressure * ufl.inner(sense, ufl.as_vector((test[0], test[1]))) * area * sole
    inertia = DENSITY * ufl.inner(acceleration, test) * volume

    press = Balance(internal + normal, u, conditions, solver)
    motion = Balance(internal + normal + inertia + friction, u, conditions, solver)
    total = [fem.form(pressure * area * sole)]
    total += [fem.form(-FRICTION * pressure * sense[i] * area * sole) for i in range(2)]
    begin = time.process_time()
    for increment in range(1, INCREMENTS + 1):
        drag[2].value = PRESS * increment / INCREMENTS
        press.solve(FORCE * increment / INCREMENTS)
    middle = time.process_time()

    u0.x.array[:] = u.x.array
    rows = [[0.0, fem.assemble_scalar(total[0]), 0.0, 0.0]]
    for step in range(1, steps + 1):
        t = step * STEP
        drag[0].value, drag[1].value = drag_at(t), 0.5 * drag_at(t)
        motion.solve(FORCE)
        change = u.x.array - u0.x.array
        a1 = (change - dt * v0.x.array) / (BETA * dt**2) - (1 / (2 * BETA) - 1) * a0.x.array
        v1 = v0.x.array + dt * ((1 - GAMMA) * a0.x.array + GAMMA * a1)
        rows.append([t] + [fem.assemble_scalar(form) for form in total])
        u0.x.array[:], v0.x.array[:], a0.x.array[:] = u.x.array, v1, a1
    end = time.process_time()
    np.savetxt(table, rows, delimiter=",", header="t [s],f_n [N],f_x [N],f_y [N]", comments="")
    print(json.dumps(dict(
        solver=solver, unknowns=3 * (cells + 1) ** 3, steps=steps,
        start_cpu=round(middle - begin, 2), steps_cpu=round(end - middle, 2),
        start=press.report(), motion=motion.report(),
    )))


main()
