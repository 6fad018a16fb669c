//! ILU(0) on the rank's rows and some layers of its neighbours' rows around them: restricted
//! additive Schwarz.
//!
//! Two properties determine how many more iterations this takes than ILU(0) of the whole matrix:
//!
//! - The order of elimination. All ranks eliminate in one order of all nodes, independent of
//!   ownership. If the neighbours' nodes came before or after the rank's own ones, a front would
//!   run along the border. ILU would drop most entries there, and a wider overlap would gain
//!   nothing.
//! - The overlap. It grows while a further layer costs less than it saves.

use std::rc::Rc;

use mpi::collective::SystemOperation;

use super::incomplete::{FactorPattern, Incomplete};
use crate::collective::Collective;
use crate::error::Result;
use crate::partition::IndexMap;
use crate::partition::exchange::NodeExchange;
use crate::petsc::{BlockPattern, Event, Matrix, Session, Vector};

/// Rows that each layer may add, relative to those of its rank. The first layer is always added.
///
/// The second layer saves a tenth of the iterations and the third a fiftieth (five matrices of the
/// rubber block, 128 by 128, in two parts).
const LAYERS: [f64; 3] = [f64::INFINITY, 0.1, 0.025];

/// The preconditioner, for blocks of any size.
pub(super) struct Subdomain {
    session: Rc<Session>,
    pattern: Rc<BlockPattern>,
    factors: Box<dyn Factors>,
    renewal: Event,
}

/// Operations of the preconditioner for blocks of one size.
trait Factors {
    fn renew(&mut self, session: &Session, matrix: &Matrix) -> Result<()>;
    fn solve(&mut self, session: &Session, r: &Vector, z: &mut Vector);
}

impl Subdomain {
    /// Creates a preconditioner for matrices with the pattern of `matrix`. [Renew](Self::renew) it
    /// before use. Collective.
    ///
    /// # Errors
    /// If the pattern names a node that does not exist.
    pub fn new(session: &Rc<Session>, matrix: &Matrix) -> Result<Self> {
        let pattern = Rc::clone(matrix.pattern());
        let grown = Grown::new(session, &pattern, &LAYERS)?;
        let factors: Box<dyn Factors> = match matrix.block_size() {
            1 => Box::new(Overlapping::<1>::new(&pattern, grown)),
            2 => Box::new(Overlapping::<2>::new(&pattern, grown)),
            _ => Box::new(Overlapping::<3>::new(&pattern, grown)),
        };
        let renewal = Event::register(session, "SubdomainILU")?;
        Ok(Self { session: Rc::clone(session), pattern, factors, renewal })
    }

    /// Whether it was made for matrices of this pattern.
    pub fn fits(&self, matrix: &Matrix) -> bool {
        Rc::ptr_eq(&self.pattern, matrix.pattern())
    }

    /// Computes new factors. Collective.
    ///
    /// # Errors
    /// If PETSc does not provide its arrays.
    pub fn renew(&mut self, matrix: &Matrix) -> Result<()> {
        let _running = self.renewal.begin();
        self.factors.renew(&self.session, matrix)
    }

    /// Computes `z`, an approximation of `matrix^-1 r`. Collective.
    pub fn apply(&mut self, r: &Vector, z: &mut Vector) {
        self.factors.solve(&self.session, r, z);
    }
}

/// The neighbours' nodes of a subdomain with their rows, and the ranks that send them.
struct Grown {
    /// Global numbers, in ascending order.
    pub ghosts: Vec<i32>,
    /// Exchange of values of the ghosts.
    pub exchange: NodeExchange,
    /// Largest number of blocks in a row, on any rank.
    width: usize,
    /// For each ghost: its position in the order, the number of its columns, the columns, and
    /// padding up to `width` of them.
    rows: Vec<f64>,
}

impl Grown {
    /// Number of values that precede the columns of a row in a message.
    const HEAD: usize = 2;

    /// The nodes of the layers around the rank's own ones. Each layer may add the given number of
    /// nodes, relative to those of its rank; the first one that adds more on any rank ends the
    /// growth. Collective.
    ///
    /// # Errors
    /// If the pattern names a node that does not exist.
    pub fn new(session: &Session, pattern: &BlockPattern, layers: &[f64]) -> Result<Self> {
        let world = session.world();
        let longest = (0..pattern.rows()).map(|row| pattern.row(row).len() as u64).max().unwrap_or(0);
        let (mut width, mut total) = (0, 0);
        world.reduce_all(&longest, &mut width, SystemOperation::max());
        world.reduce_all(&(pattern.rows() as i32), &mut total, SystemOperation::sum());
        let index = IndexMap { first: pattern.first_row, owned: pattern.rows(), ghosts: Vec::new(), total };
        let mut ghosts = Vec::new();
        let mut further = outside(pattern, pattern.columns.iter().copied(), &ghosts);
        for allowed in layers {
            let costs = further.len() as f64 > allowed * pattern.rows() as f64;
            let mut too_much = 0u8;
            world.reduce_all(&u8::from(costs), &mut too_much, SystemOperation::max());
            if too_much > 0 {
                break;
            }
            ghosts.append(&mut further);
            ghosts.sort_unstable();
            let rows = Self::ask(session, pattern, &index, ghosts.clone(), width as usize)?;
            further = outside(pattern, (0..ghosts.len()).flat_map(|ghost| rows.columns(ghost)), &ghosts);
        }
        Self::ask(session, pattern, &index, ghosts, width as usize)
    }

    /// Requests the rows of these nodes from their owners. Collective.
    fn ask(
        session: &Session,
        pattern: &BlockPattern,
        index: &IndexMap,
        ghosts: Vec<i32>,
        width: usize,
    ) -> Result<Self> {
        let mut exchange = NodeExchange::new(session.world(), index, &ghosts)?;
        let mut rows = vec![0.0; ghosts.len() * (Self::HEAD + width)];
        let give = |node: u32, out: &mut [f64]| {
            let columns = &pattern.columns[pattern.row(node as usize)];
            let head = [f64::from(pattern.places[node as usize]), columns.len() as f64];
            let all = head.into_iter().chain(columns.iter().map(|&column| f64::from(column)));
            out.iter_mut().zip(all).for_each(|(out, value)| *out = value);
        };
        exchange.forward_from(session.world(), Self::HEAD + width, give, &mut rows);
        Ok(Self { ghosts, exchange, width, rows })
    }

    fn row(&self, ghost: usize) -> &[f64] {
        &self.rows[ghost * (Self::HEAD + self.width)..][..Self::HEAD + self.width]
    }

    fn place(&self, ghost: usize) -> u32 {
        self.row(ghost)[0] as u32
    }

    /// Global columns of a ghost's row.
    fn columns(&self, ghost: usize) -> impl Iterator<Item = i32> + '_ {
        let row = self.row(ghost);
        row[Self::HEAD..].iter().take(row[1] as usize).map(|&column| column as i32)
    }
}

/// The global nodes that are neither owned nor among the `ghosts`, in ascending order and without
/// duplicates.
fn outside(pattern: &BlockPattern, nodes: impl Iterator<Item = i32>, ghosts: &[i32]) -> Vec<i32> {
    let known = |node: &i32| pattern.owned().contains(node) || ghosts.binary_search(node).is_ok();
    let mut others: Vec<i32> = nodes.filter(|node| !known(node)).collect();
    others.sort_unstable();
    others.dedup();
    others
}

/// Origin of a block of the subdomain's matrix: a slot of the rank's own rows or, with the highest
/// bit set, a block among those that the neighbours send.
#[derive(Debug, Clone, Copy)]
struct Source(u32);

impl Source {
    const SENT: u32 = 1 << 31;

    /// A slot of the rank's own rows.
    fn own(slot: usize) -> Self {
        Self(slot as u32)
    }

    /// A block among those that the neighbours send.
    fn sent(block: usize) -> Self {
        Self(block as u32 | Self::SENT)
    }

    /// The slot, or the block that was sent.
    fn place(self) -> std::result::Result<u32, u32> {
        if self.0 & Self::SENT == 0 { Ok(self.0) } else { Err(self.0 & !Self::SENT) }
    }
}

/// The subdomain's matrix, its factors, and the data that are exchanged.
struct Overlapping<const D: usize> {
    pattern: Rc<BlockPattern>,
    exchange: NodeExchange,
    width: usize,
    /// Owned nodes, then ghosts, in the order of elimination, and the position of each in it.
    order: Vec<u32>,
    factors: Incomplete<D>,
    /// Source of each block of the factors' rows.
    sources: Vec<Source>,
    sent: Vec<f64>,
    halo: Vec<f64>,
    x: Vec<[f64; D]>,
}

impl<const D: usize> Overlapping<D> {
    fn new(pattern: &Rc<BlockPattern>, grown: Grown) -> Self {
        let owned = pattern.rows();
        let count = pattern.rows() + grown.ghosts.len();
        let place = |node: u32| match (node as usize).checked_sub(owned) {
            None => pattern.places[node as usize],
            Some(ghost) => grown.place(ghost),
        };
        let mut order: Vec<u32> = (0..count as u32).collect();
        order.sort_by_key(|&node| place(node));
        let mut position = vec![0; count];
        (0..).zip(&order).for_each(|(at, &node)| position[node as usize] = at);
        let found = |global: i32| {
            let ghost = || grown.ghosts.binary_search(&global).ok().map(|ghost| owned + ghost);
            let own = pattern.owned().contains(&global).then(|| (global - pattern.first_row) as usize);
            own.or_else(ghost).map(|node| position[node])
        };
        let mut rows = FactorPattern { offsets: vec![0], columns: Vec::with_capacity(pattern.slots()) };
        let mut sources = Vec::with_capacity(pattern.slots());
        let mut row: Vec<(u32, Source)> = Vec::new();
        for &node in &order {
            row.clear();
            match (node as usize).checked_sub(owned) {
                None => row.extend(pattern.row(node as usize).filter_map(|slot| {
                    found(pattern.columns[slot]).map(|column| (column, Source::own(slot)))
                })),
                Some(ghost) => {
                    row.extend((ghost * grown.width..).zip(grown.columns(ghost)).filter_map(
                        |(block, column)| found(column).map(|column| (column, Source::sent(block))),
                    ))
                }
            }
            row.sort_unstable_by_key(|(column, _)| *column);
            rows.columns.extend(row.iter().map(|(column, _)| *column));
            sources.extend(row.iter().map(|(_, source)| *source));
            rows.offsets.push(rows.columns.len() as u32);
        }
        Self {
            pattern: Rc::clone(pattern),
            width: grown.width,
            order,
            factors: Incomplete::new(&rows),
            sources,
            sent: vec![0.0; grown.ghosts.len() * grown.width * D * D],
            halo: vec![0.0; grown.ghosts.len() * D],
            x: vec![[0.0; D]; count],
            exchange: grown.exchange,
        }
    }
}

impl<const D: usize> Factors for Overlapping<D> {
    fn renew(&mut self, session: &Session, matrix: &Matrix) -> Result<()> {
        let Self { pattern, exchange, width, factors, sources, sent, .. } = self;
        matrix.read(|blocks| {
            let give = |node: u32, out: &mut [f64]| {
                for (slot, out) in pattern.row(node as usize).zip(out.chunks_exact_mut(D * D)) {
                    out.copy_from_slice(blocks.columns::<D>(slot as u32).as_flattened());
                }
            };
            exchange.forward_from(session.world(), *width * D * D, give, sent);
            factors.factorise(|k| match sources[k].place() {
                Ok(slot) => blocks.columns(slot),
                Err(block) => {
                    let values = &sent[block as usize * D * D..][..D * D];
                    std::array::from_fn(|j| std::array::from_fn(|i| values[j * D + i]))
                }
            });
        })
    }

    fn solve(&mut self, session: &Session, r: &Vector, z: &mut Vector) {
        let r = r.owned();
        self.exchange.forward(session.world(), D, &r, &mut self.halo);
        let (r, halo) = (r.as_chunks::<D>().0, self.halo.as_chunks::<D>().0);
        for (x, &node) in self.x.iter_mut().zip(&self.order) {
            *x = match (node as usize).checked_sub(r.len()) {
                None => r[node as usize],
                Some(ghost) => halo[ghost],
            };
        }
        self.factors.solve(&mut self.x);
        let mut z = z.owned_mut();
        let z = z.as_chunks_mut::<D>().0;
        for (x, &node) in self.x.iter().zip(&self.order) {
            if let Some(z) = z.get_mut(node as usize) {
                *z = *x;
            }
        }
    }
}
