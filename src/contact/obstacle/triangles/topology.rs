//! Checks that triangles bound a solid, and orients them outward.

use std::collections::HashMap;

use crate::error::{Error, Result};
use crate::tensor::{Vector, cross};

/// Cure of surfaces that bound no solid.
const REPAIR: &str = "repair the surface in a mesh editor (close holes, merge points, orient faces), or mesh the \
                      solid anew; a tool must be closed";

/// Triangles that bound a solid, anticlockwise seen from outside.
#[derive(Debug)]
pub(super) struct Oriented {
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle the neighbours over its edges from corner 0 to 1, 1 to 2 and 2 to 0.
    pub neighbours: Vec<[u32; 3]>,
    /// Centroid of the solid \[m\].
    pub centroid: Vector<3>,
}

/// Checks points and triangles.
///
/// # Errors
/// A point is not finite, a triangle has no area, the surface is open or not oriented.
pub(super) fn check(points: &[[f64; 3]], mut triangles: Vec<[u32; 3]>) -> Result<Oriented> {
    let fault = |message: String| Err(Error::file(message).hint(REPAIR));
    if triangles.is_empty() {
        return fault("the surface has no triangles".to_owned());
    }
    let at = |k: u32| Vector::<3>::from(points[k as usize]);
    let show = |k: u32| {
        let [x, y, z] = points[k as usize];
        format!("({x}, {y}, {z})")
    };
    for (number, triangle) in triangles.iter().enumerate() {
        if let Some(&corner) = triangle.iter().find(|&&k| !points[k as usize].iter().all(|x| x.is_finite())) {
            return fault(format!(
                "triangle {} has the point {}, which is not finite",
                number + 1,
                show(corner)
            ));
        }
        let [a, b, c] = triangle.map(at);
        let longest = (b - a).norm_squared().max((c - a).norm_squared()).max((c - b).norm_squared());
        if cross(&(b - a), &(c - a)).norm() <= FLAT * longest {
            return fault(format!("triangle {} at {} has no area", number + 1, show(triangle[0])));
        }
    }
    let mut edges: HashMap<[u32; 2], u32> = HashMap::with_capacity(3 * triangles.len());
    for (number, triangle) in (0_u32..).zip(&triangles) {
        for k in 0..3 {
            let edge = [triangle[k], triangle[(k + 1) % 3]];
            if edges.insert(edge, number).is_some() {
                let both = edges.contains_key(&[edge[1], edge[0]]);
                let [from, to] = edge.map(show);
                return fault(match both {
                    true => format!("more than two triangles meet at the edge from {from} to {to}"),
                    false => format!("two triangles at the edge from {from} to {to} are oriented oppositely"),
                });
            }
        }
    }
    let mut neighbours = Vec::with_capacity(triangles.len());
    for triangle in &triangles {
        let mut around = [0; 3];
        for (k, around) in around.iter_mut().enumerate() {
            let [from, to] = [triangle[k], triangle[(k + 1) % 3]];
            match edges.get(&[to, from]) {
                Some(&other) => *around = other,
                None => {
                    return fault(format!(
                        "the surface is open at the edge from {} to {}, in the coordinates of the case",
                        show(from),
                        show(to)
                    ));
                }
            }
        }
        neighbours.push(around);
    }
    // Tetrahedra between a point of the surface and its triangles.
    let origin = at(triangles[0][0]);
    let (mut volume, mut moment) = (0.0, Vector::<3>::zeros());
    for triangle in &triangles {
        let [a, b, c] = triangle.map(|k| at(k) - origin);
        let part = a.dot(&cross(&b, &c)) / 6.0;
        volume += part;
        moment += (a + b + c) * (0.25 * part);
    }
    if volume == 0.0 {
        return fault("the surface encloses no volume".to_owned());
    }
    if volume < 0.0 {
        for (triangle, around) in triangles.iter_mut().zip(&mut neighbours) {
            triangle.swap(1, 2);
            // Edges 0-1 and 2-0 exchange their places.
            around.swap(0, 2);
        }
    }
    Ok(Oriented { triangles, neighbours, centroid: origin + moment / volume })
}

/// A triangle whose height is below this part of its longest edge has no area: below it, the
/// direction of its normal is rounding of coordinates in single precision.
const FLAT: f64 = 1e-7;
