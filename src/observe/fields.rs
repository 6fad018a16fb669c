//! Fields of `fields.pvd` and `contact.pvd`. One entry of a table is one field.

use super::nodal::{NodalMean, NodalSums, NodalValue};
use super::nodal_stress::NodalStress;
use super::quantity::{QuantityShape, ReportedQuantity};
use crate::assembly::ContactSystem;
use crate::contact::point::Status;
use crate::dynamics::Stage;
use crate::element::{Cauchy, ElementStress};
use crate::error::Result;
use crate::petsc::Vector;

/// What a value belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Location {
    /// The nodes of the rank.
    Nodes,
    /// The nodes of the rank, with one value for each material of the body that has most of them.
    NodesByMaterial,
    /// The elements of the rank.
    Elements,
}

/// The values of a field on this rank, node by node or element by element.
#[derive(Debug, Clone, PartialEq)]
pub enum FieldValues {
    /// Numbers, with as many per node or element as the quantity has components.
    Numbers(Vec<f64>),
    /// Small codes.
    Codes(Vec<u8>),
}

/// A field on this rank.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Name, unit and meaning.
    pub quantity: ReportedQuantity,
    /// What its values belong to.
    pub location: Location,
    /// The values.
    pub values: FieldValues,
}

/// A field of the unknowns at nodes.
#[derive(Debug, Clone, Copy)]
pub struct NodeField {
    /// Name, unit and meaning.
    pub quantity: ReportedQuantity,
    /// Whether it exists in dynamics only.
    pub dynamics_only: bool,
    /// Whether it is also on the contact surfaces.
    pub on_surfaces: bool,
    /// The values.
    pub value: fn(&Stage) -> &Vector,
}

/// Fields of the unknowns at nodes.
pub const NODE_FIELDS: &[NodeField] = &[
    NodeField {
        quantity: ReportedQuantity::vector(
            "displacement",
            "m",
            "displacement, by which ParaView warps the bodies",
        ),
        dynamics_only: false,
        on_surfaces: true,
        value: |stage| &stage.trial.u,
    },
    NodeField {
        quantity: ReportedQuantity::vector("velocity", "m/s", "velocity; in dynamics only"),
        dynamics_only: true,
        on_surfaces: false,
        value: |stage| &stage.trial.v,
    },
];

/// The value of a field of elements.
#[derive(Debug, Clone, Copy)]
pub enum ElementValue {
    /// A number.
    Number(fn(&ElementStress) -> f64),
    /// A symmetric tensor: xx, yy, zz, xy, yz, xz.
    SymmetricTensor(fn(&ElementStress) -> [f64; 6]),
    /// Principal values.
    Principal(fn(&ElementStress) -> [f64; 3]),
}

impl ElementValue {
    /// Number of numbers per element.
    fn width(&self) -> usize {
        match self {
            Self::Number(_) => 1,
            Self::SymmetricTensor(_) => 6,
            Self::Principal(_) => 3,
        }
    }

    fn write(&self, stress: &ElementStress, out: &mut [f64]) {
        match self {
            Self::Number(value) => out[0] = value(stress),
            Self::SymmetricTensor(value) => out.copy_from_slice(&value(stress)),
            Self::Principal(value) => out.copy_from_slice(&value(stress)),
        }
    }
}

/// A field of elements.
#[derive(Debug, Clone, Copy)]
pub struct ElementField {
    /// Name, unit and meaning.
    pub quantity: ReportedQuantity,
    /// The value.
    pub value: ElementValue,
}

/// Fields of elements.
pub const ELEMENT_FIELDS: &[ElementField] = &[
    ElementField {
        quantity: ReportedQuantity::symmetric_tensor(
            "cauchy_stress",
            "Pa",
            "mean Cauchy stress: xx, yy, zz, xy, yz, xz; in 2D zz is the stress across the plane",
        ),
        value: ElementValue::SymmetricTensor(|stress| stress.mean.cauchy.0),
    },
    ElementField {
        quantity: ReportedQuantity::number("det_f", "", "mean volume ratio"),
        value: ElementValue::Number(|stress| stress.mean.det_f),
    },
];

/// Fields of elements with `output: { fields: { stresses: true } }`.
pub const STRESS_FIELDS: &[ElementField] = &[
    ElementField {
        quantity: ReportedQuantity::number("von_mises", "Pa", "von Mises stress of the mean Cauchy stress"),
        value: ElementValue::Number(|stress| stress.mean.cauchy.von_mises()),
    },
    ElementField {
        quantity: ReportedQuantity::number(
            "pressure",
            "Pa",
            "minus a third of the trace of the mean Cauchy stress, positive in compression",
        ),
        value: ElementValue::Number(|stress| stress.mean.cauchy.pressure()),
    },
    ElementField {
        quantity: ReportedQuantity::principal(
            "principal_stress",
            "Pa",
            "principal values of the mean Cauchy stress, the largest first, tension positive; in 2D one of \
             them is across the plane",
        ),
        value: ElementValue::Principal(|stress| stress.mean.cauchy.principal()),
    },
    ElementField {
        quantity: ReportedQuantity::principal(
            "principal_stretch",
            "",
            "principal stretches, the largest first: square roots of the principal values of the mean right \
             Cauchy-Green tensor; at small strain 1 plus the principal strains",
        ),
        value: ElementValue::Principal(ElementStress::principal_stretches),
    },
];

/// The value of a field of stress at nodes.
#[derive(Debug, Clone, Copy)]
pub enum NodalStressValue {
    /// A number.
    Number(fn(&Cauchy) -> f64),
    /// The tensor.
    Tensor,
}

/// A field of stress at nodes.
#[derive(Debug, Clone, Copy)]
pub struct NodalStressField {
    /// Name, unit and meaning.
    pub quantity: ReportedQuantity,
    /// The value.
    pub value: NodalStressValue,
}

/// Fields of nodes with `output: { fields: { stresses: true } }`.
pub const NODAL_STRESS_FIELDS: &[NodalStressField] = &[
    NodalStressField {
        quantity: ReportedQuantity::symmetric_tensor(
            "nodal_stress",
            "Pa",
            "Cauchy stress: linear fits of the elements around the node, averaged by volume within the material",
        ),
        value: NodalStressValue::Tensor,
    },
    NodalStressField {
        quantity: ReportedQuantity::number("nodal_von_mises", "Pa", "von Mises stress of `nodal_stress`"),
        value: NodalStressValue::Number(Cauchy::von_mises),
    },
];

/// How the values of several contacts at one node are combined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OverContacts {
    /// Their sum.
    Sum,
    /// The smallest.
    Smallest,
    /// The largest.
    Largest,
    /// That of the last contact that is closed, or else of the first one.
    LastClosed,
}

impl OverContacts {
    /// The value after one more contact; `before` is `None` if it is the first.
    fn combine(self, before: Option<f64>, now: f64, is_closed: bool) -> f64 {
        let Some(before) = before else {
            // Largest values and sums start at zero.
            return match self {
                Self::Sum => 0.0 + now,
                Self::Largest => now.max(0.0),
                Self::Smallest | Self::LastClosed => now,
            };
        };
        match self {
            Self::Sum => before + now,
            Self::Smallest => before.min(now),
            Self::Largest => before.max(now),
            Self::LastClosed => {
                if is_closed {
                    now
                } else {
                    before
                }
            }
        }
    }
}

/// A field of the contact surfaces.
#[derive(Debug, Clone, Copy)]
pub struct ContactField<const D: usize> {
    /// Name, unit and meaning.
    pub quantity: ReportedQuantity,
    /// The value in one contact.
    pub value: NodalValue<D>,
    /// How several contacts at one node are combined.
    pub over_contacts: OverContacts,
}

impl<const D: usize> ContactField<D> {
    /// Fields of the contact surfaces.
    pub const TABLE: &'static [Self] = &[
        Self {
            quantity: ReportedQuantity::number(
                "contact_pressure",
                "Pa",
                "normal traction, positive in compression",
            ),
            value: NodalValue::PRESSURE,
            over_contacts: OverContacts::Sum,
        },
        Self {
            quantity: ReportedQuantity::vector(
                "traction_t",
                "Pa",
                "traction of friction and tangential damping on the contactor",
            ),
            value: NodalValue::MeanVector(|point| point.state.tangential_traction()),
            over_contacts: OverContacts::Sum,
        },
        Self {
            quantity: ReportedQuantity::number(
                "gap",
                "m",
                "gap, positive where open; between bodies up to a quarter of the largest facet",
            ),
            value: NodalValue::GAP,
            over_contacts: OverContacts::Smallest,
        },
        Self {
            quantity: ReportedQuantity::number("slip", "m", "length of the path slipped so far"),
            value: NodalValue::Mean(|point| point.history.slip),
            over_contacts: OverContacts::Largest,
        },
        Self {
            quantity: ReportedQuantity::vector(
                "slip_velocity",
                "m/s",
                "velocity of the contactor against the target, along the surface",
            ),
            value: NodalValue::MeanVector(|point| point.state.slip_velocity),
            over_contacts: OverContacts::LastClosed,
        },
        Self {
            quantity: ReportedQuantity::number("status", "", "0 open, 1 stick, 2 slip"),
            value: NodalValue::Status,
            over_contacts: OverContacts::Largest,
        },
        Self {
            quantity: ReportedQuantity::number("friction_work", "J/m2", "work of friction per area so far"),
            value: NodalValue::Mean(|point| point.history.friction_work),
            over_contacts: OverContacts::Sum,
        },
    ];

    /// Number of numbers per node.
    fn width(&self) -> usize {
        if self.quantity.components == QuantityShape::Axes { D } else { 1 }
    }

    /// The field from its numbers at all nodes.
    fn field(&self, numbers: Vec<f64>) -> Field {
        let values = match self.value {
            NodalValue::Status => FieldValues::Codes(numbers.iter().map(|code| *code as u8).collect()),
            _ => FieldValues::Numbers(numbers),
        };
        Field { quantity: self.quantity, location: Location::Nodes, values }
    }
}

/// Facets of all contactors of a rank as cells.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceCells {
    /// Start of each facet in `nodes`, with one entry more than facets.
    pub offsets: Vec<u32>,
    /// Local nodes.
    pub nodes: Vec<u32>,
    /// VTK cell type of each facet.
    pub vtk_types: Vec<u8>,
    /// Index of the contact.
    pub contact: Vec<u16>,
}

/// The facets of the contactors.
pub fn surface_cells<const D: usize>(system: &ContactSystem<D>) -> SurfaceCells {
    let mut cells = SurfaceCells { offsets: vec![0], ..SurfaceCells::default() };
    for (number, contact) in system.contacts().iter().enumerate() {
        let surface = contact.surface();
        for facet in surface.facets() {
            cells.nodes.extend_from_slice(surface.facet_nodes(facet));
            cells.offsets.push(cells.nodes.len() as u32);
            cells.vtk_types.push(facet.kind.vtk_type());
            cells.contact.push(number as u16);
        }
    }
    cells
}

/// Fields of the bodies at the trial state, with those of `stresses` if they are wanted. Collective.
///
/// # Errors
/// If a PETSc call fails.
pub fn body_fields<const D: usize>(
    system: &ContactSystem<D>,
    stage: &Stage,
    stresses: bool,
) -> Result<Vec<Field>> {
    let present = NODE_FIELDS.iter().filter(|field| system.bodies().is_dynamic() || !field.dynamics_only);
    let mut fields: Vec<Field> = present.map(|field| of_unknowns(field, stage)).collect();
    let elements = system.bodies().local().mesh.element_count();
    let wanted = if stresses { STRESS_FIELDS } else { &[] };
    let of_elements: Vec<&ElementField> = ELEMENT_FIELDS.iter().chain(wanted).collect();
    let mut values: Vec<Vec<f64>> =
        of_elements.iter().map(|field| vec![0.0; field.value.width() * elements]).collect();
    let mut at_nodes = if stresses { Some(NodalStress::new(system)?) } else { None };
    system.bodies().element_stress(stage, |element, stress| {
        for (field, values) in of_elements.iter().zip(&mut values) {
            let width = field.value.width();
            field.value.write(stress, &mut values[width * element..][..width]);
        }
        at_nodes.iter_mut().for_each(|nodes| nodes.add(system, element, stress));
    });
    fields.extend(of_elements.iter().zip(values).map(|(field, values)| Field {
        quantity: field.quantity,
        location: Location::Elements,
        values: FieldValues::Numbers(values),
    }));
    if let Some(nodes) = at_nodes {
        fields.extend(of_nodal_stress(nodes)?);
    }
    Ok(fields)
}

/// Fields of the stress at the local nodes, including ghosts. Collective.
fn of_nodal_stress(stress: NodalStress) -> Result<Vec<Field>> {
    let means = stress.means()?;
    let field = |field: &NodalStressField| {
        let numbers = match field.value {
            NodalStressValue::Number(value) => means.iter().map(value).collect(),
            NodalStressValue::Tensor => means.iter().flat_map(|mean| mean.0).collect(),
        };
        Field {
            quantity: field.quantity,
            location: Location::NodesByMaterial,
            values: FieldValues::Numbers(numbers),
        }
    };
    Ok(NODAL_STRESS_FIELDS.iter().map(field).collect())
}

fn of_unknowns(field: &NodeField, stage: &Stage) -> Field {
    let values = FieldValues::Numbers((field.value)(stage).local().to_vec());
    Field { quantity: field.quantity, location: Location::Nodes, values }
}

/// Fields of the contact surfaces at the local nodes, including ghosts. Collective.
///
/// Values at nodes that are not on a contactor are zero.
///
/// # Errors
/// If a PETSc call fails.
pub fn surface_fields<const D: usize>(system: &ContactSystem<D>, stage: &Stage) -> Result<Vec<Field>> {
    let shown = NODE_FIELDS.iter().filter(|field| field.on_surfaces);
    let mut fields: Vec<Field> = shown.map(|field| of_unknowns(field, stage)).collect();
    let table = ContactField::<D>::TABLE;
    let width: usize = table.iter().map(ContactField::width).sum();
    let index = &system.bodies().local().index;
    let mut gathered = Vector::ghosted(system.session(), index.owned, width, &index.ghosts)?;
    let mut is_known = vec![false; index.owned];
    for contact in system.contacts() {
        let values = std::iter::once(NodalValue::Status).chain(table.iter().map(|field| field.value));
        let sums = NodalSums::gather(system, contact, &stage.trial.u.local(), values.collect())?;
        let mut rows = gathered.owned_mut();
        for (node, (row, is_known)) in rows.chunks_exact_mut(width).zip(&mut is_known).enumerate() {
            let Some(means) = sums.at(node as u32) else { continue };
            let mut means = means.into_iter();
            let is_closed = means.next() != Some(NodalMean::Status(Status::Open));
            let values = table.iter().zip(means).flat_map(|(field, mean)| {
                mean.numbers().into_iter().map(|number| (field.over_contacts, number))
            });
            for (value, (rule, number)) in row.iter_mut().zip(values) {
                *value = rule.combine(is_known.then_some(*value), number, is_closed);
            }
            *is_known = true;
        }
    }
    gathered.update_ghosts()?;
    let rows = gathered.local();
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); table.len()];
    for row in rows.chunks_exact(width) {
        let mut rest = row;
        for (field, column) in table.iter().zip(&mut columns) {
            let (own, others) = rest.split_at(field.width());
            column.extend_from_slice(own);
            rest = others;
        }
    }
    fields.extend(table.iter().zip(columns).map(|(field, numbers)| field.field(numbers)));
    Ok(fields)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of several contacts at one node are combined by the rule of their field.
    #[test]
    fn contacts_at_one_node_are_combined() {
        let all = |rule: OverContacts| {
            let first = rule.combine(None, 2.0, false);
            let second = rule.combine(Some(first), 5.0, true);
            rule.combine(Some(second), 3.0, false)
        };
        assert_eq!(all(OverContacts::Sum), 10.0);
        assert_eq!(all(OverContacts::Smallest), 2.0);
        assert_eq!(all(OverContacts::Largest), 5.0);
        assert_eq!(all(OverContacts::LastClosed), 5.0);
    }

    /// The components that a field declares are those of its values.
    #[test]
    fn components_fit_the_values() {
        for field in ContactField::<3>::TABLE {
            let is_vector = matches!(field.value, NodalValue::MeanVector(_));
            assert_eq!(field.width() == 3, is_vector, "{}", field.quantity.name);
        }
        for field in ELEMENT_FIELDS.iter().chain(STRESS_FIELDS) {
            let width = match field.quantity.components {
                QuantityShape::One => 1,
                QuantityShape::SymmetricTensor => 6,
                other => other.axes::<2>().len(),
            };
            assert_eq!(field.value.width(), width, "{}", field.quantity.name);
        }
        for field in NODAL_STRESS_FIELDS {
            let is_tensor = matches!(field.value, NodalStressValue::Tensor);
            assert_eq!(field.quantity.components == QuantityShape::SymmetricTensor, is_tensor);
        }
    }
}
