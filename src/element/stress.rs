//! Results of the solid for output: Cauchy stress and `det F`.

use nalgebra::DMatrix;

use super::group::{ElementGroup, Pass, Sampling};
use super::kinematics::{Kinematics, gradient_of, reference_gradients};
use super::projection::Projection;
use super::viscous::{in_plane, in_space, overstress_at};
use crate::material::{
    Deviator, FiniteDeviator, Hooke, Law, LawPart, LawTask, LinearDeviator, Material, MetricLaw, Overstress,
    Part, PlaneStress, PointLaw, VolumeLaw, Volumetric,
};
use crate::mesh::{ElementKind, PlaneState};
use crate::space::reference;
use crate::square::{
    Square, det_minus_one, diagonal, outer_gram, plus_one, product, scale_all, sum, trace, transpose,
};

/// Cauchy stress \[Pa\], tension positive: `xx, yy, zz, xy, yz, xz`. In plane strain `zz` is the
/// stress that enforces zero normal strain; under plane stress it is zero. In axisymmetry it is that around
/// the axis.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cauchy(pub [f64; 6]);

impl Cauchy {
    /// Von Mises equivalent stress \[Pa\], not negative.
    pub fn von_mises(&self) -> f64 {
        let [xx, yy, zz, xy, yz, xz] = self.0;
        let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
        (0.5 * normal + 3.0 * (xy * xy + yz * yz + xz * xz)).sqrt()
    }

    /// Pressure \[Pa\], positive in compression: minus the mean of the normal stresses.
    pub fn pressure(&self) -> f64 {
        -(self.0[0] + self.0[1] + self.0[2]) / 3.0
    }

    /// Principal stresses \[Pa\], the largest first.
    pub fn principal(&self) -> [f64; 3] {
        principal(&self.0)
    }

    fn add(&mut self, weight: f64, other: &Self) {
        for (sum, value) in self.0.iter_mut().zip(other.0) {
            *sum += weight * value;
        }
    }
}

/// Eigenvalues of the symmetric tensor `xx, yy, zz, xy, yz, xz`, the largest first.
fn principal(tensor: &[f64; 6]) -> [f64; 3] {
    let [xx, yy, zz, xy, yz, xz] = *tensor;
    let mut values: [f64; 3] =
        nalgebra::Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz).symmetric_eigenvalues().into();
    values.sort_by(|a, b| b.total_cmp(a));
    values
}

/// Stress and volume ratio at one point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CauchyState {
    /// Cauchy stress.
    pub cauchy: Cauchy,
    /// `det F` (in linear kinematics `1 + tr(eps)`).
    pub det_f: f64,
}

impl CauchyState {
    fn add(&mut self, weight: f64, other: &Self) {
        self.cauchy.add(weight, &other.cauchy);
        self.det_f += weight * other.det_f;
    }
}

/// The stress of one element.
#[derive(Debug, Clone, Default)]
pub struct ElementStress {
    /// Reference volume [m^D].
    pub volume: f64,
    /// Mean over the reference volume.
    pub mean: CauchyState,
    /// Mean of the right Cauchy-Green tensor `F^T F` over the reference volume: `xx, yy, zz, xy, yz,
    /// xz`. In linear kinematics `(1 + eps)^2`.
    pub right_cauchy_green: [f64; 6],
    /// At the points of the full rule.
    pub points: Vec<CauchyState>,
    /// At the nodes: the linear (quads, hexes: multilinear) least-squares fit of `points`, or a
    /// constant from a single point. Average it over the elements of a node, weighted by `volume`.
    pub nodes: Vec<CauchyState>,
}

impl ElementStress {
    /// Principal stretches, the largest first: the square roots of the eigenvalues of
    /// [`right_cauchy_green`](Self::right_cauchy_green).
    pub fn principal_stretches(&self) -> [f64; 3] {
        principal(&self.right_cauchy_green).map(|square| square.max(0.0).sqrt())
    }
}

impl<const D: usize> ElementGroup<D> {
    /// Cauchy stress of each element at the nodal displacements `u` \[m\], passed to
    /// `receive(index, stress)`.
    ///
    /// If volume terms have a separate rule, their stress is fitted on that rule and added at every
    /// point. The stress of a projected dilatation is the pressure of the forces.
    pub fn stress(&self, u: &[f64], receive: impl FnMut(usize, &ElementStress)) {
        self.full_stress(u, None, &[], receive);
    }

    /// Like [`stress`](Self::stress) with the stress of a Prony series, and with that of the pressures of
    /// patches, which are given by the number of the element in the mesh \[Pa\].
    pub fn full_stress(
        &self,
        u: &[f64],
        viscous: Option<&Overstress>,
        of_patches: &[f64],
        mut receive: impl FnMut(usize, &ElementStress),
    ) {
        let fits: Vec<_> =
            self.passes.iter().map(|pass| Fit::new(self.kind, pass, &self.passes[0])).collect();
        let mut element = Element::<D>::new(self.kind, self.formulation.plane);
        let mut stress = ElementStress::default();
        let mut states = Vec::new();
        let law = self.volume_law();
        let mut projection = Projection::new(0.0, &self.passes[self.passes.len() - 1]);
        let mut pressures = Vec::new();
        let plane_stress = self.formulation.plane_stress();
        let plane_stress = plane_stress.as_ref();
        let is_patched = self.formulation.shares_pressure(self.kind);
        for index in 0..self.elements.len() {
            element.load(self, index, u);
            let pressure = of_patches.get(self.elements[index] as usize).filter(|_| is_patched);
            stress.points.clear();
            stress.points.resize(self.passes[0].table.points, CauchyState::default());
            stress.nodes.clear();
            stress.nodes.resize(self.kind.nodes(), CauchyState::default());
            stress.mean = CauchyState::default();
            stress.right_cauchy_green = [0.0; 6];
            for (number, (pass, fit)) in self.passes.iter().zip(&fits).enumerate() {
                states.clear();
                let mut volume = 0.0;
                let mut mean = CauchyState::default();
                let projected = matches!(pass.sampling, Sampling::Projected(_));
                if projected {
                    element.pressures(pass, &law, &mut projection, &mut pressures);
                }
                for q in 0..pass.samples() {
                    let (grad_u, weight) = element.gradient(pass, q);
                    let added = viscous.filter(|_| number == 0);
                    let added = added.map(|viscous| self.added(viscous, index, q, &grad_u));
                    let mut state = if projected {
                        volume_state(&law, &grad_u, pressures[q])
                    } else {
                        self.state(pass.part, &grad_u, added, plane_stress)
                    };
                    if let Some(&pressure) = pressure {
                        state.add(1.0, &volume_state(&law, &grad_u, pressure));
                    }
                    if number > 0 {
                        // The first pass already includes the volume ratio.
                        state.det_f = 0.0;
                    } else {
                        let metric = self.right_cauchy_green(&grad_u, plane_stress);
                        let sums = stress.right_cauchy_green.iter_mut().zip(metric);
                        sums.for_each(|(sum, value)| *sum += weight * value);
                    }
                    mean.add(weight, &state);
                    volume += weight;
                    states.push(state);
                }
                stress.mean.add(1.0 / volume, &mean);
                if number == 0 {
                    stress.volume = volume;
                    stress.right_cauchy_green.iter_mut().for_each(|sum| *sum /= volume);
                }
                Fit::add(&fit.to_points, &states, &mut stress.points);
                Fit::add(&fit.to_nodes, &states, &mut stress.nodes);
            }
            receive(index, &stress);
        }
    }

    /// The second Piola stress that a Prony series adds at a point of an element \[Pa\].
    fn added(
        &self,
        viscous: &Overstress,
        index: usize,
        point: usize,
        grad_u: &Square<f64, 3>,
    ) -> Square<f64, 3> {
        let isochoric = match self.formulation.kinematics {
            Kinematics::Linear => LinearDeviator { mu: self.formulation.moduli().mu }.stress(grad_u),
            Kinematics::Finite => IsochoricAt { grad_u: *grad_u }.of(&self.formulation.material),
        };
        overstress_at::<D>(viscous, index, self.passes[0].samples(), point, &isochoric)
    }

    /// The displacement gradient in space, completed under plane stress by `H_33`.
    fn solid(&self, grad_u: &Square<f64, 3>, plane_stress: Option<&PlaneStress>) -> Square<f64, 3> {
        let mut solid = *grad_u;
        if let Some(law) = plane_stress {
            solid[2][2] = law.thickness(&in_plane(&solid));
        } else if self.formulation.plane == PlaneState::Stress {
            solid[2][2] = -self.formulation.moduli().thickness_ratio() * trace(grad_u);
        }
        solid
    }

    /// `F^T F`, in linear kinematics `(1 + eps)^2`.
    fn right_cauchy_green(&self, grad_u: &Square<f64, 3>, plane_stress: Option<&PlaneStress>) -> [f64; 6] {
        let solid = self.solid(grad_u, plane_stress);
        let f = match self.formulation.kinematics {
            Kinematics::Finite => plus_one(&solid),
            Kinematics::Linear => plus_one(&sum(&solid, &transpose(&solid)).map(|row| row.map(|x| 0.5 * x))),
        };
        components(&product(&transpose(&f), &f), 1.0).0
    }

    /// `sigma = F S F^T / J` of a part of the law for this displacement gradient, with the second Piola
    /// stress `added`. Under plane stress the stress across the plane is zero.
    fn state(
        &self,
        part: Part,
        grad_u: &Square<f64, 3>,
        added: Option<Square<f64, 3>>,
        plane_stress: Option<&PlaneStress>,
    ) -> CauchyState {
        let solid = self.solid(grad_u, plane_stress);
        let with_added = |stress| added.map_or(stress, |added| sum(&stress, &added));
        if self.formulation.kinematics == Kinematics::Linear {
            let cauchy = match self.formulation.plane {
                PlaneState::Stress => {
                    let moduli = self.formulation.own_moduli();
                    in_space(&Hooke::respond_with_metric(&moduli, &in_plane::<_, D>(grad_u)).second_piola)
                }
                PlaneState::Strain | PlaneState::Axisymmetric => {
                    let moduli = self.formulation.moduli().part(part);
                    with_added(Hooke::respond_with_metric(&moduli, &solid).second_piola)
                }
            };
            return CauchyState { cauchy: components(&cauchy, 1.0), det_f: 1.0 + trace(&solid) };
        }
        let det_f = 1.0 + det_minus_one(&solid);
        let f = plus_one(&solid);
        let second_piola = match plane_stress {
            Some(law) => in_space(&law.stress(&in_plane::<_, D>(grad_u))),
            None => with_added(StressAt { part, grad_u: solid }.of(&self.formulation.material)),
        };
        let kirchhoff = product(&product(&f, &second_piola), &transpose(&f));
        CauchyState { cauchy: components(&kirchhoff, 1.0 / det_f), det_f }
    }
}

/// Cauchy stress of the volume terms with the pressure `p`: `p ds/dF F^T / J`. The volume ratio is zero.
fn volume_state(law: &VolumeLaw, grad_u: &Square<f64, 3>, pressure: f64) -> CauchyState {
    let cauchy = match law.form {
        // The gradient of J is J F^-T, that of the small strain 1.
        Volumetric::Rubber | Volumetric::Logarithmic | Volumetric::SmallTrace => diagonal(pressure),
        Volumetric::GreenTrace => {
            scale_all(&outer_gram(&plus_one(grad_u)), pressure / (1.0 + det_minus_one(grad_u)))
        }
    };
    CauchyState { cauchy: components(&cauchy, 1.0), det_f: 0.0 }
}

/// The second Piola stress of a part of a law \[Pa\].
struct StressAt {
    part: Part,
    grad_u: Square<f64, 3>,
}

impl StressAt {
    /// Not generic over the dimension, so that the laws are compiled here and not in each crate that asks
    /// for stresses.
    fn of(self, material: &Material) -> Square<f64, 3> {
        material.accept(self)
    }
}

impl LawTask for StressAt {
    type Output = Square<f64, 3>;

    fn run<P: Law>(self, law: &P) -> Square<f64, 3> {
        P::stress(&law.constants(self.part), &self.grad_u)
    }
}

/// The isochoric second Piola stress of a law \[Pa\].
struct IsochoricAt {
    grad_u: Square<f64, 3>,
}

impl IsochoricAt {
    /// Not generic over the dimension, as [`StressAt::of`].
    fn of(self, material: &Material) -> Square<f64, 3> {
        material.accept(self)
    }
}

impl LawTask for IsochoricAt {
    type Output = Square<f64, 3>;

    fn run<P: Law>(self, law: &P) -> Square<f64, 3> {
        FiniteDeviator(&LawPart::<P>(law.constants(Part::Shear))).stress(&self.grad_u)
    }
}

fn components(s: &Square<f64, 3>, factor: f64) -> Cauchy {
    Cauchy([s[0][0], s[1][1], s[2][2], s[0][1], s[1][2], s[0][2]].map(|s| s * factor))
}

/// One element, computed with plain numbers.
struct Element<const D: usize> {
    nodes: Vec<u32>,
    points: Vec<[f64; D]>,
    displacements: Vec<[f64; D]>,
    gradients: Vec<[f64; D]>,
    plane: PlaneState,
}

impl<const D: usize> Element<D> {
    fn new(kind: ElementKind, plane: PlaneState) -> Self {
        let gradients = vec![[0.0; D]; kind.nodes()];
        Self { nodes: Vec::new(), points: Vec::new(), displacements: Vec::new(), gradients, plane }
    }

    fn load(&mut self, group: &ElementGroup<D>, index: usize, u: &[f64]) {
        group.nodes_of(index, &mut self.nodes);
        group.points_of(index, &mut self.points);
        self.displacements.clear();
        let of_node = |&node: &u32| std::array::from_fn(|i| u[node as usize * D + i]);
        self.displacements.extend(self.nodes.iter().map(of_node));
    }

    /// Displacement gradient in space and volume of sample `q` of `pass`.
    fn gradient(&mut self, pass: &Pass, q: usize) -> (Square<f64, 3>, f64) {
        match pass.sampling {
            Sampling::Points | Sampling::Projected(_) => self.gradient_at(pass, q),
            Sampling::Mean => {
                let mut mean = [[0.0; 3]; 3];
                let mut volume = 0.0;
                for q in 0..pass.table.points {
                    let (grad_u, weight) = self.gradient_at(pass, q);
                    volume += weight;
                    for (mean, value) in mean.as_flattened_mut().iter_mut().zip(grad_u.as_flattened()) {
                        *mean += weight * value;
                    }
                }
                (mean.map(|row| row.map(|value| value / volume)), volume)
            }
        }
    }

    /// The pressures of the volume terms at the points of a pass with a projected dilatation \[Pa\].
    fn pressures(
        &mut self,
        pass: &Pass,
        law: &VolumeLaw,
        projection: &mut Projection<f64, D>,
        pressures: &mut Vec<f64>,
    ) {
        pressures.clear();
        let n = self.points.len();
        for q in 0..pass.samples() {
            let (grad_u, volume) = self.gradient_at(pass, q);
            let shapes = &pass.table.n[q * n..(q + 1) * n];
            let of = |i: usize| self.points.iter().zip(shapes).map(|(point, shape)| shape * point[i]).sum();
            projection.set(q, volume, &std::array::from_fn(of));
            pressures.push(law.dilatation(&grad_u));
        }
        projection.orthogonalize();
        projection.project(pressures);
        for value in pressures.iter_mut() {
            let [slope, _] = law.slope_and_curvature(*value);
            *value = slope;
        }
        projection.project(pressures);
    }

    fn gradient_at(&mut self, pass: &Pass, q: usize) -> (Square<f64, 3>, f64) {
        let det = reference_gradients(&self.points, pass.dn(q), &mut self.gradients);
        let mut grad_u = in_space(&gradient_of(&self.displacements, &self.gradients));
        let n = self.points.len();
        let shape = &pass.table.n[q * n..(q + 1) * n];
        let radial = |of: &[[f64; D]]| of.iter().zip(shape).map(|(value, n)| value[0] * n).sum::<f64>();
        let radius = radial(&self.points);
        if self.plane.is_revolved() {
            grad_u[2][2] = radial(&self.displacements) / radius;
        }
        (grad_u, pass.table.weights[q] * det * self.plane.depth(radius))
    }
}

/// Extrapolates values from the points of a rule to other points, by least squares over the shape
/// functions of the corners.
struct Fit {
    /// `[target point][point of the rule]`
    to_points: DMatrix<f64>,
    to_nodes: DMatrix<f64>,
}

impl Fit {
    fn new(kind: ElementKind, from: &Pass, points: &Pass) -> Self {
        let to = |places: &[[f64; 3]]| fit(corner_kind(kind), &from.points, places);
        Self { to_points: to(&points.points), to_nodes: to(reference(kind).node_coordinates()) }
    }

    fn add(matrix: &DMatrix<f64>, from: &[CauchyState], out: &mut [CauchyState]) {
        for (row, out) in out.iter_mut().enumerate() {
            for (column, from) in from.iter().enumerate() {
                out.add(matrix[(row, column)], from);
            }
        }
    }
}

/// Shape functions of the linear element with the same corners.
fn corner_kind(kind: ElementKind) -> ElementKind {
    let same = |other: &ElementKind| {
        other.nodes() == kind.corners()
            && other.corners() == kind.corners()
            && other.dimension() == kind.dimension()
    };
    ElementKind::ALL.into_iter().find(same).unwrap_or(kind)
}

fn fit(linear: ElementKind, from: &[[f64; 3]], to: &[[f64; 3]]) -> DMatrix<f64> {
    let basis = |places: &[[f64; 3]]| {
        let mut n = vec![0.0; linear.nodes()];
        DMatrix::from_rows(
            &places
                .iter()
                .map(|place| {
                    reference(linear).shape(place, &mut n);
                    nalgebra::RowDVector::from_row_slice(&n)
                })
                .collect::<Vec<_>>(),
        )
    };
    let constant = DMatrix::from_element(to.len(), from.len(), 1.0 / from.len() as f64);
    if from.len() < linear.corners() {
        return constant;
    }
    let at_points = basis(from);
    match (at_points.transpose() * &at_points).try_inverse() {
        Some(inverse) => basis(to) * inverse * at_points.transpose(),
        None => constant,
    }
}
