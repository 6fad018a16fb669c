//! The target side of a contact: an obstacle, or the facets of a body that are known to this rank.

use std::rc::Rc;

use super::nodal::at;
use super::obstacle::Shape;
use super::passage::Path;
use super::rigid::{BodyFrame, BodyMotion, MotionStep};
use crate::error::Result;
use crate::mesh::ElementKind;
use crate::tensor::Vector;

/// Facets of a target as plain arrays, with one entry for each facet except in `nodes` and
/// `offsets`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TargetFacets {
    /// Kinds of the facets.
    pub kinds: Vec<ElementKind>,
    /// Start of the nodes of each facet, and the end of the last: one entry more than facets.
    pub offsets: Vec<u32>,
    /// Nodes in the order of the kinds, normal outward, as indices into the field arrays (local,
    /// then foreign nodes). A node has the same index in all its facets.
    pub nodes: Vec<u32>,
    /// Identifier of each facet, the same on every rank: input element * 16 + side.
    pub identities: Vec<u64>,
    /// Body of each facet.
    pub bodies: Vec<u16>,
    /// Whether each facet has a corner on a sharp edge of its surface or on its boundary.
    pub at_edge: Vec<bool>,
}

impl TargetFacets {
    /// Appends a facet.
    pub fn push(&mut self, kind: ElementKind, nodes: &[u32], identity: u64, body: u16, at_edge: bool) {
        if self.offsets.is_empty() {
            self.offsets.push(0);
        }
        self.kinds.push(kind);
        self.nodes.extend_from_slice(nodes);
        self.offsets.push(self.nodes.len() as u32);
        self.identities.push(identity);
        self.bodies.push(body);
        self.at_edge.push(at_edge);
    }

    /// Number of facets.
    pub fn count(&self) -> usize {
        self.kinds.len()
    }

    /// Nodes of a facet.
    pub fn nodes_of(&self, facet: usize) -> &[u32] {
        &self.nodes[self.range(facet)]
    }

    fn range(&self, facet: usize) -> std::ops::Range<usize> {
        self.offsets[facet] as usize..self.offsets[facet + 1] as usize
    }

    /// Global identifier of side `side` of element `element` of the whole input mesh.
    pub fn identity(element: u32, side: u8) -> u64 {
        u64::from(element) * 16 + u64::from(side)
    }
}

/// Facets of a deformable target known to this rank.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetSurface<const D: usize> {
    facets: TargetFacets,
    reference_points: Vec<Vector<D>>,
}

impl<const D: usize> TargetSurface<D> {
    /// The surface of `facets`. `reference_points` are the positions of all nodes \[m\], indexed as
    /// in the field arrays.
    pub fn new(facets: TargetFacets, reference_points: &[[f64; D]]) -> Self {
        let point = |node: &u32| Vector::from(reference_points[*node as usize]);
        let reference_points = facets.nodes.iter().map(point).collect();
        Self { facets, reference_points }
    }

    /// Number of facets.
    pub fn count(&self) -> usize {
        self.facets.count()
    }

    /// Whether a facet has a corner on a sharp edge of its surface or on its boundary.
    pub fn is_at_edge(&self, facet: u32) -> bool {
        self.facets.at_edge[facet as usize]
    }

    /// Kind of a facet.
    pub fn kind(&self, facet: u32) -> ElementKind {
        self.facets.kinds[facet as usize]
    }

    /// Nodes of a facet as indices into the field arrays.
    pub fn nodes(&self, facet: u32) -> &[u32] {
        self.facets.nodes_of(facet as usize)
    }

    /// Reference positions of the nodes of a facet \[m\].
    pub fn reference_points(&self, facet: u32) -> &[Vector<D>] {
        &self.reference_points[self.facets.range(facet as usize)]
    }

    /// Fills `points` with the current positions of the nodes of a facet \[m\].
    pub fn current(&self, facet: u32, u: &[f64], points: &mut Vec<Vector<D>>) {
        points.clear();
        let nodes = self.reference_points(facet).iter().zip(self.nodes(facet));
        points.extend(nodes.map(|(reference, &node)| reference + at(u, node)));
    }
}

/// What determines the position of a rigid target that moves.
#[derive(Debug, Clone)]
pub enum TargetMotion<const D: usize> {
    /// Prescribed motion.
    Prescribed(Rc<BodyMotion<D>>),
    /// The unknowns of the free rigid body with this index.
    Free(usize),
}

/// A rigid target: its shape and, if it moves, its motion.
#[derive(Debug, Clone)]
pub struct RigidTarget<const D: usize> {
    /// The shape in the reference configuration, which is its body frame.
    pub shape: Rc<dyn Shape<D>>,
    /// Its motion; `None` for a target at rest.
    pub motion: Option<TargetMotion<D>>,
    /// The frame of the last placed step; `None` for a target at rest.
    frame: Option<Box<BodyFrame<D>>>,
    /// Nodes of a free body, indices into the field arrays: displacement, then rotation. `None`
    /// for other bodies.
    pose_nodes: Option<[u32; 2]>,
}

impl<const D: usize> RigidTarget<D> {
    /// A target with this motion. It is not placed yet.
    pub fn moving(shape: Rc<dyn Shape<D>>, motion: Option<TargetMotion<D>>) -> Self {
        Self { shape, motion, frame: None, pose_nodes: None }
    }
}

/// A target at rest.
impl<const D: usize> From<Rc<dyn Shape<D>>> for RigidTarget<D> {
    fn from(shape: Rc<dyn Shape<D>>) -> Self {
        Self::moving(shape, None)
    }
}

/// Target of a contactor.
#[derive(Debug, Clone)]
pub enum ContactTarget<const D: usize> {
    /// Facets of a deformable body.
    Body(TargetSurface<D>),
    /// A rigid body: one target facet, number 0, without nodes.
    Obstacle(RigidTarget<D>),
}

impl<const D: usize> ContactTarget<D> {
    /// A deformable body of which no facet is known yet.
    pub fn unknown_body() -> Self {
        Self::Body(TargetSurface { facets: TargetFacets::default(), reference_points: Vec::new() })
    }

    /// The facets; `None` for an obstacle.
    pub fn body(&self) -> Option<&TargetSurface<D>> {
        match self {
            Self::Body(surface) => Some(surface),
            Self::Obstacle(_) => None,
        }
    }

    /// The shape of a rigid target in its body frame; `None` for a body.
    pub fn obstacle(&self) -> Option<&dyn Shape<D>> {
        match self {
            Self::Body(_) => None,
            Self::Obstacle(target) => Some(&*target.shape),
        }
    }

    /// Whether the target has facets, which are gathered from all ranks. Otherwise it is known everywhere.
    pub fn has_facets(&self) -> bool {
        self.body().is_some()
    }

    /// Whether the target is flat and stays so.
    pub fn is_plane(&self) -> bool {
        self.obstacle().is_some_and(Shape::is_plane)
    }

    /// Places a moving rigid target for the evaluations of a step. `free` are the frames of the
    /// free rigid bodies. Other targets stay as they are.
    ///
    /// # Errors
    /// A value of the motion is not finite, at its position in the case.
    pub fn place(&mut self, step: &MotionStep, free: &[BodyFrame<D>]) -> Result<()> {
        let Self::Obstacle(RigidTarget { motion: Some(motion), frame, .. }) = self else { return Ok(()) };
        *frame = match motion {
            TargetMotion::Prescribed(motion) => Some(Box::new(motion.frame(step)?)),
            TargetMotion::Free(index) => free.get(*index).cloned().map(Box::new),
        };
        Ok(())
    }

    /// Index of the free rigid body that is the target, if it is one.
    pub fn free_body(&self) -> Option<usize> {
        match self {
            Self::Obstacle(RigidTarget { motion: Some(TargetMotion::Free(index)), .. }) => Some(*index),
            _ => None,
        }
    }

    /// Nodes of a free rigid target as indices into the field arrays: displacement, then rotation.
    pub fn pose_nodes(&self) -> Option<[u32; 2]> {
        match self {
            Self::Obstacle(target) => target.pose_nodes,
            Self::Body(_) => None,
        }
    }

    /// Sets the nodes of a free rigid target.
    pub fn set_pose_nodes(&mut self, nodes: [u32; 2]) {
        if let Self::Obstacle(target) = self {
            target.pose_nodes = Some(nodes);
        }
    }

    /// The frame in which a moving rigid target is at rest; `None` for other targets.
    pub fn frame(&self) -> Option<&BodyFrame<D>> {
        match self {
            Self::Body(_) => None,
            Self::Obstacle(target) => target.frame.as_deref(),
        }
    }

    /// Whether the target is a rigid body that moves.
    pub fn is_moving(&self) -> bool {
        matches!(self, Self::Obstacle(RigidTarget { motion: Some(_), .. }))
    }

    /// The path of a point over the step as a rigid target sees it.
    pub fn see(&self, path: Path<D>) -> Path<D> {
        match self.frame() {
            None => path,
            Some(frame) => Path { start: frame.see_start(&path.start), end: frame.see_end(&path.end) },
        }
    }

    /// Motion of a rigid target over the step at a position at its start \[m\].
    pub fn carries(&self, x: &Vector<D>) -> Vector<D> {
        self.frame().map_or_else(Vector::zeros, |frame| frame.carries(x))
    }

    /// Velocity of a rigid target at a position, at the start of the step \[m/s\].
    pub fn velocity_at_start(&self, x: &Vector<D>) -> Vector<D> {
        self.frame().map_or_else(Vector::zeros, |frame| frame.velocity_at_start(x))
    }

    /// Nodes of a facet as indices into the field arrays.
    pub fn nodes(&self, facet: u32) -> &[u32] {
        self.body().map_or(&[], |surface| surface.nodes(facet))
    }

    /// Reference positions of the nodes of a facet \[m\].
    pub fn reference_points(&self, facet: u32) -> &[Vector<D>] {
        self.body().map_or(&[], |surface| surface.reference_points(facet))
    }
}
