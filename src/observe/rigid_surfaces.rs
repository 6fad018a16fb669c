//! `rigid.pvd`: surfaces of the obstacles and rigid bodies, as facets that move with them.

use std::rc::Rc;

use mpi::topology::SimpleCommunicator;
use mpi::traits::Communicator;

use super::fields::{Field, FieldValues, Location};
use super::quantity::ReportedQuantity;
use crate::assembly::{ContactSystem, ToolState};
use crate::contact::obstacle::{Shape, Window};
use crate::petsc::max_over_ranks;
use crate::tensor::Vector;

/// The displacement of a rigid surface.
pub const RIGID_DISPLACEMENT: ReportedQuantity = ReportedQuantity::vector(
    "displacement",
    "m",
    "displacement of the rigid body, by which ParaView warps its surface; zero for obstacles",
);

/// An obstacle or a rigid body with its shape before any motion.
#[derive(Debug, Clone)]
pub struct RigidShape<const D: usize> {
    /// Name in the case.
    pub name: String,
    /// Its shape.
    pub shape: Rc<dyn Shape<D>>,
}

/// Facets on the surfaces of all obstacles and rigid bodies. Rank 0 has all of them.
#[derive(Debug, Clone, Default)]
pub struct RigidSurfaces<const D: usize> {
    /// Positions of the points before any motion \[m\].
    pub points: Vec<[f64; D]>,
    /// Numbers of the points.
    pub numbers: Vec<u32>,
    /// Ranges of the facets in `nodes`: facet `e` has `nodes[offsets[e]..offsets[e + 1]]`.
    pub offsets: Vec<u32>,
    /// Points of the facets.
    pub nodes: Vec<u32>,
    /// VTK's type of each facet.
    pub vtk_types: Vec<u8>,
    /// Number of the body of each facet, in the order of the case.
    pub body: Vec<u16>,
    /// Names of the bodies, and the end of each in `points`.
    ends: Vec<(String, usize)>,
}

impl<const D: usize> RigidSurfaces<D> {
    /// The surfaces of these shapes near the deformable bodies. Collective.
    pub fn new(system: &ContactSystem<D>, shapes: &[RigidShape<D>]) -> Self {
        let world = system.session().world();
        let window = window(system, world);
        let mut surfaces = Self { offsets: vec![0], ..Self::default() };
        if world.rank() != 0 {
            return surfaces;
        }
        for (number, RigidShape { name, shape }) in shapes.iter().enumerate() {
            let drawing = shape.drawing(&window);
            let first = surfaces.points.len() as u32;
            for facet in drawing.facets() {
                surfaces.nodes.extend(facet.iter().map(|node| first + node));
                surfaces.offsets.push(surfaces.nodes.len() as u32);
                surfaces.vtk_types.push(vtk_type(facet.len()));
                surfaces.body.push(u16::try_from(number).unwrap_or(u16::MAX));
            }
            surfaces.points.extend(drawing.points.iter().map(|x| <[f64; D]>::from(*x)));
            surfaces.ends.push((name.clone(), surfaces.points.len()));
        }
        surfaces.numbers = (0..surfaces.points.len() as u32).collect();
        surfaces
    }

    /// The displacement of all points with the rigid bodies in their present state.
    pub fn displacement<'a>(&self, tools: impl Iterator<Item = &'a ToolState> + Clone) -> Field {
        let mut values = vec![0.0; self.points.len() * D];
        let mut first = 0;
        for (name, end) in &self.ends {
            if let Some(tool) = tools.clone().find(|tool| tool.name == *name) {
                let points = self.points[first..*end].iter();
                for (x, value) in points.zip(values[first * D..end * D].chunks_exact_mut(D)) {
                    let x = std::array::from_fn(|i| x.get(i).copied().unwrap_or(0.0));
                    value.copy_from_slice(&tool.displacement_of(x)[..D]);
                }
            }
            first = *end;
        }
        Field {
            quantity: RIGID_DISPLACEMENT,
            location: Location::Nodes,
            values: FieldValues::Numbers(values),
        }
    }
}

/// VTK's line, triangle and quadrilateral.
fn vtk_type(points: usize) -> u8 {
    match points {
        2 => 3,
        3 => 5,
        _ => 9,
    }
}

/// The window that contains the elements of all bodies. Collective.
fn window<const D: usize>(system: &ContactSystem<D>, world: &SimpleCommunicator) -> Window<D> {
    let mesh = &system.bodies().local().mesh;
    let mut most = vec![f64::NEG_INFINITY; 2 * D];
    for &node in &mesh.nodes {
        for (i, x) in mesh.points[node as usize].iter().enumerate() {
            most[i] = most[i].max(*x);
            most[D + i] = most[D + i].max(-x);
        }
    }
    max_over_ranks(world, &mut most);
    let half = Vector::<D>::from_fn(|i, _| 0.5 * (most[i] + most[D + i]));
    Window { centre: Vector::from_fn(|i, _| most[i] - half[i]), size: half.norm() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body that turns by a right angle about its reference point, and is moved.
    #[test]
    fn points_move_with_their_body() {
        let tool = ToolState {
            name: "tool".to_owned(),
            reference: [1.0, 0.0, 0.0],
            position: [1.0, 2.0, 0.0],
            rotation: [0.0, 0.0, std::f64::consts::FRAC_PI_2],
            velocity: [0.0; 3],
            spin: [0.0; 3],
            force: [0.0; 3],
            torque: [0.0; 3],
            moved: [0.0; 6],
            free: false,
            motion: None,
        };
        let surfaces = RigidSurfaces::<2> {
            points: vec![[5.0, 5.0], [2.0, 0.0], [1.0, 3.0]],
            ends: vec![("floor".to_owned(), 1), ("tool".to_owned(), 3)],
            ..RigidSurfaces::default()
        };
        let FieldValues::Numbers(moved) = surfaces.displacement([tool].iter()).values else {
            panic!("numbers");
        };
        let exact = [0.0, 0.0, -1.0, 3.0, -3.0, -1.0];
        assert!(moved.iter().zip(exact).all(|(found, exact)| (found - exact).abs() < 1e-14), "{moved:?}");
    }
}
