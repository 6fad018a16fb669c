//! Rows without a closed form whose result must not depend on units: size, stiffness, density,
//! position.

use crate::row::{Results, Row, Verdict};
use crate::scenes::Drag;

/// Results of every step in units of the scene: forces, depth, energies.
fn figures(results: &Results, drag: &Drag) -> Vec<f64> {
    let force = drag.young * drag.size.powi(drag.dimension as i32 - 1);
    let contact = results.contact("sole");
    let energy = results.table("energy.csv");
    let of = |table: &crate::common::Table, column: &str, unit: f64| {
        table.numbers(column).iter().map(|value| value / unit).collect::<Vec<_>>()
    };
    let mut all = of(&contact, "force_n", force);
    all.extend(of(&contact, "force_x", force).into_iter().skip(1));
    all.extend(of(&contact, "max_penetration", drag.size));
    all.extend(of(&energy, "strain", force * drag.size));
    all.extend(of(&energy, "kinetic", force * drag.size).into_iter().skip(1));
    all
}

fn compared(group: &'static str, name: impl Into<String>, base: Drag, drag: Drag, tolerance: f64) -> Row {
    Row::new(group, name, vec![base.case(), drag.case()], move |results| {
        Verdict::same(&figures(&results[1], &drag), &figures(&results[0], &base), tolerance)
    })
}

/// All rows of this file.
pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for (scene, base) in [
        ("on a plane", Drag::BASE),
        ("on a block", Drag { onto_block: true, ..Drag::BASE }),
        ("on a block in space", Drag { onto_block: true, dimension: 3, ..Drag::BASE }),
    ] {
        let flat = base.dimension == 2;
        for size in [1e-9, 1e-6, 1e-3, 1e3, 1e6] {
            let row = compared("size [m]", format!("{size:.0e}, {scene}"), base, Drag { size, ..base }, 1e-8);
            rows.push(if flat && size == 1e-9 { row.quick() } else { row });
        }
        for young in [1e2, 1e12] {
            let name = format!("{young:.0e}, dragged {scene}");
            rows.push(compared("stiffness [Pa]", name, base, Drag { young, ..base }, 1e-8));
        }
        for density in [1e-6, 1e-3, 1e3, 1e6] {
            let name = format!("{density:.0e}, {scene}");
            let row = compared("density [kg/m3]", name, base, Drag { density, ..base }, 1e-8);
            rows.push(if base.onto_block && flat && density == 1e6 { row.quick() } else { row });
        }
        for (name, length, force, time) in [
            ("mm-t-s", 1e3, 1.0, 1.0),
            ("kN-m", 1.0, 1e-3, 1.0),
            ("in-lbf-s", 1.0 / 0.0254, 0.224_808_943, 1.0),
        ] {
            let area = length * length;
            let drag = Drag {
                size: base.size * length,
                young: base.young * force / area,
                // Mass is force by time squared over length.
                density: base.density * force * time * time / (area * area),
                ..base
            };
            let row = compared("units", format!("{name}, {scene}"), base, drag, 1e-8);
            rows.push(if flat { row.quick() } else { row });
        }
        for away in [1e3, 1e6] {
            // Depths of 1e-5 m on coordinates of 1e6 m: five digits.
            let drag = Drag { origin: [away + 0.01, -away], tolerance: 1e-9, ..base };
            let tolerance = 1e3 * away * f64::EPSILON / 1e-5;
            let row = compared("far away [m]", format!("{away:.0e}, dragged {scene}"), base, drag, tolerance);
            rows.push(if flat && base.onto_block && away == 1e6 { row.quick() } else { row });
        }
    }
    rows
}
