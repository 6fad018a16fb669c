//! Closed surface of triangles from a file, in space.

use std::cell::OnceCell;
use std::collections::HashMap;
use std::rc::Rc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::check_direction;
use super::drawing::{Drawing, Window, is_too_fine};
use super::shape::{Outline, Proximity, Shape};
use super::side::Side;
use super::solid::SolidMoments;
use super::triangles::TriangleSurface;
use super::{NoSolid, numbers, rotation_about};
use crate::error::Result;
use crate::mesh::SurfaceMesh;
use crate::reader::at::At;
use crate::reader::findings::Findings;
use crate::reader::quantity::{Length, Number};
use crate::tensor::{Tensor, Vector};

/// Solid bounded by the triangles of an STL file or a Gmsh mesh, in 3D only; side: outside or
/// inside.
///
/// The surface is curved between triangles that meet at less than `crease_angle`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfaceObstacle {
    /// STL file (text or binary) or Gmsh mesh (MSH 2.2 or 4.1) of a closed surface, relative to the
    /// case file. Its triangles are all oriented outward or all inward.
    pub file: At<String>,
    /// Factor on the coordinates of the file, > 0, such as 0.001 for a file in mm.
    #[serde(default = "unity")]
    pub scale: Number,
    /// Angle of a rotation about the origin of the file \[rad\], after the scaling.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle: Option<Number>,
    /// Axis of this rotation, of any non-zero length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<At<Vec<Number>>>,
    /// Where the origin of the file is, after the rotation \[m\]; zero if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<At<Vec<Length>>>,
    /// Distance of the surface from the triangles \[m\], >= 0. It rounds edges that point outward.
    /// Make it larger than the penetration if there are sharp edges.
    #[serde(default = "zero")]
    pub radius: Length,
    /// Edges whose triangles meet at a larger angle stay sharp \[rad\], > 0.
    #[serde(default = "crease")]
    pub crease_angle: Number,
    /// The side on which the bodies are.
    #[serde(default)]
    pub side: Side,
    /// The surface, once the file has been read.
    #[serde(skip)]
    loaded: LoadedSurface,
}

/// A surface that is set when the file has been read. Two are always equal: a case does not depend
/// on it.
#[derive(Debug, Clone, Default)]
struct LoadedSurface(OnceCell<Rc<TriangleSurface>>);

impl PartialEq for LoadedSurface {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

fn unity() -> Number {
    Number::new(1.0)
}

fn zero() -> Length {
    Length::new(0.0)
}

/// 34 degrees. Round surfaces of eleven or more facets around are smooth (at half of the angle, of
/// 21), and bevels of 45 degrees stay sharp (not at twice the angle).
fn crease() -> Number {
    Number::new(0.6)
}

impl SurfaceObstacle {
    pub(super) fn check(&self, dimension: usize, findings: &mut Findings) {
        if dimension != 3 {
            findings.say(self.file.place, "a surface is a 3D obstacle");
            findings.cure("use a `polyline` in 2D");
            return;
        }
        findings.positive("the scale of a surface", self.scale);
        findings.not_negative("the radius of a surface", self.radius.value, self.radius.place);
        findings.positive("the crease angle of a surface", self.crease_angle);
        if self.crease_angle.value > std::f64::consts::PI {
            let message = format!(
                "the crease angle of a surface must be at most pi, found {}",
                self.crease_angle.value
            );
            findings.say(self.crease_angle.place, message);
            findings.cure("the angle is in radians: 34 degrees are 0.6");
        }
        self.position.iter().for_each(|place| findings.entries("the position of a surface", place, 3));
        match (&self.axis, self.angle) {
            (Some(axis), Some(_)) => {
                check_direction("the axis of the rotation of a surface", axis, 3, findings)
            }
            (Some(axis), None) => {
                findings.say(axis.place, "a surface has the axis of a rotation, but no `angle`");
                findings.cure("add `angle` in radians, or remove `axis`");
            }
            (None, Some(angle)) => {
                findings.say(angle.place, "a rotation of a surface needs an `axis`");
                findings.cure("add `axis`, for example `axis: [0, 0, 1]`");
            }
            (None, None) => {}
        }
    }

    /// Whether the file has been read.
    pub fn is_loaded(&self) -> bool {
        self.loaded.0.get().is_some()
    }

    /// Takes the surface from the file, in the coordinates of the file.
    ///
    /// # Errors
    /// It bounds no solid.
    pub fn load(&self, mesh: SurfaceMesh) -> Result<()> {
        let axis = self.axis.as_ref().map_or_else(Vector::<3>::z, |axis| numbers(axis));
        let turn = rotation_about::<3>(&axis, self.angle.map_or(0.0, |angle| angle.value)) * self.scale.value;
        let shift = self.position.as_ref().map_or_else(Vector::<3>::zeros, |place| numbers(place));
        let SurfaceMesh { mut points, triangles } = mesh;
        points.iter_mut().for_each(|x| *x = (turn * Vector::from(*x) + shift).into());
        let surface = TriangleSurface::new(&points, triangles, self.crease_angle.value)?;
        // A second reading of the same file changes nothing.
        let _ = self.loaded.0.set(Rc::new(surface));
        Ok(())
    }

    /// Why a density gives it no mass; `None` if it does.
    pub(super) fn no_solid(&self) -> Option<NoSolid> {
        match self.side {
            Side::Inside => Some(NoSolid::Unbounded),
            Side::Outside => (self.radius.value != 0.0).then_some(NoSolid::Offset),
        }
    }

    /// The centroid of the solid; the position if the file has not been read.
    pub(super) fn centre<const D: usize>(&self) -> Vector<D> {
        let position = self.position.as_ref().map_or_else(Vector::zeros, |place| numbers(place));
        self.loaded.0.get().map_or(position, |surface| {
            Vector::from_fn(|i, _| surface.centroid.iter().nth(i).copied().unwrap_or(0.0))
        })
    }

    pub(super) fn shape<const D: usize>(&self) -> Surface<D> {
        Surface { surface: self.loaded.0.get().cloned(), radius: self.radius.value, side: self.side }
    }

    #[cfg(test)]
    fn sample(scale: f64, angle: f64, position: [f64; 3], radius: f64, side: Side) -> Self {
        let sample = Self {
            file: String::from("cube.stl").into(),
            scale: Number::new(scale),
            angle: Some(Number::new(angle)),
            axis: Some([1.0, 2.0, -1.0].map(Number::new).to_vec().into()),
            position: Some(position.map(Length::new).to_vec().into()),
            radius: Length::new(radius),
            crease_angle: crease(),
            side,
            loaded: LoadedSurface::default(),
        };
        let (points, triangles) = super::triangles::tests::cube();
        sample.load(SurfaceMesh { points, triangles }).unwrap();
        sample
    }

    /// Cubes, whose faces and edges are exact.
    #[cfg(test)]
    pub(super) fn samples() -> Vec<Self> {
        vec![
            Self::sample(0.1, 0.4, [0.8, 0.3, -0.1], 0.7, Side::Outside),
            Self::sample(0.2, 0.0, [0.2, -0.1, -0.4], 0.8, Side::Inside),
        ]
    }

    /// A surface needs a file: there are no samples outside of the tests.
    #[cfg(not(test))]
    pub(super) fn samples() -> Vec<Self> {
        Vec::new()
    }
}

/// The solid within a closed surface, or the hollow of one: all points at the radius from it.
#[derive(Debug, Clone)]
pub struct Surface<const D: usize> {
    surface: Option<Rc<TriangleSurface>>,
    radius: f64,
    side: Side,
}

impl<const D: usize> Shape<D> for Surface<D> {
    fn proximity(&self, x: &Vector<D>) -> Proximity<D> {
        let Some(surface) = &self.surface else {
            let normal = Vector::from_fn(|i, _| f64::from(u8::from(i + 1 == D)));
            return Proximity { gap: f64::MAX, normal, hessian: Tensor::zeros() };
        };
        let x = Vector::<3>::from_fn(|i, _| x.iter().nth(i).copied().unwrap_or(0.0));
        let near = surface.nearest(&x);
        let normal = Vector::from_fn(|i, _| near.normal[i]);
        let hessian = Tensor::from_fn(|i, j| near.hessian[(i, j)]);
        Proximity { gap: near.distance - self.radius, normal, hessian }.on(self.side)
    }

    fn outline(&self) -> Outline {
        Outline::Edged
    }

    fn solid(&self) -> Option<SolidMoments<D>> {
        let surface = self.surface.as_ref().filter(|_| self.side == Side::Outside && self.radius == 0.0)?;
        let whole = surface.moments();
        let entry = |i: usize, j: usize| if i < 3 && j < 3 { whole.second[(i, j)] } else { 0.0 };
        Some(SolidMoments {
            volume: whole.volume,
            centroid: Vector::from_fn(|i, _| whole.centroid.iter().nth(i).copied().unwrap_or(0.0)),
            second: Tensor::from_fn(entry),
        })
    }

    /// The corners of the triangles. Edges that a radius rounds are left open.
    fn facets(&self, _window: &Window<D>) -> Drawing<D> {
        let mut drawing = Drawing::default();
        let Some(surface) = self.surface.as_ref().filter(|surface| !is_too_fine(surface.count())) else {
            return drawing;
        };
        /// Distance per coordinate within which corners of triangles are one point: above rounding.
        const SAME: f64 = 1e-9;
        let largest = surface.corners(self.radius).flatten().map(|x| x.amax()).fold(0.0, f64::max);
        let cell = |x: &Vector<3>| x.map(|x| (x / (SAME * largest)).round() as i64);
        let mut known = HashMap::new();
        for corners in surface.corners(self.radius) {
            let nodes = corners.map(|x| {
                let place = Vector::from_fn(|i, _| x.iter().nth(i).copied().unwrap_or(0.0));
                *known.entry(cell(&x)).or_insert_with(|| drawing.point(place))
            });
            drawing.facet(&nodes);
        }
        drawing
    }

    fn anchored(&self, _near: &Vector<D>) -> Box<dyn Shape<D>> {
        Box::new(self.clone())
    }
}
