//! Degrees of freedom of a rank, and which of them are prescribed (3.1).
//!
//! Numbering is node-major: `dof = node * D + component`, local nodes, owned before ghosts. Ghost
//! degrees of freedom are marked like owned ones, so that columns of prescribed unknowns are known
//! without communication.

use super::held::Held;
use crate::error::{Error, Result};
use crate::mesh::{Mesh, digits};

/// A displacement boundary condition as resolved from the case: the prescribed components on a set.
#[derive(Debug, Clone, PartialEq)]
pub struct DisplacementBoundary<const D: usize> {
    /// Name in the case file.
    pub name: String,
    /// Set of points, facets or elements to whose nodes the condition applies.
    pub set: String,
    /// Components that are prescribed.
    pub components: [bool; D],
}

/// Degrees of freedom that a displacement boundary condition prescribes on this rank, including
/// ghosts.
#[derive(Debug, Clone, PartialEq)]
pub struct Prescribed {
    /// Name in the case file.
    pub name: String,
    /// Local node and component, sorted.
    pub entries: Vec<(u32, u8)>,
}

/// Prescribed displacement \[m\], velocity \[m/s\] and acceleration \[m/s2\] of one component at
/// one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PrescribedState {
    /// Displacement \[m\].
    pub u: f64,
    /// Velocity \[m/s\].
    pub v: f64,
    /// Acceleration \[m/s2\].
    pub a: f64,
}

/// Local arrays of `u` \[m\], `v` \[m/s\] and `a` \[m/s2\] by degree of freedom.
#[derive(Debug)]
pub struct PrescribedFields<'a> {
    /// Displacement \[m\].
    pub u: &'a mut [f64],
    /// Velocity \[m/s\].
    pub v: &'a mut [f64],
    /// Acceleration \[m/s2\]; empty in a problem without inertia.
    pub a: &'a mut [f64],
}

/// The prescribed degrees of freedom of a rank.
#[derive(Debug, Clone, PartialEq)]
pub struct DofMap<const D: usize> {
    /// The held directions of each local node, including ghosts.
    pub held: Held<D>,
    /// One entry for each boundary condition, in the given order.
    pub boundaries: Vec<Prescribed>,
    /// Local nodes on the axis of revolution, which have no radial motion.
    axis: Vec<u32>,
}

impl<const D: usize> DofMap<D> {
    /// Resolves the boundary conditions on the local mesh. In axisymmetry the radial motion of nodes on
    /// the axis is zero and belongs to no condition.
    ///
    /// If two conditions prescribe the same motion of a degree of freedom, for example at the
    /// intersection of two symmetry planes, it belongs to the first. `same_motion` is called with
    /// (boundaries, component).
    ///
    /// # Errors
    /// A set does not exist, or two conditions prescribe different motions of one degree of
    /// freedom. The error occurs on the ranks that have this degree of freedom, so the ranks must
    /// agree on it.
    pub fn new(
        mesh: &Mesh<D>,
        boundaries: &[DisplacementBoundary<D>],
        same_motion: impl Fn([usize; 2], usize) -> bool,
    ) -> Result<Self> {
        let is_on_axis = |node: usize| mesh.plane.is_revolved() && mesh.points[node][0] == 0.0;
        let axis: Vec<u32> =
            (0..mesh.points.len() as u32).filter(|&node| is_on_axis(node as usize)).collect();
        let mut holder = vec![usize::MAX; mesh.points.len() * D];
        let mut all = Vec::with_capacity(boundaries.len());
        for (number, boundary) in boundaries.iter().enumerate() {
            let mut own = Vec::new();
            for (node, component) in entries(mesh, boundary)? {
                if component == 0 && is_on_axis(node as usize) {
                    continue;
                }
                let held = &mut holder[node as usize * D + usize::from(component)];
                if *held == usize::MAX {
                    *held = number;
                    own.push((node, component));
                } else if !same_motion([*held, number], usize::from(component)) {
                    let place = place(&mesh.points[node as usize]);
                    return Err(conflict([&boundaries[*held].name, &boundary.name], component, &place));
                }
            }
            all.push(Prescribed { name: boundary.name.clone(), entries: own });
        }
        let mut along_axes: Vec<bool> = holder.iter().map(|&held| held != usize::MAX).collect();
        axis.iter().for_each(|&node| along_axes[node as usize * D] = true);
        Ok(Self { held: Held::along_axes(along_axes), boundaries: all, axis })
    }

    /// Number of local degrees of freedom, including ghosts.
    pub fn len(&self) -> usize {
        self.held.len()
    }

    /// Whether the rank holds no nodes.
    pub fn is_empty(&self) -> bool {
        self.held.is_empty()
    }

    /// Writes the prescribed motion to the fields, zero on the axis of revolution; other entries are
    /// unchanged.
    ///
    /// `motion` is called with (boundary, component, reference point \[m\]).
    ///
    /// # Errors
    /// The first error that `motion` returns.
    pub fn fill(
        &self,
        points: &[[f64; D]],
        mut motion: impl FnMut(usize, usize, &[f64; D]) -> Result<PrescribedState>,
        fields: PrescribedFields,
    ) -> Result<()> {
        for &node in &self.axis {
            let radial = node as usize * D;
            fields.u[radial] = 0.0;
            fields.v[radial] = 0.0;
            if let Some(a) = fields.a.get_mut(radial) {
                *a = 0.0;
            }
        }
        for (number, boundary) in self.boundaries.iter().enumerate() {
            for &(node, component) in &boundary.entries {
                let component = usize::from(component);
                let at = motion(number, component, &points[node as usize])?;
                let dof = node as usize * D + component;
                (fields.u[dof], fields.v[dof]) = (at.u, at.v);
                if let Some(a) = fields.a.get_mut(dof) {
                    *a = at.a;
                }
            }
        }
        Ok(())
    }
}

fn entries<const D: usize>(mesh: &Mesh<D>, boundary: &DisplacementBoundary<D>) -> Result<Vec<(u32, u8)>> {
    let Some(nodes) = mesh.set_nodes(&boundary.set) else {
        let message = format!("boundary '{}': there is no set '{}'", boundary.name, boundary.set);
        return Err(Error::case(message));
    };
    let components: Vec<u8> = (0..D as u8).filter(|&k| boundary.components[usize::from(k)]).collect();
    Ok(nodes.into_iter().flat_map(|node| components.iter().map(move |&k| (node, k))).collect())
}

fn conflict(names: [&str; 2], component: u8, place: &str) -> Error {
    let axis = ["x", "y", "z"][usize::from(component)];
    let [first, second] = names;
    Error::case(format!(
        "boundaries '{first}' and '{second}' both prescribe u_{axis} of the node at {place}, with different \
         values"
    ))
    .hint(&format!("remove {axis} from one of them, or use a set without this node for one of them"))
}

fn place<const D: usize>(point: &[f64; D]) -> String {
    let numbers: Vec<String> = point.iter().map(|&x| digits(x)).collect();
    format!("({})", numbers.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{ElementKind, Facet};

    /// A unit square of one quad4 with the sets left and bottom.
    fn square() -> Mesh<2> {
        let mut mesh = Mesh::with_points(vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        mesh.push(ElementKind::Quad4, [0, 1, 2, 3]);
        mesh.facet_sets.insert("left".into(), vec![Facet { element: 0, side: 3 }]);
        mesh.facet_sets.insert("bottom".into(), vec![Facet { element: 0, side: 0 }]);
        mesh
    }

    fn boundary(name: &str, set: &str, components: [bool; 2]) -> DisplacementBoundary<2> {
        DisplacementBoundary { name: name.into(), set: set.into(), components }
    }

    /// Conditions on different components of a shared corner coexist, and each is filled with its
    /// own values.
    #[test]
    fn prescribed_values_reach_their_degrees_of_freedom() {
        let mesh = square();
        let map = DofMap::new(
            &mesh,
            &[boundary("slide", "left", [true, false]), boundary("lift", "bottom", [false, true])],
            |_, _| false,
        )
        .expect("no conflict");
        assert_eq!(map.held.axes(), [true, true, false, true, false, false, true, false]);
        assert_eq!(map.boundaries[1].entries, [(0, 1), (1, 1)]);
        let (mut u, mut v, mut a) = (vec![9.0; 8], vec![9.0; 8], vec![9.0; 8]);
        let motion = |boundary: usize, component: usize, x: &[f64; 2]| {
            let value = 10.0 * boundary as f64 + component as f64 + 0.1 * x[1];
            Ok(PrescribedState { u: value, v: -value, a: 2.0 * value })
        };
        map.fill(&mesh.points, motion, PrescribedFields { u: &mut u, v: &mut v, a: &mut a }).expect("filled");
        assert_eq!(u, [0.0, 11.0, 9.0, 11.0, 9.0, 9.0, 0.1, 9.0]);
        assert_eq!((v[3], a[3]), (-11.0, 22.0));
        map.held.clear(&mut u);
        assert_eq!(u, [0.0, 0.0, 9.0, 0.0, 9.0, 9.0, 0.0, 9.0]);
    }

    /// If two conditions prescribe the same motion, the degree of freedom belongs only to the
    /// first.
    #[test]
    fn equal_motions_share_a_corner() {
        let both = [boundary("clamp", "left", [true, true]), boundary("floor", "bottom", [false, true])];
        let map = DofMap::new(&square(), &both, |pair, component| pair == [0, 1] && component == 1);
        let map = map.expect("no conflict");
        assert_eq!(map.boundaries[0].entries, [(0, 0), (0, 1), (3, 0), (3, 1)]);
        assert_eq!(map.boundaries[1].entries, [(1, 1)]);
    }

    /// Two different motions of one degree of freedom are rejected with their names and the
    /// location.
    #[test]
    fn conflicts_name_the_point() {
        let both = [boundary("clamp", "left", [true, true]), boundary("floor", "bottom", [false, true])];
        let message =
            DofMap::new(&square(), &both, |_, _| false).expect_err("conflict at the corner").message;
        assert!(
            message.contains("'clamp' and 'floor' both prescribe u_y of the node at (0, 0)"),
            "{message}"
        );
        let unknown = DofMap::new(&square(), &[boundary("clamp", "leftt", [true, true])], |_, _| false);
        assert!(unknown.expect_err("no such set").message.contains("'leftt'"));
    }
}
