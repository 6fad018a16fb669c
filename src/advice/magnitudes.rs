//! Detects implausible magnitudes. Their usual cause is a wrong unit, such as `mPa` for `MPa`.

use std::ops::RangeInclusive;

use crate::assembly::{ContactSystem, LocalContact};
use crate::model::Model;

/// Plausible speeds of pressure waves \[m/s\], from the softest gels to beyond diamond.
const WAVE_SPEEDS: RangeInclusive<f64> = 0.1..=3e4;

/// Plausible ratios of contact stiffness to the stiffness of the elements beneath, from cushions to
/// what rounding still resolves.
const STIFFNESSES: RangeInclusive<f64> = 1e-4..=1e6;

/// Hint for numbers that are consistent in mm, t and s.
const TONNES: &str = " For a case in mm, t, s write `units: { length: mm, mass: t, time: s }`";

/// A remark for each implausible number.
pub fn remarks<const D: usize>(system: &ContactSystem<D>, model: &Model<D>) -> Vec<String> {
    let is_dynamic = system.bodies().is_dynamic();
    let materials =
        model.bodies.iter().flat_map(|body| body.materials.iter().map(move |material| (body, material)));
    let heavy = materials.filter(|(_, material)| is_dynamic && material.formulation.density > 0.0);
    let waves = heavy.filter_map(|(body, material)| {
        let formulation = &material.formulation;
        let speed = (material.wave_modulus() / formulation.density).sqrt();
        let in_si = speed * model.units.si_value("m/s");
        let name = body.material_name(material);
        (!WAVE_SPEEDS.contains(&in_si)).then(|| {
            let unit = model.units.of("m/s");
            let in_mm = model.units.is_si() && WAVE_SPEEDS.contains(&(1e-3 * speed));
            let cure = if in_mm { TONNES } else { "" };
            format!(
                "pressure waves in '{name}' have a speed of {speed:.1e} {unit}: check the units of its \
                 moduli and density.{cure}"
            )
        })
    });
    let stiffnesses = system.contacts().iter().map(|contact| (contact, contact.relative_stiffness()));
    let far_off = stiffnesses.filter(|(_, ratio)| !STIFFNESSES.contains(ratio));
    let contacts = far_off.map(|(LocalContact { name, .. }, ratio)| {
        format!(
            "contact '{name}' is {ratio:.1e} times as stiff as the elements beneath it: check the units of \
             its normal law and of the moduli"
        )
    });
    waves.chain(contacts).collect()
}
