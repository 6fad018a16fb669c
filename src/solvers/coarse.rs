//! Coarse space: rigid motions of aggregates of nodes.
//!
//! Smooth motions are almost rigid over a few elements. Let P have the rigid motions of each
//! aggregate as columns. The correction `z += P (P^T A P)^-1 P^T r` reduces the part of an error that
//! incomplete factors of `A` reduce slowly: its mean displacement and rotation over an aggregate.
//! Aggregates lie on one rank and in one body, or in bodies that are tied, so the space lets bodies
//! slide and separate.
//!
//! The columns of an aggregate are orthonormal, without the unknowns that are prescribed along an
//! axis. Along an inclined direction they keep their motions. Motions
//! that depend on others, such as the rotation of two nodes about their line, are left out.

use std::rc::Rc;

use mpi::collective::SystemOperation;

use crate::collective::Collective;
use crate::dynamics::BodyNodes;
use crate::error::{Result, agree};
use crate::partition::exchange::NodeExchange;
use crate::partition::{IndexMap, aggregates};
use crate::petsc::{BlockPattern, Event, Format, KrylovSolver, Matrix, Session, Vector};

/// The coarse space of matrices with one pattern, and the projection of one of them.
pub struct CoarseSpace {
    session: Rc<Session>,
    /// Unknowns of a node, 2 or 3.
    size: usize,
    /// Rigid motions of an aggregate, 3 or 6.
    modes: usize,
    /// Global number of the aggregate of each node of the rank: the owned ones, then the ghosts.
    aggregate: Vec<Option<u32>>,
    /// Global number of the first owned aggregate.
    first: u32,
    /// Displacements of the owned nodes under rigid motions of their aggregate, `size` rows of `modes`.
    motions: Vec<f64>,
    /// Basis of the space at owned nodes and ghosts: orthonormal, without prescribed unknowns.
    basis: Vec<f64>,
    /// Local number of the node of each slot of the pattern.
    nodes: Vec<u32>,
    exchange: NodeExchange,
    matrix: Matrix,
    krylov: KrylovSolver,
    rhs: Vector,
    solution: Vector,
    projection: Event,
    correction: Event,
}

impl CoarseSpace {
    /// Prefix of PETSc's options for the coarse solver.
    const PREFIX: &str = "coarse_";
    const OPTIONS: [(&str, &str); 5] = [
        ("ksp_type", "preonly"),
        ("pc_type", "lu"),
        ("pc_factor_mat_solver_type", "mumps"),
        ("mat_mumps_icntl_7", "5"),
        ("mat_mumps_icntl_14", "50"),
    ];
    /// Nodes of an aggregate in 2D. Two boxes of 502 502 unknowns in statics take 1.23 times the iterations
    /// with 200, and 0.86 times with 60. Set-up and solve take 0.92 and 1.15 times as long
    /// (docs/performance/large-problems.md).
    const NODES_2D: usize = 100;
    /// Nodes of an aggregate in 3D. With 60, two boxes of 27 753 and 89 328 unknowns take 0.81 to 0.85 times
    /// the iterations and 0.93 times the time at CFL 50. With 600 they take 1.15 to 1.19 times the
    /// iterations. The coarse matrix has 1 % of the unknowns, with 60 nodes 3.3 %.
    const NODES_3D: usize = 200;
    /// Smallest component of the mesh that gets aggregates: one element of hex8. The node of a free rigid
    /// body gets none.
    const LEAST: usize = 8;
    /// Unknowns of a block of the coarse matrix. An aggregate has one or two blocks.
    const BLOCK: usize = 3;
    /// Part of a motion that must be independent of the motions before it. In an aggregate with some
    /// extent in every direction all are. The value only has to be above rounding.
    const INDEPENDENT: f64 = 1e-3;

    /// Builds the space for matrices with this pattern. It is `None` if no rank has an aggregate or a
    /// node has a single unknown. Collective.
    ///
    /// # Errors
    /// If memory is insufficient.
    pub fn new(session: &Rc<Session>, pattern: &BlockPattern, nodes: &BodyNodes) -> Result<Option<Self>> {
        let size = pattern.block_size;
        if size < 2 {
            return Ok(None);
        }
        let set_up = Event::register(session, "SolverSetUp")?;
        let _running = set_up.begin();
        let (modes, wanted) = if size == 3 { (6, Self::NODES_3D) } else { (3, Self::NODES_2D) };
        let (groups, count) = agree(session.world(), group(&nodes.pattern, wanted, Self::LEAST))?;
        let mut through = 0u32;
        session.world().reduce_up_to(&(count as u32), &mut through, SystemOperation::sum());
        let first = through - count as u32;
        let mut total = 0;
        let mut all = 0u32;
        session.world().reduce_all(&(pattern.rows() as i32), &mut total, SystemOperation::sum());
        session.world().reduce_all(&(count as u32), &mut all, SystemOperation::sum());
        if all == 0 {
            return Ok(None);
        }
        let motions = motions(&groups, count, size, modes, &nodes.coordinates);
        let owned = pattern.owned();
        let mut ghosts: Vec<i32> =
            pattern.columns.iter().copied().filter(|node| !owned.contains(node)).collect();
        ghosts.sort_unstable();
        ghosts.dedup();
        let place = |node: &i32| match owned.contains(node) {
            true => (node - owned.start) as u32,
            false => (pattern.rows() + ghosts.partition_point(|ghost| ghost < node)) as u32,
        };
        let places: Vec<u32> = pattern.columns.iter().map(place).collect();
        let index = IndexMap { first: owned.start, owned: pattern.rows(), ghosts: Vec::new(), total };
        let mut exchange = NodeExchange::new(session.world(), &index, &ghosts)?;
        // One more than the number of the aggregate, zero for none.
        let numbers: Vec<f64> =
            groups.iter().map(|group| group.map_or(0.0, |group| f64::from(first + group + 1))).collect();
        let mut foreign = vec![0.0; ghosts.len()];
        exchange.forward(session.world(), 1, &numbers, &mut foreign);
        let aggregate: Vec<Option<u32>> =
            numbers.iter().chain(&foreign).map(|number| (*number as u32).checked_sub(1)).collect();
        let coarse = coarse_pattern(pattern, &places, &aggregate, first, count, modes / Self::BLOCK);
        let matrix = Matrix::new(session, &Rc::new(coarse), Format::Aij)?;
        let mut krylov = KrylovSolver::new(session, Self::PREFIX)?;
        krylov.configure(&Self::OPTIONS)?;
        let rhs = Vector::new(session, count * modes / Self::BLOCK, Self::BLOCK)?;
        Ok(Some(Self {
            session: Rc::clone(session),
            size,
            modes,
            basis: vec![0.0; (pattern.rows() + ghosts.len()) * size * modes],
            aggregate,
            first,
            motions,
            nodes: places,
            exchange,
            matrix,
            krylov,
            solution: rhs.like()?,
            rhs,
            projection: Event::register(session, "CoarseMatrix")?,
            correction: Event::register(session, "CoarseSolve")?,
        }))
    }

    /// Projects `matrix` and factorises the result. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails. The solve reports a zero pivot.
    pub fn project(&mut self, matrix: &Matrix) -> Result<()> {
        let projection = self.projection.clone();
        let _running = projection.begin();
        self.orthonormalise(matrix)?;
        let filled = match self.size {
            3 => self.fill::<3, 6>(matrix),
            _ => self.fill::<2, 3>(matrix),
        };
        agree(self.session.world(), filled)?;
        self.krylov.set_operators(&self.matrix, &self.matrix)?;
        self.krylov.set_up()
    }

    /// Makes the motions of each aggregate orthonormal without the unknowns that are prescribed in
    /// `matrix`, and exchanges them. Collective.
    fn orthonormalise(&mut self, matrix: &Matrix) -> Result<()> {
        let Self { session, size, modes, aggregate, first, motions, basis, exchange, .. } = self;
        let (size, modes) = (*size, *modes);
        let pattern = matrix.pattern();
        let owned = pattern.rows();
        let width = size * modes;
        let basis_of_owned = &mut basis[..owned * width];
        basis_of_owned.copy_from_slice(motions);
        let read = matrix.read(|values| {
            let mut block = vec![0.0; size * size];
            for node in 0..owned {
                let mut held = [true; 3];
                for slot in pattern.row(node) {
                    // A few blocks show that a node is free.
                    if !held[..size].contains(&true) {
                        break;
                    }
                    values.block(slot as u32, &mut block);
                    let is_diagonal = pattern.columns[slot] == pattern.first_row + node as i32;
                    for i in 0..size {
                        let others = (0..size).filter(|&j| !is_diagonal || i != j);
                        held[i] &= others.map(|j| block[i * size + j]).all(|entry| entry == 0.0);
                    }
                }
                for i in (0..size).filter(|&i| held[i]) {
                    basis_of_owned[node * width + i * modes..][..modes].fill(0.0);
                }
            }
        });
        agree(session.world(), read)?;
        // Gram-Schmidt, for all aggregates at once. `products` holds those of one motion with all.
        let count = self.rhs.owned_len() / modes;
        let mut products = vec![0.0; count * modes];
        let mut sizes = vec![0.0; count];
        let mut lengths = vec![0.0; count];
        for mode in 0..modes {
            for pass in 0..2 {
                products.fill(0.0);
                each(aggregate, *first, basis_of_owned, width, |aggregate, motions| {
                    for motion in motions.chunks_exact(modes) {
                        for other in 0..=mode {
                            products[aggregate * modes + other] += motion[mode] * motion[other];
                        }
                    }
                });
                if pass == 0 {
                    (0..count).for_each(|aggregate| sizes[aggregate] = products[aggregate * modes + mode]);
                }
                each(aggregate, *first, basis_of_owned, width, |aggregate, motions| {
                    for motion in motions.chunks_exact_mut(modes) {
                        for other in 0..mode {
                            motion[mode] -= products[aggregate * modes + other] * motion[other];
                        }
                    }
                });
            }
            lengths.fill(0.0);
            each(aggregate, *first, basis_of_owned, width, |aggregate, motions| {
                let square = |motion: &[f64]| motion[mode] * motion[mode];
                lengths[aggregate] += motions.chunks_exact(modes).map(square).sum::<f64>();
            });
            each(aggregate, *first, basis_of_owned, width, |aggregate, motions| {
                let remains = lengths[aggregate] > Self::INDEPENDENT.powi(2) * sizes[aggregate];
                let factor = if remains { lengths[aggregate].sqrt().recip() } else { 0.0 };
                motions.chunks_exact_mut(modes).for_each(|motion| motion[mode] *= factor);
            });
        }
        let (own, foreign) = basis.split_at_mut(owned * width);
        exchange.forward(session.world(), width, own, foreign);
        Ok(())
    }

    /// `P^T A P`. A motion that was left out gets a diagonal entry of one.
    fn fill<const D: usize, const M: usize>(&mut self, matrix: &Matrix) -> Result<()> {
        let Self { aggregate, first, basis, nodes, .. } = self;
        let pattern = matrix.pattern();
        let coarse = Rc::clone(self.matrix.pattern());
        let (per, block) = (M / Self::BLOCK, Self::BLOCK);
        let basis = basis.as_chunks::<M>().0;
        // Products of a row of A with the motions of each aggregate that it meets.
        let mut met: Vec<u32> = Vec::new();
        let mut sums: Vec<[[f64; M]; D]> = Vec::new();
        matrix.read(|values| {
            self.matrix.fill(|part| {
                part.zero();
                for node in 0..pattern.rows() {
                    let Some(own) = aggregate[node] else { continue };
                    met.clear();
                    sums.clear();
                    for slot in pattern.row(node) {
                        let other = nodes[slot] as usize;
                        let Some(number) = aggregate[other] else { continue };
                        let at = met.iter().position(|known| *known == number).unwrap_or_else(|| {
                            met.push(number);
                            sums.push([[0.0; M]; D]);
                            met.len() - 1
                        });
                        let columns = values.columns::<D>(slot as u32);
                        for (column, motion) in columns.iter().zip(&basis[other * D..][..D]) {
                            for i in 0..D {
                                for mode in 0..M {
                                    sums[at][i][mode] += column[i] * motion[mode];
                                }
                            }
                        }
                    }
                    let row = (own - *first) as usize * per;
                    for (number, sum) in met.iter().zip(&sums) {
                        let mut product = [[0.0; M]; M];
                        for (motion, sum) in basis[node * D..][..D].iter().zip(sum) {
                            for i in 0..M {
                                for j in 0..M {
                                    product[i][j] += motion[i] * sum[j];
                                }
                            }
                        }
                        for (a, b) in (0..per).flat_map(|a| (0..per).map(move |b| (a, b))) {
                            let values: [f64; 9] = std::array::from_fn(|k| {
                                product[a * block + k / block][b * block + k % block]
                            });
                            if let Some(slot) = coarse.slot(row + a, (*number as usize * per + b) as i32) {
                                part.add(slot, &values);
                            }
                        }
                    }
                }
            })
        })??;
        let mut diagonal = self.rhs.like()?;
        self.matrix.diagonal(&mut diagonal)?;
        let diagonal = diagonal.owned();
        self.matrix.fill(|part| {
            for (unknown, _) in diagonal.iter().enumerate().filter(|(_, entry)| **entry == 0.0) {
                part.add_diagonal(unknown, 1.0);
            }
        })
    }

    /// Computes `z = P (P^T A P)^-1 P^T r`. Returns whether this was possible. Collective.
    ///
    /// # Errors
    /// If a PETSc call fails.
    pub fn solve(&mut self, r: &Vector, z: &mut Vector) -> Result<bool> {
        let Self { size, modes, aggregate, first, basis, krylov, rhs, solution, correction, .. } = self;
        let (size, modes) = (*size, *modes);
        let _running = correction.begin();
        {
            let (r, mut sums) = (r.owned(), rhs.owned_mut());
            sums.fill(0.0);
            let rows = r.chunks_exact(size).zip(basis.chunks_exact(size * modes)).zip(aggregate.iter());
            for ((r, motions), aggregate) in rows {
                let Some(aggregate) = aggregate else { continue };
                let sums = &mut sums[(aggregate - *first) as usize * modes..][..modes];
                for (r, motion) in r.iter().zip(motions.chunks_exact(modes)) {
                    sums.iter_mut().zip(motion).for_each(|(sum, motion)| *sum += r * motion);
                }
            }
        }
        let converged = krylov.solve(rhs, solution)?.converged();
        let (amounts, mut z) = (solution.owned(), z.owned_mut());
        z.fill(0.0);
        let rows = z.chunks_exact_mut(size).zip(basis.chunks_exact(size * modes)).zip(aggregate.iter());
        for ((z, motions), aggregate) in rows {
            let Some(aggregate) = aggregate else { continue };
            let amounts = &amounts[(aggregate - *first) as usize * modes..][..modes];
            for (z, motion) in z.iter_mut().zip(motions.chunks_exact(modes)) {
                *z = motion.iter().zip(amounts).map(|(motion, amount)| motion * amount).sum();
            }
        }
        Ok(converged)
    }
}

/// Calls `use_node` with the local number of the aggregate of each owned node and with its motions.
fn each(
    aggregates: &[Option<u32>],
    first: u32,
    motions: &mut [f64],
    width: usize,
    mut use_node: impl FnMut(usize, &mut [f64]),
) {
    for (aggregate, motions) in aggregates.iter().zip(motions.chunks_exact_mut(width)) {
        if let Some(aggregate) = aggregate {
            use_node((aggregate - first) as usize, motions);
        }
    }
}

/// Groups of the owned nodes, and their number.
fn group(pattern: &BlockPattern, size: usize, least: usize) -> Result<(Vec<Option<u32>>, usize)> {
    let owned = pattern.owned();
    let (mut offsets, mut neighbours) = (vec![0], Vec::new());
    for node in 0..pattern.rows() {
        let own = owned.start + node as i32;
        let row = pattern.columns[pattern.row(node)].iter();
        let others = row.filter(|column| **column != own && owned.contains(column));
        neighbours.extend(others.map(|column| column - owned.start));
        offsets.push(neighbours.len() as i32);
    }
    aggregates(&offsets, &neighbours, size, least)
}

/// Displacements of nodes under rigid motions of their group about its centre, scaled by its extent.
fn motions(groups: &[Option<u32>], count: usize, size: usize, modes: usize, coordinates: &[f64]) -> Vec<f64> {
    let of_group = |group: Option<u32>| group.map(|group| group as usize);
    let mut centres = vec![[0.0; 3]; count];
    let mut numbers = vec![0.0f64; count];
    for (group, x) in groups.iter().zip(coordinates.chunks_exact(size)) {
        let Some(group) = of_group(*group) else { continue };
        numbers[group] += 1.0;
        (0..size).for_each(|i| centres[group][i] += x[i]);
    }
    for (centre, number) in centres.iter_mut().zip(&numbers) {
        centre.iter_mut().for_each(|entry| *entry /= number.max(1.0));
    }
    let mut extents = vec![0.0f64; count];
    for (group, x) in groups.iter().zip(coordinates.chunks_exact(size)) {
        let Some(group) = of_group(*group) else { continue };
        let far = (0..size).map(|i| (x[i] - centres[group][i]).abs()).fold(0.0, f64::max);
        extents[group] = extents[group].max(far);
    }
    let mut motions = vec![0.0; groups.len() * size * modes];
    let nodes = groups.iter().zip(coordinates.chunks_exact(size));
    for ((group, x), motions) in nodes.zip(motions.chunks_exact_mut(size * modes)) {
        let Some(group) = of_group(*group) else { continue };
        let scale = extents[group].max(f64::MIN_POSITIVE);
        let at: [f64; 3] =
            std::array::from_fn(|i| if i < size { (x[i] - centres[group][i]) / scale } else { 0.0 });
        (0..size).for_each(|i| motions[i * modes + i] = 1.0);
        // Rotations from axis `i` to axis `j`.
        let planes: &[(usize, usize)] = if size == 3 { &[(1, 2), (2, 0), (0, 1)] } else { &[(0, 1)] };
        for (k, &(i, j)) in planes.iter().enumerate() {
            motions[i * modes + size + k] = -at[j];
            motions[j * modes + size + k] = at[i];
        }
    }
    motions
}

/// The pattern of the coarse matrix, with `per` blocks for an aggregate.
fn coarse_pattern(
    pattern: &BlockPattern,
    places: &[u32],
    aggregate: &[Option<u32>],
    first: u32,
    count: usize,
    per: usize,
) -> BlockPattern {
    let mut rows: Vec<Vec<u32>> = (0..count).map(|own| vec![first + own as u32]).collect();
    for node in 0..pattern.rows() {
        let Some(own) = aggregate[node] else { continue };
        let row = &mut rows[(own - first) as usize];
        for slot in pattern.row(node) {
            if let Some(other) = aggregate[places[slot] as usize]
                && !row.contains(&other)
            {
                row.push(other);
            }
        }
    }
    let first_row = (first as usize * per) as i32;
    let places = (first_row as u32..).take(count * per).collect();
    let mut coarse = BlockPattern {
        block_size: CoarseSpace::BLOCK,
        first_row,
        row_offsets: vec![0],
        columns: Vec::new(),
        places,
    };
    for row in &mut rows {
        row.sort_unstable();
        for _ in 0..per {
            let columns =
                row.iter().flat_map(|&other| (0..per).map(move |b| (other as usize * per + b) as i32));
            coarse.columns.extend(columns);
            coarse.row_offsets.push(coarse.columns.len() as u32);
        }
    }
    coarse
}
