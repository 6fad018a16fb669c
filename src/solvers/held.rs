//! Messages on free motions of a static start: a motion that loads drive, and the force that holds
//! the others.

use nalgebra::DVector;

use crate::case::Units;
use crate::dynamics::RigidMotion;

/// A motion of a body that loads drive, and the force along it.
#[derive(Debug, Clone, PartialEq)]
pub struct Driven {
    /// Body and direction.
    pub words: String,
    /// Resultant force or moment of the motion.
    pub force: f64,
    /// Unit of the resultant, a force or a moment.
    pub unit: String,
}

impl Driven {
    /// Describes the motion as the reason of a failure.
    pub fn describe(&self) -> String {
        format!("nothing resists {}, which is driven by {:.3e} {}", self.words, self.force, self.unit)
    }
}

/// The motions that were held in a converged equilibrium.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HeldMotions {
    /// Number of motions.
    pub motions: u32,
    /// Body and direction of each.
    pub words: Vec<String>,
    /// Largest force along one of the motions, relative to the largest force. If `by` is `None`, it
    /// is the force that holding would have required.
    pub force: f64,
    /// The force that held them, with body, direction and resultant where it is largest.
    pub by: Option<Driven>,
}

impl HeldMotions {
    /// Describes the held motions for the user.
    pub fn note(&self) -> String {
        let Self { motions, words, force, by } = self;
        let (s, were) = if *motions == 1 { ("", "was") } else { ("s", "were") };
        let part = format!("{force:.1e} of the largest force");
        match by {
            _ if *motions == 0 => {
                "no motion was restrained: contact resists all motions that supports leave free, and no \
                 force was needed"
                    .to_owned()
            }
            None => {
                let along = if *motions == 1 { "it" } else { "one of them" };
                format!(
                    "{motions} free motion{s} {were} restrained ({}), and no force was needed: {part} acted \
                     along {along}",
                    words.join(", ")
                )
            }
            Some(Driven { words, force, unit, .. }) => format!(
                "{motions} motion{s} that contact hardly resists {were} restrained by {part}, which \
                 friction must carry from now on: {force:.3e} {unit} against {words}"
            ),
        }
    }

    /// Describes the held motions as the reason of a failure.
    pub fn describe(&self) -> String {
        format!("a free motion would need {:.1e} of the largest force to be restrained", self.force)
    }
}

/// Returns piece, direction and resultant of a motion with coefficients `way` under the `loads`
/// along each rigid motion. If several pieces move, it describes the one that moves most.
pub fn describe(rigid: &[RigidMotion], way: &DVector<f64>, loads: &DVector<f64>, units: Units) -> Driven {
    let share = |group: usize| -> f64 {
        rigid.iter().zip(way.iter()).filter(|(motion, _)| motion.group == group).map(|(_, c)| c * c).sum()
    };
    let groups = rigid.iter().map(|motion| motion.group);
    let group = groups.max_by(|&a, &b| share(a).total_cmp(&share(b))).unwrap_or_default();
    let own =
        || rigid.iter().zip(way.iter()).zip(loads.iter()).filter(|((motion, _), _)| motion.group == group);
    let power: f64 = own().map(|((_, factor), load)| factor * load).sum();
    let parts = own().next().map_or(0, |((motion, _), _)| motion.parts.len());
    let square = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>();
    let moves = |part: usize| {
        let mut shift = [0.0; 3];
        let mut spin = [0.0; 3];
        let mut name = "";
        let (mut nodes, mut spread) = (0.0, 0.0);
        for ((motion, factor), _) in own() {
            let part = &motion.parts[part];
            for i in 0..3 {
                shift[i] += factor * part.shift[i];
                spin[i] += factor * part.spin[i];
            }
            (name, nodes, spread) = (&part.name, part.nodes, part.spread);
        }
        (name, shift, spin, [nodes * square(&shift), spread * square(&spin)])
    };
    let most = (0..parts).map(moves).max_by(|a, b| a.3.iter().sum::<f64>().total_cmp(&b.3.iter().sum()));
    let (name, shift, spin, sizes) = most.unwrap_or(("", [0.0; 3], [0.0; 3], [0.0; 2]));
    let shifts = sizes[0] >= sizes[1];
    let (vector, what) = if shifts { (shift, "motion of") } else { (spin, "rotation of") };
    let size = square(&vector).sqrt();
    let direction = direction(&vector.map(|x| x / size));
    let unit = if shifts { units.of("N") } else { units.moment() };
    let preposition = if shifts { "along" } else { "about" };
    let words = format!("the {what} {name} {preposition} {direction}");
    Driven { words, force: power / size, unit }
}

/// Names an axis, or lists the components of any other direction.
fn direction(unit: &[f64; 3]) -> String {
    const AXIS: f64 = 0.9999;
    for (i, name) in ["x", "y", "z"].into_iter().enumerate() {
        if unit[i].abs() > AXIS {
            return if unit[i] < 0.0 { format!("-{name}") } else { name.to_owned() };
        }
    }
    // Removes the sign of values that are rounded to zero.
    let [x, y, z] = unit.map(|value| (value * 1e3).round() / 1e3 + 0.0);
    format!("({x:.3}, {y:.3}, {z:.3})")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_named() {
        assert_eq!(direction(&[0.0, -1.0, 0.0]), "-y");
        assert_eq!(direction(&[0.6, 0.8, -1e-4]), "(0.600, 0.800, 0.000)");
    }

    /// The message states that no force was needed exactly when no force was needed.
    #[test]
    fn a_force_that_holds_is_told() {
        let held = |motions, force, by| {
            let words = vec!["the motion of 'ring' along x".to_owned(); motions as usize];
            HeldMotions { motions, words, force, by }.note()
        };
        assert!(held(0, 0.0, None).ends_with("no force was needed"));
        assert!(held(1, 2e-13, None).starts_with(
            "1 free motion was restrained (the motion of 'ring' along x), and no force was needed: 2.0e-13"
        ));
        let by =
            Driven { words: "the motion of 'block' along x".to_owned(), force: 3.0, unit: "N".to_owned() };
        let told = held(2, 1e-6, Some(by));
        assert!(told.ends_with("3.000e0 N against the motion of 'block' along x"), "{told}");
        assert!(!told.contains("no force"), "{told}");
    }
}
