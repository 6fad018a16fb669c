//! Groups of elements of one kind and one material, stored in lanes.

use std::rc::Rc;

use super::kinematics::{DilatationSpace, VolumeRule};
use super::{Kinematics, Locking};
use crate::error::{Error, Result};
use crate::lanes::WIDTH;
use crate::material::{Material, Moduli, Part, PlaneStress, VolumeLaw, Volumetric};
use crate::mesh::{ElementKind, Mesh, PlaneState, spelled};
use crate::space::{Rule, ShapeTable, reference};

/// Physical model and discretization of a group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Formulation {
    /// The elastic law.
    pub material: Material,
    /// Finite or linear kinematics.
    pub kinematics: Kinematics,
    /// State across the plane, in two dimensions.
    pub plane: PlaneState,
    /// Treatment of locking.
    pub locking: Locking,
    /// Reference density [kg/m^3], not negative.
    pub density: f64,
}

impl Formulation {
    /// Largest Poisson's ratio of [softened](ElementGroup::softened) formulations.
    ///
    /// With 0.48 in place of it solves with `filtered_ilu` of two boxes of hex8 at a ratio of 0.499 fail.
    /// With 0.40 they take 1.36 times the iterations at 0.49 (docs/performance/large-problems.md).
    pub const SOFTENED: f64 = 0.47;

    /// Whether the [softened](ElementGroup::softened) formulation differs: that of Poisson's ratios above
    /// [`SOFTENED`](Self::SOFTENED), except under plane stress, where the thickness is free. `relaxed` is the
    /// part of the shear modulus that remains when viscous branches have relaxed.
    pub fn is_softened(&self, relaxed: f64) -> bool {
        let moduli = self.moduli();
        let slow = Moduli { mu: relaxed * moduli.mu, ..moduli };
        slow.poisson_ratio() > Self::SOFTENED && self.plane != PlaneState::Stress
    }

    /// The formulation with the bulk modulus that belongs to [`SOFTENED`](Self::SOFTENED) and the relaxed shear
    /// modulus, for elements of `kind`, whose treatment of locking stays. `None` if it is no smaller.
    pub(super) fn softened(&self, kind: Option<ElementKind>, relaxed: f64) -> Option<Self> {
        if !self.is_softened(relaxed) {
            return None;
        }
        let moduli = self.moduli();
        let lambda = 2.0 * relaxed * moduli.mu * Self::SOFTENED / (1.0 - 2.0 * Self::SOFTENED);
        let bulk = Moduli { lambda, ..moduli }.bulk();
        let locking = kind.map_or(self.locking, |kind| self.cure(kind));
        Some(Self { material: self.material.with_bulk_modulus(bulk), locking, ..*self })
    }

    /// Moduli at small strain.
    pub fn moduli(&self) -> Moduli<f64> {
        self.material.moduli()
    }

    /// Moduli of Hooke's law in the dimensions of the elements: under plane stress those in the plane.
    pub fn own_moduli(&self) -> Moduli<f64> {
        match self.plane {
            PlaneState::Strain | PlaneState::Axisymmetric => self.moduli(),
            PlaneState::Stress => self.moduli().plane_stress(),
        }
    }

    /// The law of finite kinematics under plane stress; `None` for any other state.
    pub(super) fn plane_stress(&self) -> Option<PlaneStress> {
        let is_one = self.plane == PlaneState::Stress && self.kinematics == Kinematics::Finite;
        is_one.then(|| PlaneStress::new(&self.material))
    }

    /// The treatment of locking on elements of `kind`: never [`Locking::Auto`]. Under plane stress the thickness
    /// is free, so that volume terms do not lock and [`Locking::Auto`] is [`Locking::None`].
    pub fn cure(&self, kind: ElementKind) -> Locking {
        match (self.plane, self.locking) {
            (PlaneState::Stress, Locking::Auto) => Locking::None,
            _ => self.locking.on(kind, &self.moduli()),
        }
    }

    /// Whether elements of `kind` share their pressure with others of a patch.
    pub fn shares_pressure(&self, kind: ElementKind) -> bool {
        self.cure(kind).shares_pressure(kind)
    }

    /// The volumetric energy.
    pub(super) fn volume_law(&self) -> VolumeLaw {
        let form = match self.kinematics {
            Kinematics::Linear => Volumetric::SmallTrace,
            Kinematics::Finite => self.material.volumetric(),
        };
        VolumeLaw { form, lambda: self.moduli().lambda }
    }
}

/// Points at which a pass evaluates its part of the law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sampling {
    /// At each point of the rule.
    Points,
    /// Once, at the mean of the gradient over the rule, which is that of the first pass.
    Mean,
    /// At each point of the full rule, with the projection of the dilatation on this space.
    Projected(DilatationSpace),
}

/// Part of the law with its quadrature rule.
#[derive(Debug, Clone)]
pub(super) struct Pass {
    pub sampling: Sampling,
    pub table: ShapeTable,
    /// Reference coordinates of the samples.
    pub points: Vec<[f64; 3]>,
    pub part: Part,
}

impl Pass {
    fn new(kind: ElementKind, rule: &Rule, part: Part) -> Self {
        let table = reference(kind).tabulate(rule);
        Self { sampling: Sampling::Points, table, points: rule.points.clone(), part }
    }

    fn mean(kind: ElementKind, part: Part) -> Self {
        let element = reference(kind);
        let table = element.tabulate(element.full_rule());
        Self { sampling: Sampling::Mean, table, points: element.reduced_rule().points.clone(), part }
    }

    /// Number of evaluations of the law.
    pub fn samples(&self) -> usize {
        self.points.len()
    }

    /// Gradients `[a * D + k]` at point `q` of the rule.
    pub fn dn(&self, q: usize) -> &[f64] {
        let size = self.table.nodes * self.table.dim;
        &self.table.dn[q * size..(q + 1) * size]
    }
}

/// Elements of one kind and one formulation. Their connectivity and reference positions are stored
/// in lanes of [`WIDTH`].
#[derive(Debug, Clone)]
pub struct ElementGroup<const D: usize> {
    pub(super) kind: ElementKind,
    pub(super) formulation: Formulation,
    pub(super) elements: Rc<[u32]>,
    /// `[batch * N + a]`, one node per lane. The last batch is padded with copies of the last
    /// element.
    pub(super) nodes: Rc<[[u32; WIDTH]]>,
    /// Reference positions `[batch * N + a][i][lane]` \[m\].
    pub(super) points: Rc<[[[f64; WIDTH]; D]]>,
    /// The first pass uses the full rule. A second pass integrates the volume terms if locking is
    /// treated within each element; those of patches belong to a [`PatchGroup`](super::PatchGroup).
    pub(super) passes: Vec<Pass>,
}

impl<const D: usize> ElementGroup<D> {
    /// The elements `elements` (local numbers, all of one kind) of `mesh`.
    ///
    /// # Errors
    /// - The kinds differ or have another dimension.
    /// - The kind does not support the treatment of locking.
    /// - Volume terms have points of their own under plane stress.
    /// - The density is negative.
    /// - An element is inverted in the reference configuration.
    pub fn new(mesh: &Mesh<D>, elements: Vec<u32>, formulation: Formulation) -> Result<Self> {
        let Some(&first) = elements.first() else {
            return Err(Error::internal("a group of no elements"));
        };
        let kind = mesh.kinds[first as usize];
        if kind.dimension() != D || elements.iter().any(|&e| mesh.kinds[e as usize] != kind) {
            return Err(Error::internal(format!(
                "a group of {kind} holds elements of another kind or dimension"
            )));
        }
        if !(formulation.density >= 0.0 && formulation.density.is_finite()) {
            return Err(Error::case(format!("density: {} is negative", formulation.density)));
        }
        let rule = formulation.cure(kind).volume_rule(kind)?;
        if formulation.plane == PlaneState::Stress && rule != VolumeRule::Full {
            return Err(Error::internal("a treatment of locking under plane stress"));
        }
        let passes = passes(kind, rule);
        let mut nodes = Vec::with_capacity(elements.len().div_ceil(WIDTH) * kind.nodes());
        for batch in elements.chunks(WIDTH) {
            for a in 0..kind.nodes() {
                nodes.push(std::array::from_fn(|lane| {
                    let element = batch[lane.min(batch.len() - 1)];
                    mesh.element_nodes(element as usize)[a]
                }));
            }
        }
        let place = |node: &[u32; WIDTH]| {
            std::array::from_fn(|i| std::array::from_fn(|lane| mesh.points[node[lane] as usize][i]))
        };
        let points = nodes.iter().map(place).collect();
        let (elements, nodes) = (elements.into(), nodes.into());
        let group = Self { kind, formulation, elements, nodes, points, passes };
        group.check_geometry()?;
        Ok(group)
    }

    /// The group with volume terms at the dilatation projected on `space`, whatever the treatment of locking: to
    /// examine pairs of displacements and pressures.
    #[must_use]
    pub fn with_dilatation_in(self, space: DilatationSpace) -> Self {
        Self { passes: passes(self.kind, VolumeRule::Projected(space)), ..self }
    }

    /// The same elements with a smaller bulk modulus, for matrices that are factorised incompletely: see
    /// [`Formulation::SOFTENED`]. `None` if the material has no larger one. `relaxed` is the part of the shear
    /// modulus that remains when viscous branches have relaxed.
    #[must_use]
    pub fn softened(&self, relaxed: f64) -> Option<Self> {
        let formulation = self.formulation.softened(Some(self.kind), relaxed)?;
        Some(Self { formulation, ..self.clone() })
    }

    /// Kind of the elements.
    pub fn kind(&self) -> ElementKind {
        self.kind
    }

    /// The formulation of the group.
    pub fn formulation(&self) -> &Formulation {
        &self.formulation
    }

    /// Local numbers of the elements; the `index` in a sink refers to this list.
    pub fn elements(&self) -> &[u32] {
        &self.elements
    }

    /// Copies the nodes of the element at `index` into `nodes`.
    pub(super) fn nodes_of(&self, index: usize, nodes: &mut Vec<u32>) {
        let count = self.kind.nodes();
        let batch = &self.nodes[index / WIDTH * count..][..count];
        nodes.clear();
        nodes.extend(batch.iter().map(|lanes| lanes[index % WIDTH]));
    }

    /// Copies the reference positions of the nodes of the element at `index` into `points` \[m\].
    pub(super) fn points_of(&self, index: usize, points: &mut Vec<[f64; D]>) {
        let count = self.kind.nodes();
        let batch = &self.points[index / WIDTH * count..][..count];
        points.clear();
        points.extend(batch.iter().map(|lanes| lanes.map(|coordinate| coordinate[index % WIDTH])));
    }

    /// Extent across the plane at the point of an element with these reference positions and shape
    /// functions \[m\], see [`PlaneState::depth`].
    pub(super) fn depth_at(&self, points: &[[f64; D]], shape: &[f64]) -> f64 {
        let radius = points.iter().zip(shape).map(|(point, n)| point[0] * n).sum();
        self.formulation.plane.depth(radius)
    }

    /// Creates one value for each quadrature pass from the part of the law that it integrates.
    pub(super) fn parts<K>(&self, of: impl Fn(Part) -> K) -> Vec<K> {
        self.passes.iter().map(|pass| of(pass.part)).collect()
    }

    fn check_geometry(&self) -> Result<()> {
        let mut points = Vec::new();
        let mut gradients = vec![[0.0; D]; self.kind.nodes()];
        for (index, element) in self.elements.iter().enumerate() {
            self.points_of(index, &mut points);
            for (pass, q) in
                self.passes.iter().flat_map(|pass| (0..pass.table.points).map(move |q| (pass, q)))
            {
                let det = super::kinematics::reference_gradients(&points, pass.dn(q), &mut gradients);
                let n = pass.table.nodes;
                let radius = points.iter().zip(&pass.table.n[q * n..(q + 1) * n]).map(|(x, n)| x[0] * n);
                if self.formulation.plane.is_revolved() && radius.sum::<f64>() <= 0.0 {
                    let kind = self.kind;
                    let centre = spelled(&centre(&points));
                    return Err(Error::file(format!(
                        "{kind} element {element} around {centre} crosses the axis of revolution, x = 0"
                    ))
                    .hint("in axisymmetry x is the radius: move the mesh to x >= 0"));
                }
                if det <= 0.0 || det.is_nan() {
                    let kind = self.kind;
                    let centre = centre(&points);
                    return Err(Error::file(format!(
                        "{kind} element {element} around {} is inverted or flat: Jacobian {det:.3e} is not positive",
                        spelled(&centre)
                    )));
                }
            }
        }
        Ok(())
    }
}

fn centre<const D: usize>(points: &[[f64; D]]) -> [f64; D] {
    std::array::from_fn(|i| points.iter().map(|point| point[i]).sum::<f64>() / points.len() as f64)
}

/// One pass with all terms, or one with the shear terms and, if the elements have volume terms of their own,
/// one with these.
fn passes(kind: ElementKind, rule: VolumeRule) -> Vec<Pass> {
    let full = reference(kind).full_rule();
    let second = match rule {
        VolumeRule::Full => return vec![Pass::new(kind, full, Part::Whole)],
        VolumeRule::Patches => return vec![Pass::new(kind, full, Part::Shear)],
        VolumeRule::Mean => Pass::mean(kind, Part::Volume),
        VolumeRule::Projected(space) => {
            Pass { sampling: Sampling::Projected(space), ..Pass::new(kind, full, Part::Volume) }
        }
        VolumeRule::Of(sibling) => Pass::new(kind, reference(sibling).full_rule(), Part::Volume),
    };
    vec![Pass::new(kind, full, Part::Shear), second]
}
