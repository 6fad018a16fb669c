//! Volume terms of patches of elements, which share one pressure (theory, section 3.8).
//!
//! The volumetric energy of a patch is `V U(s_h)` at the mean `s_h` of the dilatation over the points of
//! all its elements. Its derivative is `p ds` at each point with the pressure `p = U'(s_h)`, and the second
//! derivative adds `U''(s_h) / V` times the square of the change of the volume to the terms at the points.
//! The shear terms belong to the [`ElementGroup`](super::ElementGroup) of each element.

use super::group::Formulation;
use super::kinematics::{gradient_of, reference_gradients};
use super::{ElementSink, Request};
use crate::error::{Error, Result};
use crate::material::{StepMotion, VolumeLaw, Volumetric};
use crate::mesh::{ElementKind, ElementPatch, Mesh};
use crate::space::{ShapeTable, reference};
use crate::square::{
    Row, Square, apply, cofactor, det_minus_one, dot, double_dot, plus_one, product, scale_all, sum,
};
use crate::terms::Terms;

/// Index of the radial component.
const RADIAL: usize = 0;

/// Patches of one material with equal numbers of nodes.
#[derive(Debug, Clone)]
pub struct PatchGroup<const D: usize> {
    formulation: Formulation,
    law: VolumeLaw,
    /// Nodes of a patch.
    width: usize,
    /// Nodes of each patch, `[patch * width + a]`.
    nodes: Vec<u32>,
    /// Their reference positions \[m\].
    points: Vec<[f64; D]>,
    /// The elements of patch `p` are `offsets[p]..offsets[p + 1]`.
    offsets: Vec<u32>,
    /// Index of the table of each element.
    table_of: Vec<u8>,
    /// Number of each element in the mesh, or [`ElementPatch::ELSEWHERE`].
    elements: Vec<u32>,
    /// Index of each node of each element among those of its patch. Those of patch `p` begin at
    /// `first_slots[p]`.
    slots: Vec<u16>,
    first_slots: Vec<u32>,
    /// Shape functions at the points of the full rule, by kind.
    tables: Vec<(ElementKind, ShapeTable)>,
}

impl<const D: usize> PatchGroup<D> {
    /// The patches of `mesh` with these numbers, all of one material with this formulation and with equal
    /// numbers of nodes, see [`nodes_of`](Self::nodes_of).
    ///
    /// # Errors
    /// The numbers of nodes differ, or an element is not solid.
    pub fn new(mesh: &Mesh<D>, patches: &[u32], formulation: Formulation) -> Result<Self> {
        let mut group = Self {
            formulation,
            law: formulation.volume_law(),
            width: 0,
            nodes: Vec::new(),
            points: Vec::new(),
            offsets: vec![0],
            table_of: Vec::new(),
            elements: Vec::new(),
            slots: Vec::new(),
            first_slots: Vec::new(),
            tables: Vec::new(),
        };
        for &number in patches {
            group.push(mesh, &mesh.patches[number as usize])?;
        }
        Ok(group)
    }

    /// The same patches with a smaller bulk modulus, as
    /// [`ElementGroup::softened`](super::ElementGroup::softened).
    #[must_use]
    pub fn softened(&self, relaxed: f64) -> Option<Self> {
        let formulation = self.formulation.softened(None, relaxed)?;
        Some(Self { formulation, law: formulation.volume_law(), ..self.clone() })
    }

    /// Nodes of a patch, each once, in the order of their first occurrence.
    pub fn nodes_of(patch: &ElementPatch) -> Vec<u32> {
        let mut nodes = Vec::new();
        for &node in &patch.nodes {
            if !nodes.contains(&node) {
                nodes.push(node);
            }
        }
        nodes
    }

    fn push(&mut self, mesh: &Mesh<D>, patch: &ElementPatch) -> Result<()> {
        let nodes = Self::nodes_of(patch);
        if self.is_empty() {
            self.width = nodes.len();
        }
        if nodes.len() != self.width || patch.kinds.iter().any(|kind| kind.dimension() != D) {
            return Err(Error::internal("a patch that does not fit its group"));
        }
        let slot = |node| nodes.iter().position(|other| other == node).unwrap_or_default() as u16;
        self.first_slots.push(self.slots.len() as u32);
        self.slots.extend(patch.nodes.iter().map(slot));
        for &kind in &patch.kinds {
            let known = self.tables.iter().position(|(known, _)| *known == kind);
            let table = known.unwrap_or_else(|| {
                let element = reference(kind);
                self.tables.push((kind, element.tabulate(element.full_rule())));
                self.tables.len() - 1
            });
            self.table_of.push(table as u8);
        }
        self.elements.extend(&patch.elements);
        self.offsets.push(self.table_of.len() as u32);
        self.points.extend(nodes.iter().map(|&node| mesh.points[node as usize]));
        self.nodes.extend(nodes);
        Ok(())
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Whether there are no patches.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of nodes of each patch.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Nodes of all patches, `[patch * width + a]`.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Numbers of the elements of a patch in the mesh, [`ElementPatch::ELSEWHERE`] for those that this rank
    /// does not have.
    pub fn elements(&self, patch: usize) -> &[u32] {
        &self.elements[self.offsets[patch] as usize..self.offsets[patch + 1] as usize]
    }

    /// Internal force (and, on request, its derivative) of each patch at the displacements `u`
    /// (`u[node * D + i]`, local nodes, \[m\]).
    ///
    /// A patch with an inverted element has no meaning. The group of the element reports it.
    pub fn evaluate(&self, u: &[f64], request: Request, sink: &mut dyn ElementSink) {
        let linearised_at = request.linearised_at.filter(|_| self.formulation.linearises_pressure());
        if let (Some(earlier), Some(_)) = (linearised_at, request.stiffness) {
            let mut work = Work::new(self);
            for patch in 0..self.len() {
                work.visit(self, patch, [u, earlier]);
                let dilatation = work.mean(|point| self.law.dilatation(&point.in_space(0)));
                let [pressure, curvature] = self.law.slope_and_curvature(dilatation);
                let linearised = work.linearised(self.law);
                work.add_volume_terms(self.law, pressure, linearised, curvature, request.stiffness);
                work.emit(patch, request, sink);
            }
            return;
        }
        let mut work = Work::new(self);
        for patch in 0..self.len() {
            work.visit(self, patch, [u]);
            let dilatation = work.mean(|point| self.law.dilatation(&point.in_space(0)));
            let [pressure, curvature] = self.law.slope_and_curvature(dilatation);
            work.add_volume_terms(self.law, pressure, pressure, curvature, request.stiffness);
            work.emit(patch, request, sink);
        }
    }

    /// Force of the difference between the pressure linearised at the displacements `earlier` and that at `u`,
    /// see [`ElementGroup::pressure_change`](super::ElementGroup::pressure_change).
    pub fn pressure_change(&self, u: &[f64], earlier: &[f64], sink: &mut dyn ElementSink) {
        if !self.formulation.linearises_pressure() {
            return;
        }
        let mut work = Work::new(self);
        for patch in 0..self.len() {
            work.visit(self, patch, [u, earlier]);
            let dilatation = work.mean(|point| self.law.dilatation(&point.in_space(0)));
            let [pressure, _] = self.law.slope_and_curvature(dilatation);
            let change = work.linearised(self.law) - pressure;
            work.add_volume_terms(self.law, change, 0.0, 0.0, None);
            work.emit(patch, Request::FORCE, sink);
        }
    }

    /// Like [`evaluate`](Self::evaluate) at the displacements `middle`, but with forces whose work over the
    /// step from `start` to `2 middle - start` equals the change of the volumetric energy. Bodies of
    /// revolution have no such forces.
    pub fn evaluate_step(&self, start: &[f64], middle: &[f64], request: Request, sink: &mut dyn ElementSink) {
        if self.law.form == Volumetric::SmallTrace {
            return self.evaluate(middle, request, sink);
        }
        let mut work = Work::new(self);
        for patch in 0..self.len() {
            work.visit(self, patch, [start, middle]);
            let before = work.mean(|point| self.law.dilatation(&point.grad_u[0]));
            let after = work.mean(|point| self.law.dilatation(&point.motion().end));
            let [pressure, curvature] = self.law.slope_over_step(before, after);
            work.add_step_terms(self.law, pressure, curvature, request.stiffness);
            work.emit(patch, request, sink);
        }
    }

    /// Volumetric energy \[J\] of the patches with `mine[patch]`.
    pub fn energy(&self, u: &[f64], mine: &[bool]) -> f64 {
        let mut work = Work::new(self);
        let mut total = 0.0;
        for (patch, _) in mine.iter().enumerate().filter(|(_, mine)| **mine) {
            work.visit(self, patch, [u]);
            let dilatation = work.mean(|point| self.law.dilatation(&point.in_space(0)));
            total += work.volume() * self.law.energy(dilatation);
        }
        total
    }

    /// Calls `receive(element, pressure)` with the slope of the volumetric energy \[Pa\] for each element
    /// that this rank has.
    pub fn pressures(&self, u: &[f64], mut receive: impl FnMut(u32, f64)) {
        let mut work = Work::new(self);
        for patch in 0..self.len() {
            work.visit(self, patch, [u]);
            let dilatation = work.mean(|point| self.law.dilatation(&point.in_space(0)));
            let [pressure, _] = self.law.slope_and_curvature(dilatation);
            let own = self.elements(patch).iter().filter(|&&element| element != ElementPatch::ELSEWHERE);
            own.for_each(|&element| receive(element, pressure));
        }
    }
}

/// A point of an element of a patch.
#[derive(Clone, Copy)]
struct PatchPoint<const D: usize, const STATES: usize> {
    /// Reference volume [m^D], in axisymmetry that of the whole revolution.
    volume: f64,
    /// Displacement gradient of each state.
    grad_u: [Square<f64, D>; STATES],
    /// Strain of the circle in each state, `u_r / R`, in axisymmetry.
    hoop: [f64; STATES],
    /// Range of its nodes in the lists of the workspace.
    nodes: [usize; 2],
}

impl<const D: usize, const STATES: usize> PatchPoint<D, STATES> {
    /// The displacement gradient of a state in space.
    fn in_space(&self, state: usize) -> Square<f64, 3> {
        let mut solid = [[0.0; 3]; 3];
        for (solid, plane) in solid.iter_mut().zip(&self.grad_u[state]) {
            solid[..D].copy_from_slice(plane);
        }
        if D == 2 {
            solid[2][2] = self.hoop[state];
        }
        solid
    }
}

impl<const D: usize> PatchPoint<D, 2> {
    fn motion(&self) -> StepMotion<f64, D> {
        StepMotion::new(self.grad_u[0], self.grad_u[1])
    }
}

/// Buffers of the loop over a group, allocated once per evaluation.
struct Work<const D: usize, const STATES: usize> {
    width: usize,
    points: Vec<PatchPoint<D, STATES>>,
    /// Index in the patch of each node of each point.
    slots: Vec<u16>,
    /// `g_a` [1/m] of each node of each point.
    gradients: Vec<Row<f64, D>>,
    /// `N_a / R` [1/m] of each node of each point; zero except in axisymmetry.
    ratios: Vec<f64>,
    /// `ds/du_a` of each node of a point [1/m].
    changes: Vec<Row<f64, D>>,
    /// Positions and displacements of the nodes of an element.
    places: Vec<[f64; D]>,
    displacements: [Vec<[f64; D]>; STATES],
    force: Vec<f64>,
    /// Change of the volume with the displacement of each node [m^(D-1)], and in a step that at the end.
    flux: [Vec<Row<f64, D>>; 2],
    /// `[((a * width + b) * D + i) * D + j]`.
    stiffness: Vec<f64>,
}

impl<const D: usize, const STATES: usize> Work<D, STATES> {
    fn new(group: &PatchGroup<D>) -> Self {
        let unknowns = group.width * D;
        Self {
            width: group.width,
            points: Vec::new(),
            slots: Vec::new(),
            gradients: Vec::new(),
            ratios: Vec::new(),
            changes: Vec::new(),
            places: Vec::new(),
            displacements: std::array::from_fn(|_| Vec::new()),
            force: vec![0.0; unknowns],
            flux: [vec![[0.0; D]; group.width], vec![[0.0; D]; group.width]],
            stiffness: vec![0.0; unknowns * unknowns],
        }
    }

    /// Moves to a patch: sets its points at each of the displacements `u`.
    fn visit(&mut self, group: &PatchGroup<D>, patch: usize, u: [&[f64]; STATES]) {
        self.points.clear();
        self.slots.clear();
        self.gradients.clear();
        self.ratios.clear();
        let first = patch * self.width;
        let mut slots = &group.slots[group.first_slots[patch] as usize..];
        for member in group.offsets[patch] as usize..group.offsets[patch + 1] as usize {
            let (_, table) = &group.tables[usize::from(group.table_of[member])];
            let (of_element, rest) = slots.split_at(table.nodes);
            slots = rest;
            let at = |slot: &u16| first + usize::from(*slot);
            self.places.clear();
            self.places.extend(of_element.iter().map(|slot| group.points[at(slot)]));
            for (displacements, u) in self.displacements.iter_mut().zip(u) {
                displacements.clear();
                displacements.extend(of_element.iter().map(|slot| -> [f64; D] {
                    let node = group.nodes[at(slot)] as usize;
                    std::array::from_fn(|i| u[node * D + i])
                }));
            }
            self.add_points(group, table, of_element);
        }
    }

    /// Clears the sums.
    fn clear(&mut self, wanted: Option<Terms>) {
        self.force.fill(0.0);
        if wanted.is_some() {
            self.stiffness.fill(0.0);
        }
        self.flux.iter_mut().for_each(|flux| flux.fill([0.0; D]));
    }

    /// Adds the points of the element whose positions and displacements are set.
    fn add_points(&mut self, group: &PatchGroup<D>, table: &ShapeTable, slots: &[u16]) {
        let n = slots.len();
        let is_revolved = group.formulation.plane.is_revolved();
        for q in 0..table.points {
            let begin = self.slots.len();
            self.slots.extend_from_slice(slots);
            self.gradients.resize(begin + n, [0.0; D]);
            let gradients = &mut self.gradients[begin..];
            let det = reference_gradients(&self.places, &table.dn[q * n * D..(q + 1) * n * D], gradients);
            let grad_u = self.displacements.each_ref().map(|u| gradient_of(u, gradients));
            let shapes = &table.n[q * n..(q + 1) * n];
            let mut volume = table.weights[q] * det;
            let mut hoop = [0.0; STATES];
            if is_revolved {
                let radial =
                    |of: &[[f64; D]]| -> f64 { of.iter().zip(shapes).map(|(x, n)| x[RADIAL] * n).sum() };
                let radius = radial(&self.places);
                volume *= std::f64::consts::TAU * radius;
                hoop = self.displacements.each_ref().map(|u| radial(u) / radius);
                self.ratios.extend(shapes.iter().map(|n| n / radius));
            } else {
                self.ratios.resize(begin + n, 0.0);
            }
            self.points.push(PatchPoint { volume, grad_u, hoop, nodes: [begin, begin + n] });
        }
    }

    /// Reference volume of the patch.
    fn volume(&self) -> f64 {
        self.points.iter().map(|point| point.volume).sum()
    }

    /// Mean of a function over the patch.
    fn mean(&self, f: impl Fn(&PatchPoint<D, STATES>) -> f64) -> f64 {
        self.points.iter().map(|point| point.volume * f(point)).sum::<f64>() / self.volume()
    }

    /// Adds `weight` times the product of the fluxes, which are the same except in a step.
    fn add_curvature(&mut self, weight: f64) {
        let [of_force, of_end] = &self.flux;
        let mut blocks = self.stiffness.chunks_exact_mut(D * D);
        for row in of_force {
            let scaled = row.map(|flux| weight * flux);
            for (column, block) in of_end.iter().zip(&mut blocks) {
                for i in 0..D {
                    for j in 0..D {
                        block[i * D + j] += scaled[i] * column[j];
                    }
                }
            }
        }
    }

    fn emit(&self, patch: usize, request: Request, sink: &mut dyn ElementSink) {
        sink.element(patch, &self.force, request.stiffness.is_some().then_some(&self.stiffness));
    }
}

/// Factors of the terms of a stiffness: of the material and of the stress.
fn factors(wanted: Terms) -> [f64; 2] {
    [Terms::MATERIAL, Terms::GEOMETRIC].map(|term| f64::from(u8::from(wanted.contains(term))))
}

impl<const D: usize, const STATES: usize> Work<D, STATES> {
    /// Adds force and stiffness in the first state, at the pressure of each.
    fn add_volume_terms(
        &mut self,
        law: VolumeLaw,
        pressure: f64,
        pressure_of_stiffness: f64,
        curvature: f64,
        wanted: Option<Terms>,
    ) {
        self.clear(wanted);
        for number in 0..self.points.len() {
            let PatchPoint { volume, grad_u, hoop, nodes: [begin, end] } = self.points[number];
            let grad_u = grad_u[0];
            let weight = pressure * volume;
            let plane = law.gradient(&grad_u);
            let ratio = 1.0 + det_minus_one(&grad_u);
            let stretch = 1.0 + hoop[0];
            // ds/dF in the plane and around the axis.
            let (plane, around) = match law.form {
                Volumetric::Rubber | Volumetric::Logarithmic => (scale_all(&plane, stretch), ratio),
                Volumetric::GreenTrace => (plane, stretch),
                Volumetric::SmallTrace => (plane, 1.0),
            };
            self.changes.clear();
            for k in begin..end {
                let mut change = apply(&plane, &self.gradients[k]);
                change[RADIAL] += around * self.ratios[k];
                self.changes.push(change);
                let a = usize::from(self.slots[k]);
                for i in 0..D {
                    self.force[a * D + i] += weight * change[i];
                    self.flux[0][a][i] += volume * change[i];
                }
            }
            if let Some(wanted) = wanted {
                self.add_point_stiffness(
                    law.form,
                    &grad_u,
                    [ratio, stretch],
                    pressure_of_stiffness * volume,
                    [begin, end],
                    factors(wanted),
                );
            }
        }
        let Some(wanted) = wanted else { return };
        let volume = self.volume();
        let [of_force, of_end] = &mut self.flux;
        of_end.copy_from_slice(of_force);
        self.add_curvature(factors(wanted)[0] * curvature / volume);
    }

    /// Adds `weight` times the second derivative of the dilatation at a point.
    ///
    /// That of `J` is `(h_a h_b^T - h_b h_a^T) / J` with the cofactors `h` in the plane, besides the
    /// products of plane and circle. Its part in `K_S` is `(h_a . h_b) / J`.
    fn add_point_stiffness(
        &mut self,
        form: Volumetric,
        grad_u: &Square<f64, D>,
        [ratio, stretch]: [f64; 2],
        weight: f64,
        nodes: [usize; 2],
        [material, geometric]: [f64; 2],
    ) {
        match form {
            Volumetric::Rubber | Volumetric::Logarithmic => {
                let cofactors = cofactor(&plus_one(grad_u));
                self.changes.clear();
                let of_point = &self.gradients[nodes[0]..nodes[1]];
                self.changes.extend(of_point.iter().map(|gradient| apply(&cofactors, gradient)));
                let per_area = weight * stretch / ratio;
                self.add_skew(nodes, material * per_area, material * weight);
                if geometric != material {
                    let apart = (geometric - material) * per_area;
                    self.add_isotropic(nodes, apart, apart * (ratio / stretch).powi(2), |work, k| {
                        work.changes[k]
                    });
                }
            }
            Volumetric::GreenTrace => {
                let weight = geometric * weight;
                self.add_isotropic(nodes, weight, weight, |work, k| work.gradients[nodes[0] + k]);
            }
            Volumetric::SmallTrace => {}
        }
    }

    /// Adds `in_plane (h_a h_b^T - h_b h_a^T)` with the cofactors in `changes`, and `across` times the
    /// products of plane and circle.
    fn add_skew(&mut self, [begin, end]: [usize; 2], in_plane: f64, across: f64) {
        let is_revolved = self.ratios[begin..end].iter().any(|&ratio| ratio != 0.0);
        for k in 0..end - begin {
            let a = usize::from(self.slots[begin + k]);
            let h_a = self.changes[k];
            let n_a = self.ratios[begin + k];
            let scaled = h_a.map(|h| in_plane * h);
            for l in 0..end - begin {
                let b = usize::from(self.slots[begin + l]);
                let h_b = self.changes[l];
                let block = &mut self.stiffness[(a * self.width + b) * D * D..][..D * D];
                for i in 0..D {
                    for j in 0..D {
                        block[i * D + j] += scaled[i] * h_b[j] - h_b[i] * scaled[j];
                    }
                }
                if is_revolved {
                    let n_b = self.ratios[begin + l];
                    for i in 0..D {
                        block[i * D + RADIAL] += across * n_b * h_a[i];
                        block[RADIAL * D + i] += across * n_a * h_b[i];
                    }
                }
            }
        }
    }

    /// Adds `in_plane` times the products of `vector`, and `around` times those of the ratios of the circle.
    fn add_isotropic(
        &mut self,
        [begin, end]: [usize; 2],
        in_plane: f64,
        around: f64,
        vector: impl Fn(&Self, usize) -> Row<f64, D>,
    ) {
        for k in 0..end - begin {
            let a = usize::from(self.slots[begin + k]);
            let v_a = vector(self, k);
            let n_a = self.ratios[begin + k];
            for l in 0..end - begin {
                let b = usize::from(self.slots[begin + l]);
                let value = in_plane * dot(&v_a, &vector(self, l));
                let circle = around * n_a * self.ratios[begin + l];
                let block = &mut self.stiffness[(a * self.width + b) * D * D..][..D * D];
                (0..D).for_each(|i| block[i * D + i] += value);
                block[RADIAL * D + RADIAL] += circle;
            }
        }
    }
}

impl<const D: usize> Work<D, 2> {
    /// The pressure of the first state, linearised at the second one (5.5) \[Pa\].
    fn linearised(&self, law: VolumeLaw) -> f64 {
        let dilatation = self.mean(|point| law.dilatation(&point.in_space(1)));
        let change = self.mean(|point| {
            let [to, from] = [0, 1].map(|state| point.in_space(state));
            double_dot(&law.gradient(&from), &sum(&to, &scale_all(&from, -1.0)))
        });
        let [slope, curvature] = law.slope_and_curvature(dilatation);
        slope + curvature * change
    }

    /// Adds force and stiffness over a step at a pressure, with the stress `p G` of
    /// [`VolumeStep`](crate::material::VolumeStep).
    fn add_step_terms(&mut self, law: VolumeLaw, pressure: f64, curvature: f64, wanted: Option<Terms>) {
        self.clear(wanted);
        for number in 0..self.points.len() {
            let motion = self.points[number].motion();
            let PatchPoint { volume, nodes: [begin, end], .. } = self.points[number];
            let step = law.over_step(&motion);
            let f_middle = plus_one(&motion.middle);
            let force = scale_all(&product(&f_middle, &step.gradient), volume);
            // The end moves twice as far as the middle.
            let at_end = scale_all(&law.gradient(&motion.end), 2.0 * volume);
            for k in begin..end {
                let a = usize::from(self.slots[k]);
                let [of_force, of_end] = [&force, &at_end].map(|map| apply(map, &self.gradients[k]));
                for i in 0..D {
                    self.force[a * D + i] += pressure * of_force[i];
                    self.flux[0][a][i] += of_force[i];
                    self.flux[1][a][i] += of_end[i];
                }
            }
            let Some(wanted) = wanted else { continue };
            let [material, geometric] = factors(wanted).map(|factor| factor * pressure * volume);
            let f_end = plus_one(&motion.end);
            let zero = [0.0; D];
            for l in begin..end {
                let b = usize::from(self.slots[l]);
                let g_b = self.gradients[l];
                let stiffening = apply(&step.gradient, &g_b);
                for j in 0..D {
                    // The change of Green's strain at the end, which moves twice as far as the middle.
                    let mut strain = [zero; D];
                    for k in 0..D {
                        for m in 0..D {
                            strain[k][m] = f_end[j][k] * g_b[m] + g_b[k] * f_end[j][m];
                        }
                    }
                    let change = product(&f_middle, &step.contract(&strain));
                    for k in begin..end {
                        let a = usize::from(self.slots[k]);
                        let g_a = self.gradients[k];
                        let column = apply(&change, &g_a);
                        let block = &mut self.stiffness[(a * self.width + b) * D * D..][..D * D];
                        for i in 0..D {
                            block[i * D + j] += material * column[i];
                        }
                        block[j * D + j] += geometric * dot(&g_a, &stiffening);
                    }
                }
            }
        }
        let Some(wanted) = wanted else { return };
        let volume = self.volume();
        self.add_curvature(factors(wanted)[0] * curvature / volume);
    }
}
