//! Do values, sums and rows reach the correct ranks?

use contact_petsc::mesh::{ElementKind, Mesh};
use contact_petsc::partition::exchange::{
    Arrived, ExchangedField, ForeignRows, NodeExchange, RowExchange, sparse_all_to_all,
};
use contact_petsc::partition::{LocalMesh, Plan};
use mpi::topology::SimpleCommunicator;
use mpi::traits::Communicator;

use super::{deal, rectangles, sum};

pub fn check_all(world: &SimpleCommunicator) {
    lists_arrive(world);
    // The second mesh has fewer elements than some runs have ranks.
    for cells in [[9, 8], [2, 1]] {
        let whole = rectangles(ElementKind::Quad4, cells);
        let (local, _) = deal(world, &whole, &Plan::default());
        for share in [0, 1, 3] {
            values_come_from_their_owners(world, &local, share);
            sums_are_conserved(world, &local, share);
        }
        rows_are_delivered(world, &local, &whole);
        unknown_nodes_are_errors(world, &local);
    }
}

/// A pseudo-random number from three others.
fn hash(a: i32, b: i32, c: i32) -> i32 {
    let mut mixed =
        (a as u64).wrapping_mul(0x9E37_79B9) ^ (b as u64).wrapping_mul(0x85EB_CA6B) ^ (c as u64) << 7;
    mixed = (mixed ^ mixed >> 15).wrapping_mul(0x2545_F491_4F6C_DD1D);
    (mixed >> 40) as i32 & 0xffff
}

/// Every rank sends to some ranks. The received data equal the sent data, by ascending source.
fn lists_arrive(world: &SimpleCommunicator) {
    let list = |from: i32, to: i32| -> Vec<u32> {
        (0..hash(from, to, 0) % 4).map(|k| hash(from, to, k) as u32).collect()
    };
    let (this, size) = (world.rank(), world.size());
    let lists: Vec<(i32, Vec<u32>)> = (0..size).rev().map(|to| (to, list(this, to))).collect();
    let expected: Vec<(i32, Vec<u32>)> =
        (0..size).map(|from| (from, list(from, this))).filter(|(_, list)| !list.is_empty()).collect();
    assert_eq!(sparse_all_to_all(world, &lists), expected);
    assert!(sparse_all_to_all::<f64>(world, &[]).is_empty());
}

/// Nodes of other ranks, one of `share`, in random order, the first of them twice. No nodes for a
/// share of zero.
fn wanted(world: &SimpleCommunicator, local: &LocalMesh<2>, share: i32) -> Vec<i32> {
    let own = local.index.first..local.index.first + local.index.owned as i32;
    let chosen =
        |&global: &i32| share > 0 && !own.contains(&global) && hash(world.rank(), global, 1) % share == 0;
    let mut wanted: Vec<i32> = (0..local.index.total).filter(chosen).collect();
    wanted.sort_by_key(|&global| hash(global, world.rank(), 2));
    wanted.extend(wanted.first().copied());
    wanted
}

fn owned(local: &LocalMesh<2>) -> impl Iterator<Item = i32> + Clone {
    local.index.first..local.index.first + local.index.owned as i32
}

/// Each requested node delivers the values of its owner exactly: one field alone, the output of a
/// closure, or two fields in one message.
fn values_come_from_their_owners(world: &SimpleCommunicator, local: &LocalMesh<2>, share: i32) {
    let wanted = wanted(world, local, share);
    let mut exchange = NodeExchange::new(world, &local.index, &wanted).expect("nodes that exist");
    let values = |nodes: &mut dyn Iterator<Item = i32>, width: i32| -> Vec<f64> {
        nodes.flat_map(|node| (0..width).map(move |k| f64::from(hash(node, k, width)))).collect()
    };
    let mut two = values(&mut owned(local), 2);
    let three = values(&mut owned(local), 3);
    // What stands behind the owned values, such as ghosts, must not matter.
    two.extend([f64::NAN; 4]);
    for _ in 0..2 {
        let mut alone = vec![f64::NAN; 2 * wanted.len()];
        exchange.forward(world, 2, &two, &mut alone);
        assert_eq!(alone, values(&mut wanted.iter().copied(), 2));
        let mut written = vec![f64::NAN; 2 * wanted.len()];
        let give = |node: u32, out: &mut [f64]| out.copy_from_slice(&two[2 * node as usize..][..2]);
        exchange.forward_from(world, 2, give, &mut written);
        assert_eq!(written, alone);
        let mut pair = [vec![f64::NAN; 2 * wanted.len()], vec![f64::NAN; 3 * wanted.len()]];
        let [first, second] = &mut pair;
        let fields = &mut [
            ExchangedField { width: 2, owned: &two, wanted: first },
            ExchangedField { width: 3, owned: &three, wanted: second },
        ];
        exchange.forward_many(world, fields);
        let expected = [values(&mut wanted.iter().copied(), 2), values(&mut wanted.iter().copied(), 3)];
        assert_eq!(pair, expected);
    }
    let (sent, asked) = (exchange.traffic(5), exchange.reverse_traffic(5));
    let totals = sum(
        world,
        &[sent.messages, asked.messages, sent.bytes, asked.bytes, wanted.len() * 5 * 8].map(|n| n as i32),
    );
    assert!(totals[0] == totals[1] && totals[2] == totals[3] && totals[2] == totals[4], "{totals:?}");
    assert!(sent.messages < world.size() as usize);
}

/// Every contribution arrives once, in the row of its node, and is added to the existing values.
fn sums_are_conserved(world: &SimpleCommunicator, local: &LocalMesh<2>, share: i32) {
    let wanted = wanted(world, local, share);
    let mut exchange = NodeExchange::new(world, &local.index, &wanted).expect("nodes that exist");
    let given: Vec<f64> = (0..2 * wanted.len() as i32).map(|k| f64::from(hash(k, world.rank(), 3))).collect();
    let mut all = vec![0; 2 * local.index.total as usize];
    for (&node, pair) in wanted.iter().zip(given.chunks(2)) {
        (0..2).for_each(|k| all[2 * node as usize + k] += pair[k] as i32);
    }
    let all = sum(world, &all);
    let mut rows = vec![0.5; 2 * local.index.owned];
    exchange.reverse_add(world, 2, &given, &mut rows);
    let first = 2 * local.index.first as usize;
    let expected: Vec<f64> = all[first..first + rows.len()].iter().map(|&n| f64::from(n) + 0.5).collect();
    assert_eq!(rows, expected);
}

/// Owners learn which blocks they receive, and receive them in that order, by ascending sender.
fn rows_are_delivered(world: &SimpleCommunicator, local: &LocalMesh<2>, whole: &Mesh<2>) {
    let nodes = whole.points.len() as i32;
    let adds = |from: i32, row: i32, column: i32| hash(from, row, column) % 5 == 0;
    let own = owned(local);
    let foreign = |row: &i32| !own.clone().any(|own| own == *row);
    let rows = (0..nodes).filter(foreign);
    let pairs: Vec<(i32, i32)> = rows
        .flat_map(|row| (0..nodes).rev().map(move |column| (row, column)))
        .filter(|&(row, column)| adds(world.rank(), row, column))
        .collect();
    let block = |from: i32, row: i32, column: i32| -> [f64; 4] {
        std::array::from_fn(|k| f64::from(hash(from + 100 * k as i32, row, column)))
    };
    let foreign = ForeignRows::collect(pairs.clone());
    let mut values = vec![f64::NAN; 4 * foreign.blocks()];
    for &(row, column) in &pairs {
        let slot = foreign.slot(row, column).expect("a pair of the list") as usize;
        values[4 * slot..4 * slot + 4].copy_from_slice(&block(world.rank(), row, column));
    }
    let mut exchange = RowExchange::new(world, &local.index, &foreign).expect("rows that exist");
    let mut expected: Vec<(u32, Vec<i32>)> = Vec::new();
    let mut blocks = Vec::new();
    for from in (0..world.size()).filter(|&from| from != world.rank()) {
        for row in owned(local) {
            let columns: Vec<i32> = (0..nodes).filter(|&column| adds(from, row, column)).collect();
            blocks.extend(columns.iter().flat_map(|&column| block(from, row, column)));
            if !columns.is_empty() {
                expected.push(((row - local.index.first) as u32, columns));
            }
        }
    }
    let received: Vec<(u32, Vec<i32>)> = exchange.received().map(|(row, all)| (row, all.to_vec())).collect();
    assert_eq!(received, expected);
    assert_eq!(4 * exchange.received_blocks(), blocks.len());
    for _ in 0..2 {
        let all: Vec<u32> = (0..blocks.len() as u32 / 4).collect();
        assert_eq!(exchange.send_values(world, 4, &values), Arrived { numbers: &all, blocks: &blocks });
    }
    // Blocks of zeros stay at home, wherever they stand; a block with some zeros does not.
    let quiet = |column: i32| column % 3 != 1;
    let mut left = Vec::new();
    let columns = expected.iter().flat_map(|(_, columns)| columns);
    for ((number, column), block) in (0..).zip(columns).zip(blocks.chunks(4)) {
        if !quiet(*column) {
            left.push((number, [block[0], 0.0, 0.0, block[3]]));
        }
    }
    for &(row, column) in &pairs {
        let slot = foreign.slot(row, column).expect("a pair of the list") as usize;
        let block = &mut values[4 * slot..4 * slot + 4];
        block[1..3].fill(0.0);
        if quiet(column) {
            block.fill(0.0);
        }
    }
    let (numbers, blocks): (Vec<u32>, Vec<[f64; 4]>) = left.into_iter().unzip();
    let mut worked = 0;
    let (arrived, ()) = exchange.send_values_while(world, 4, &values, || worked += 1);
    assert_eq!(arrived, Arrived { numbers: &numbers, blocks: blocks.as_flattened() });
    assert_eq!(worked, 1);
    values.fill(0.0);
    assert!(exchange.send_values(world, 4, &values).numbers.is_empty());
    let none = ForeignRows::collect(Vec::new());
    let mut nothing = RowExchange::new(world, &local.index, &none).expect("nothing at all");
    assert!(nothing.send_values(world, 4, &[]).numbers.is_empty());
}

/// If one rank requests a node that does not exist, every rank returns an error.
fn unknown_nodes_are_errors(world: &SimpleCommunicator, local: &LocalMesh<2>) {
    let beyond = if world.rank() == 0 { vec![local.index.total] } else { vec![] };
    assert!(NodeExchange::new(world, &local.index, &beyond).is_err());
    let pairs = beyond.iter().map(|&row| (row, 0)).collect();
    assert!(RowExchange::new(world, &local.index, &ForeignRows::collect(pairs)).is_err());
}
