//! Distribution of a mesh over ranks: seconds, memory and quality of the partition, for each library
//! that partitions.
//!
//! `cargo bench --bench distribution --no-run`, then `mpirun -n 8 PROGRAM [CELLS]` with the program that
//! it names: two boxes of hex8 in contact, with CELLS cells across (44, which are 83 000 elements).

use std::time::Instant;

use contact_petsc::case::Partitioner;
use contact_petsc::error::{Result, agree};
use contact_petsc::mesh::{BoxShape, ElementKind, Mesh, merge};
use contact_petsc::partition::{Couple, Plan, distribute};
use contact_petsc::petsc::{Session, memory, peak_memory};
use mpi::traits::{Communicator, CommunicatorCollectives};

fn main() -> Result<()> {
    let cells = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(44);
    let session = Session::start(&[])?;
    let world = session.world();
    if world.rank() == 0 {
        println!(
            "{:>10} {:>10} {:>6} {:>8} {:>10} {:>10} {:>10} {:>9} {:>10} {:>10} {:>10} {:>12}",
            "library",
            "elements",
            "ranks",
            "seconds",
            "read MB",
            "rank 0 MB",
            "others MB",
            "sides cut",
            "pairs cut",
            "imbalance",
            "of contact",
            "of elements"
        );
    }
    for partitioner in [Partitioner::Metis, Partitioner::Ptscotch] {
        session.measure_anew();
        let mesh = agree(world, (world.rank() == 0).then(|| boxes(cells)).transpose())?;
        let elements = mesh.as_ref().map_or(0, Mesh::element_count);
        let read = memory();
        world.barrier();
        let began = Instant::now();
        let couple = Couple { contactor: "upper.bottom", target: "lower.top", travel: 0.0, load: true };
        let plan = agree(world, Plan::for_contact(mesh.as_ref(), &[couple]))?;
        let plan = Plan { partitioner, ..plan };
        let (local, report) = distribute(world, mesh, &plan)?;
        let seconds = began.elapsed().as_secs_f64();
        drop(local);
        let peak = peak_memory();
        let mut peaks = vec![0_u64; world.size() as usize];
        world.all_gather_into(&peak, &mut peaks[..]);
        if world.rank() == 0 {
            let others = peaks[1..].iter().max().copied().unwrap_or(0);
            println!(
                "{:>10} {elements:>10} {:>6} {seconds:>8.1} {:>10} {:>10} {:>10} {:>9} {:>10} {:>10.3} {:>10.3} {:>12.3}",
                format!("{partitioner:?}").to_lowercase(),
                world.size(),
                read / 1_000_000,
                peak / 1_000_000,
                others / 1_000_000,
                report.edge_cut,
                report.pairs_cut,
                report.imbalance(),
                report.contact_imbalance(),
                report.element_imbalance()
            );
        }
    }
    Ok(())
}

/// Two boxes of hex8 in contact, whose meshes do not match.
fn boxes(cells: u32) -> Result<Mesh<3>> {
    let half = |bottom: f64, cells: u32, height: u32| {
        let cells = [cells, cells, height];
        BoxShape { min: [0.0, 0.0, bottom], max: [1.0, 1.0, bottom + 0.5], cells, element: ElementKind::Hex8 }
    };
    let lower = half(0.0, cells, cells / 2).mesh()?;
    merge(vec![("lower".to_owned(), lower), ("upper".to_owned(), half(0.5, cells - 1, cells / 2).mesh()?)])
}
