//! Projects the visible faces of the bodies onto the sheet, sorted so that near ones cover far
//! ones.

use std::collections::BTreeMap;

use super::grid::{Grid, Shot};
use super::shapes::{is_line, is_solid, polygons};

/// Direction of view: unit vectors to the right, upward, and toward the eye.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    right: [f64; 3],
    up: [f64; 3],
    toward: [f64; 3],
}

impl View {
    /// The x-y plane from the front.
    pub const PLANE: Self = Self { right: [1.0, 0.0, 0.0], up: [0.0, 1.0, 0.0], toward: [0.0, 0.0, 1.0] };

    /// From the front right, `elevation` \[rad\] above the horizon (below if negative), without
    /// perspective.
    pub fn from_front_right(elevation: f64) -> Self {
        let (sin_a, cos_a) = (-std::f64::consts::FRAC_PI_3).sin_cos();
        let (sin_e, cos_e) = elevation.sin_cos();
        Self {
            right: [-sin_a, cos_a, 0.0],
            up: [-sin_e * cos_a, -sin_e * sin_a, cos_e],
            toward: [cos_e * cos_a, cos_e * sin_a, sin_e],
        }
    }

    fn flat(&self, point: [f64; 3]) -> [f64; 2] {
        [dot(self.right, point), dot(self.up, point)]
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// One polygon, or a line on a contact surface in 2D.
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    /// Corners \[m\] on the sheet.
    pub corners: Vec<[f64; 2]>,
    /// The value that its colour shows; `None` for a pale face.
    pub value: Option<f64>,
    /// Whether it is a line.
    pub is_line: bool,
    depth: f64,
}

/// The quantity that the colours show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    /// Von Mises stress on the bodies \[Pa\].
    VonMises,
    /// Pressure on the contact surfaces \[Pa\]; the bodies are pale.
    Pressure,
}

/// The visible faces, far ones first, the outline of the bodies before they were deformed, and that of
/// the rigid bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// In drawing order.
    pub faces: Vec<Face>,
    /// Edges of the undeformed bodies, in 2D only.
    pub outline: Vec<[[f64; 2]; 2]>,
    /// Lines of obstacles and rigid bodies near the bodies, in 2D only.
    pub rigid: Vec<[[f64; 2]; 2]>,
}

impl Scene {
    /// Projects a snapshot. In 2D the view is from the front. In 3D it is from above for stresses
    /// and from below for pressures, because a resting body is in contact at its lower side.
    pub fn of(shot: &Shot, shown: Shown) -> Self {
        let is_space = shot.bodies.types.iter().any(|&kind| is_solid(kind));
        let view = match (is_space, shown) {
            (false, _) => View::PLANE,
            (true, Shown::VonMises) => View::from_front_right(0.42),
            (true, Shown::Pressure) => View::from_front_right(-0.42),
        };
        let skin = skin(&shot.bodies);
        let size = shot.bodies.diagonal();
        let mut faces = Vec::new();
        for (owner, ring) in &skin {
            let value = (shown == Shown::VonMises).then(|| shot.bodies.values[*owner]);
            faces.push(face(&shot.bodies, ring, view, value));
        }
        if let (Some(surfaces), Shown::Pressure) = (&shot.surfaces, shown) {
            faces.extend(facets(surfaces, view, 1e-3 * size));
        }
        faces.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        let outline = if is_space { Vec::new() } else { outline(&shot.bodies, &skin) };
        let mut scene = Self { faces, outline, rigid: Vec::new() };
        if let (Some(rigid), false) = (&shot.rigid, is_space) {
            let window = scene.extent().map(|[low, high]| [low - MARGIN * size, high + MARGIN * size]);
            let lines = rigid.cells.iter().filter_map(|cell| Some([*cell.first()?, *cell.get(1)?]));
            let lines = lines.map(|ends| ends.map(|point| View::PLANE.flat(current(rigid, point))));
            scene.rigid = lines.filter_map(|line| inside(line, window)).collect();
        }
        scene
    }

    /// Smallest and largest coordinates on the sheet.
    pub fn extent(&self) -> [[f64; 2]; 2] {
        let span = |i: usize| {
            let along = self.points().map(|point| point[i]).filter(|x| x.is_finite());
            along.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
        };
        [span(0), span(1)]
    }

    /// All points on the sheet.
    pub fn points(&self) -> impl Iterator<Item = [f64; 2]> {
        self.faces
            .iter()
            .flat_map(|face| face.corners.iter().copied())
            .chain(self.outline.iter().flatten().copied())
            .chain(self.rigid.iter().flatten().copied())
    }
}

/// Distance from the bodies up to which rigid bodies are drawn, per size of the bodies, chosen by eye.
const MARGIN: f64 = 0.08;

/// The part of a line that is within a rectangle; `None` if it is outside.
fn inside([from, to]: [[f64; 2]; 2], window: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let mut range = [0.0_f64, 1.0_f64];
    for i in 0..2 {
        let way = to[i] - from[i];
        let [low, high] = window[i];
        if way == 0.0 {
            if from[i] < low || from[i] > high {
                return None;
            }
            continue;
        }
        let ends = [(low - from[i]) / way, (high - from[i]) / way];
        range = [range[0].max(ends[0].min(ends[1])), range[1].min(ends[0].max(ends[1]))];
    }
    let at = |t: f64| [0, 1].map(|i| from[i] + (to[i] - from[i]) * t);
    (range[0] < range[1]).then(|| range.map(at))
}

/// Faces to draw: all cells in 2D, and in 3D the surface of the bodies, which consists of faces
/// that belong to a single cell.
fn skin(grid: &Grid) -> Vec<(usize, Vec<usize>)> {
    let mut rings: BTreeMap<Vec<usize>, Option<(usize, Vec<usize>)>> = BTreeMap::new();
    for (owner, (cell, &kind)) in grid.cells.iter().zip(&grid.types).enumerate() {
        for polygon in polygons(kind) {
            let ring: Vec<usize> =
                polygon.iter().filter_map(|&place| cell.get(place as usize).copied()).collect();
            let mut key = ring.clone();
            key.sort_unstable();
            rings.entry(key).and_modify(|found| *found = None).or_insert(Some((owner, ring)));
        }
    }
    rings.into_values().flatten().collect()
}

fn facets(surfaces: &Grid, view: View, nearer: f64) -> Vec<Face> {
    let mut faces = Vec::new();
    for (cell, &kind) in surfaces.cells.iter().zip(&surfaces.types) {
        for polygon in polygons(kind) {
            let ring: Vec<usize> =
                polygon.iter().filter_map(|&place| cell.get(place as usize).copied()).collect();
            let mean = ring.iter().map(|&point| surfaces.values[point]).sum::<f64>() / ring.len() as f64;
            let mut face = face(surfaces, &ring, view, Some(mean));
            face.depth = if is_line(kind) { f64::INFINITY } else { face.depth + nearer };
            face.is_line = is_line(kind);
            faces.push(face);
        }
    }
    faces
}

fn face(grid: &Grid, ring: &[usize], view: View, value: Option<f64>) -> Face {
    let places: Vec<[f64; 3]> = ring.iter().map(|&point| current(grid, point)).collect();
    let depth = places.iter().map(|&place| dot(view.toward, place)).sum::<f64>() / places.len() as f64;
    Face { corners: places.iter().map(|&place| view.flat(place)).collect(), value, is_line: false, depth }
}

fn current(grid: &Grid, point: usize) -> [f64; 3] {
    [0, 1, 2].map(|i| grid.points[point][i] + grid.displacement[point][i])
}

fn outline(grid: &Grid, skin: &[(usize, Vec<usize>)]) -> Vec<[[f64; 2]; 2]> {
    let mut edges: BTreeMap<[usize; 2], usize> = BTreeMap::new();
    for (_, ring) in skin {
        for (place, &a) in ring.iter().enumerate() {
            let b = ring[(place + 1) % ring.len()];
            *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    let single = edges.into_iter().filter(|(_, count)| *count == 1);
    single.map(|(ends, _)| ends.map(|point| View::PLANE.flat(grid.points[point]))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cubes() -> Shot {
        let corner = |i: usize| [(i % 3) as f64, ((i / 3) % 2) as f64, (i / 6) as f64];
        let cell = |x: usize| [0, 1, 4, 3, 6, 7, 10, 9].map(|i| i + x).to_vec();
        let bodies = Grid {
            points: (0..12).map(corner).collect(),
            displacement: vec![[0.0; 3]; 12],
            cells: vec![cell(0), cell(1)],
            types: vec![12, 12],
            values: vec![1.0, 2.0],
        };
        let surfaces =
            Grid { cells: vec![vec![0, 1, 4, 3]], types: vec![9], values: vec![4.0; 12], ..bodies.clone() };
        Shot { time: 1.0, bodies, surfaces: Some(surfaces), rigid: None }
    }

    /// The face between two cubes is hidden, and the nearest face comes last.
    #[test]
    fn shows_the_skin_of_solids() {
        let scene = Scene::of(&cubes(), Shown::VonMises);
        assert_eq!(scene.faces.len(), 10);
        assert!(scene.faces.windows(2).all(|pair| pair[0].depth <= pair[1].depth));
        assert!(scene.faces.iter().all(|face| face.value.is_some()));
    }

    /// Seen from below, the facet under pressure covers the face of the body on which it lies.
    #[test]
    fn facets_lie_before_their_bodies() {
        let scene = Scene::of(&cubes(), Shown::Pressure);
        let facet = scene.faces.iter().position(|face| face.value == Some(4.0)).unwrap();
        let same = |face: &Face| {
            let mut corners = face.corners.clone();
            corners.sort_by(|a, b| a[0].total_cmp(&b[0]));
            corners
        };
        let body = scene.faces.iter().position(|f| f.value.is_none() && same(f) == same(&scene.faces[facet]));
        assert!(body.unwrap() < facet);
    }

    /// Up and right point as expected, and the three directions form a right-handed frame, from
    /// above and from below.
    #[test]
    fn views_are_frames() {
        for elevation in [0.42, -0.42] {
            let View { right, up, toward } = View::from_front_right(elevation);
            let cross = [0, 1, 2]
                .map(|i| right[(i + 1) % 3] * up[(i + 2) % 3] - right[(i + 2) % 3] * up[(i + 1) % 3]);
            assert!((0..3).all(|i| (cross[i] - toward[i]).abs() < 1e-15) && up[2] > 0.0 && toward[1] < 0.0);
        }
    }

    /// The outline of two quadrilaterals consists of their six outer edges in the undeformed
    /// configuration.
    #[test]
    fn outline_is_the_undeformed_rim() {
        let cubes = cubes().bodies;
        let flat = Grid { cells: vec![vec![0, 1, 4, 3], vec![1, 2, 5, 4]], types: vec![9, 9], ..cubes };
        let moved = Grid { displacement: vec![[5.0, 0.0, 0.0]; 12], ..flat };
        let scene =
            Scene::of(&Shot { time: 0.0, bodies: moved, surfaces: None, rigid: None }, Shown::VonMises);
        assert_eq!(scene.outline.len(), 6);
        assert!(scene.outline.iter().flatten().all(|point| point[0] <= 2.0));
        assert!(scene.faces.iter().flat_map(|face| &face.corners).all(|point| point[0] >= 5.0));
    }

    /// A floor is drawn below the bodies only, and a tool far away not at all.
    #[test]
    fn rigid_bodies_are_drawn_near_the_bodies() {
        let cubes = cubes().bodies;
        let flat = Grid { cells: vec![vec![0, 1, 4, 3], vec![1, 2, 5, 4]], types: vec![9, 9], ..cubes };
        let floor = Grid {
            points: vec![[-9.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0, 5.0, 0.0], [1.0, 5.0, 0.0]],
            displacement: vec![[0.0; 3]; 4],
            cells: vec![vec![0, 1], vec![2, 3]],
            types: vec![3, 3],
            values: Vec::new(),
        };
        let margin = MARGIN * flat.diagonal();
        let shot = Shot { time: 0.0, bodies: flat, surfaces: None, rigid: Some(floor) };
        let scene = Scene::of(&shot, Shown::VonMises);
        let [[from, to]] = scene.rigid[..] else { panic!("{:?}", scene.rigid) };
        assert!((from[0] + margin).abs() < 1e-12 && (to[0] - 2.0 - margin).abs() < 1e-12);
        assert_eq!([from[1], to[1]], [0.0, 0.0]);
    }
}
