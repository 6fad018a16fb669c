//! Laws in axisymmetry (theory, section 3.20).
//!
//! A displacement in the meridian plane that does not depend on the angle has the displacement gradient `H` in that
//! plane and the stretch `1 + u_r / R` around the axis. A law in space takes both. Its stress has four components, `11, 22,
//! 12` in the plane and `33` around the axis.
//!
//! Kernels see all laws as one type, [`Axisymmetric`], and are compiled once for them.

use super::plane_stress::unit_strain;
use super::{
    Hooke, IsotropicLaw, Law, LawPart, LawTask, Material, MetricLaw, MetricTangent, Moduli, Part,
    PointEnergy, PointLaw, Response,
};
use crate::composed::LaneWise;
use crate::lanes::{Lane, LaneKind, LaneTask, Pack, Real};
use crate::square::{Square, diagonal};

/// Components of a symmetric tensor: `11, 22, 12, 33`.
pub const HOOP_COMPONENTS: usize = 4;

/// The displacement gradient of an axisymmetric displacement.
#[derive(Debug, Clone, Copy)]
pub struct HoopGradient<T, const D: usize> {
    /// In the meridian plane; row = component, column = reference direction.
    pub plane: Square<T, D>,
    /// `u_r / R` around the axis.
    pub hoop: T,
}

impl<T: Real, const D: usize> HoopGradient<T, D> {
    /// The gradient in space, with the direction around the axis as the third one.
    #[inline(always)]
    pub fn in_space(&self) -> Square<T, 3> {
        let zero = self.hoop.constant(0.0);
        let mut out = [[zero; 3]; 3];
        for i in 0..2 {
            for j in 0..2 {
                out[i][j] = self.plane[i][j];
            }
        }
        out[2][2] = self.hoop;
        out
    }
}

/// Stress and tangent at one point.
#[derive(Debug, Clone, Copy)]
pub struct HoopResponse<T> {
    /// Second Piola stress \[Pa\].
    pub stress: [T; HOOP_COMPONENTS],
    /// Its derivatives by `E_11`, `E_22`, `2 E_12` and `E_33` \[Pa\].
    pub tangent: [[T; HOOP_COMPONENTS]; HOOP_COMPONENTS],
}

/// Quantities of a law that can be evaluated.
#[derive(Debug, Clone, Copy)]
enum Wanted {
    /// The energy.
    Energy,
    /// Margin to the limit of the law.
    Reserve,
    /// The stress.
    Stress,
    /// Stress and tangent.
    Tangent,
}

/// Results at four states. Everything that was not wanted is zero.
#[derive(Debug, Clone, Copy, Default)]
struct PackedResponse {
    /// The energy \[Pa\], or the margin to the limit.
    value: Pack,
    stress: [Pack; HOOP_COMPONENTS],
    tangent: [[Pack; HOOP_COMPONENTS]; HOOP_COMPONENTS],
}

/// Gradients in space of four states.
type PackedGradient = [[Pack; 3]; 3];

/// A law in space of any type.
trait SpaceLaw {
    /// Evaluates it in lanes of that kind.
    fn evaluate(&self, kind: LaneKind, wanted: Wanted, at: &PackedGradient) -> PackedResponse;

    /// Whether the law ends at some stretch.
    fn is_limited(&self) -> bool;
}

/// A part of a law for axisymmetric displacements.
pub struct Axisymmetric(Box<dyn SpaceLaw>);

impl Axisymmetric {
    /// A part of this law.
    pub fn new(material: &Material, part: Part) -> Self {
        material.accept(ForAxis(part))
    }

    /// A part of Hooke's law in linear kinematics.
    pub fn linear(moduli: &Moduli<f64>, part: Part) -> Self {
        Self(Box::new(Linear(moduli.part(part))))
    }

    /// [`Potential::energy`](super::Potential::energy).
    #[inline(always)]
    pub fn energy<T: LaneWise, const D: usize>(&self, at: &HoopGradient<T, D>) -> T {
        at.hoop.unpack(&self.evaluate(Wanted::Energy, at).value)
    }

    /// [`Law::reserve`].
    #[inline(always)]
    pub fn reserve<T: LaneWise, const D: usize>(&self, at: &HoopGradient<T, D>) -> Option<T> {
        self.0.is_limited().then(|| at.hoop.unpack(&self.evaluate(Wanted::Reserve, at).value))
    }

    /// The second Piola stress \[Pa\].
    #[inline(always)]
    pub fn stress<T: LaneWise, const D: usize>(&self, at: &HoopGradient<T, D>) -> [T; HOOP_COMPONENTS] {
        let found = self.evaluate(Wanted::Stress, at);
        let mut stress = [at.hoop; HOOP_COMPONENTS];
        for m in 0..HOOP_COMPONENTS {
            stress[m] = at.hoop.unpack(&found.stress[m]);
        }
        stress
    }

    /// Stress and tangent.
    #[inline(always)]
    pub fn respond<T: LaneWise, const D: usize>(&self, at: &HoopGradient<T, D>) -> HoopResponse<T> {
        let found = self.evaluate(Wanted::Tangent, at);
        let unit = at.hoop;
        let mut out = HoopResponse {
            stress: [unit; HOOP_COMPONENTS],
            tangent: [[unit; HOOP_COMPONENTS]; HOOP_COMPONENTS],
        };
        for m in 0..HOOP_COMPONENTS {
            out.stress[m] = unit.unpack(&found.stress[m]);
            for n in 0..HOOP_COMPONENTS {
                out.tangent[m][n] = unit.unpack(&found.tangent[m][n]);
            }
        }
        out
    }

    #[inline(always)]
    fn evaluate<T: LaneWise, const D: usize>(
        &self,
        wanted: Wanted,
        at: &HoopGradient<T, D>,
    ) -> PackedResponse {
        let grad_u = at.in_space();
        let mut packed = PackedGradient::default();
        for i in 0..3 {
            for j in 0..3 {
                packed[i][j] = grad_u[i][j].pack();
            }
        }
        self.0.evaluate(at.hoop.kind(), wanted, &packed)
    }
}

/// Takes a part of a law.
struct ForAxis(Part);

impl LawTask for ForAxis {
    type Output = Axisymmetric;

    fn run<P: Law>(self, law: &P) -> Axisymmetric {
        Axisymmetric(Box::new(Finite(Box::new(LawPart::<P>(law.constants(self.0))))))
    }

    fn run_isotropic<P: IsotropicLaw>(self, law: &P) -> Axisymmetric {
        Axisymmetric(Box::new(Finite(law.energy_of_part(self.0))))
    }
}

/// A law of finite kinematics.
struct Finite<K: ?Sized>(Box<K>);

/// Hooke's law with these moduli.
struct Linear(Moduli<f64>);

impl<K: PointLaw + ?Sized> SpaceLaw for Finite<K> {
    fn evaluate(&self, kind: LaneKind, wanted: Wanted, at: &PackedGradient) -> PackedResponse {
        let mut out = PackedResponse::default();
        kind.run(FiniteTask { law: &*self.0, wanted, at, out: &mut out });
        out
    }

    fn is_limited(&self) -> bool {
        let rest = [[0.0; 3]; 3];
        self.0.reserve(&rest, &rest).is_some()
    }
}

impl SpaceLaw for Linear {
    fn evaluate(&self, kind: LaneKind, wanted: Wanted, at: &PackedGradient) -> PackedResponse {
        let mut out = PackedResponse::default();
        kind.run(LinearTask { moduli: &self.0, wanted, at, out: &mut out });
        out
    }

    fn is_limited(&self) -> bool {
        false
    }
}

/// An evaluation of a law of finite kinematics in lanes of any kind.
struct FiniteTask<'a, K: ?Sized> {
    law: &'a K,
    wanted: Wanted,
    at: &'a PackedGradient,
    out: &'a mut PackedResponse,
}

impl<K: PointLaw + ?Sized> LaneTask for FiniteTask<'_, K> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) {
        let Self { law, wanted, at, out } = self;
        let grad_u = load(unit, at);
        match wanted {
            Wanted::Energy => out.value = law.energy(&grad_u).lanes(),
            Wanted::Reserve => {
                if let Some(reserve) = law.reserve(&grad_u, &grad_u) {
                    out.value = reserve.lanes();
                }
            }
            Wanted::Stress => out.set_stress(&law.stress(&grad_u)),
            Wanted::Tangent => {
                let Response { second_piola, tangent } = law.respond(&grad_u);
                out.set_stress(&second_piola);
                for n in 0..HOOP_COMPONENTS {
                    out.set_column(n, &K::contract(&tangent, &unit_strain(unit, n)));
                }
            }
        }
    }
}

/// An evaluation of Hooke's law in lanes of any kind.
struct LinearTask<'a> {
    moduli: &'a Moduli<f64>,
    wanted: Wanted,
    at: &'a PackedGradient,
    out: &'a mut PackedResponse,
}

impl LaneTask for LinearTask<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(self, unit: L) {
        let Self { moduli, wanted, at, out } = self;
        let grad_u = load(unit, at);
        match wanted {
            Wanted::Energy => out.value = LawPart::<Hooke>(*moduli).energy(&grad_u).lanes(),
            Wanted::Reserve => {}
            Wanted::Stress | Wanted::Tangent => {
                let response = Hooke::respond_with_metric(&moduli.in_lanes(unit), &grad_u);
                out.set_stress(&response.second_piola);
                let tangent = MetricTangent::new(diagonal(unit), response.lam, response.q);
                for n in 0..HOOP_COMPONENTS {
                    out.set_column(n, &tangent.contract(&unit_strain(unit, n)));
                }
            }
        }
    }
}

impl PackedResponse {
    #[inline(always)]
    fn set_stress<L: Lane>(&mut self, stress: &Square<L, 3>) {
        let stress = components(stress);
        for m in 0..HOOP_COMPONENTS {
            self.stress[m] = stress[m].lanes();
        }
    }

    /// Sets the change of the stress with one component of the strain.
    #[inline(always)]
    fn set_column<L: Lane>(&mut self, column: usize, change: &Square<L, 3>) {
        let change = components(change);
        for m in 0..HOOP_COMPONENTS {
            self.tangent[m][column] = change[m].lanes();
        }
    }
}

/// `11, 22, 12, 33` of a symmetric tensor.
#[inline(always)]
fn components<T: Copy>(a: &Square<T, 3>) -> [T; HOOP_COMPONENTS] {
    [a[0][0], a[1][1], a[0][1], a[2][2]]
}

#[inline(always)]
fn load<L: Lane>(unit: L, packed: &PackedGradient) -> Square<L, 3> {
    let mut out = [[unit.constant(0.0); 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            out[i][j] = unit.load(packed[i][j]);
        }
    }
    out
}
