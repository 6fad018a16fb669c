//! Serialization of a local mesh, or of rows of a graph, as two flat buffers, and their transfer by
//! MPI in chunks for any total size.

use std::collections::BTreeMap;

use mpi::traits::{CommunicatorCollectives, Destination, Source};

use super::{IndexMap, LocalMesh};
use crate::error::{Error, Result};
use crate::mesh::{ElementKind, ElementPatch, Facet, Mesh, PlaneState, Tie};

/// Items in one MPI message. MPI counts with 32 bits, and a buffer may have more items.
const CHUNK: usize = 1 << 27;

/// A serialized local mesh, or lists of integers.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Message {
    integers: Vec<u32>,
    reals: Vec<f64>,
}

impl Message {
    /// Serializes a local mesh.
    pub fn pack<const D: usize>(local: &LocalMesh<D>) -> Self {
        let LocalMesh { mesh, index, .. } = local;
        let mut message = Self { integers: Vec::new(), reals: mesh.points.as_flattened().to_vec() };
        message.integers.extend([
            index.first as u32,
            index.owned as u32,
            index.total as u32,
            local.assembled as u32,
            mesh.plane as u32,
        ]);
        message.list(index.ghosts.iter().map(|&global| global as u32));
        message.list(local.input_node.iter().copied());
        message.list(local.input_element.iter().copied());
        message.list(local.mine.iter().map(|&mine| u32::from(mine)));
        message.list(mesh.kinds.iter().map(|&kind| kind as u32));
        message.list(mesh.body.iter().map(|&body| u32::from(body)));
        message.list(mesh.piece.iter().copied());
        message.list(mesh.nodes.iter().copied());
        message.sets(&mesh.facet_sets, |facet, into| into.extend([facet.element, u32::from(facet.side)]));
        message.sets(&mesh.point_sets, |node, into| into.push(*node));
        message.sets(&mesh.element_sets, |element, into| into.push(*element));
        message.integers.push(mesh.ties.len() as u32);
        for tie in &mesh.ties {
            message.integers.extend([tie.pair, tie.contactor]);
            message.list(tie.nodes.iter().copied());
            message.reals.extend(&tie.weights);
            message.reals.extend([tie.area, tie.stiffness, tie.element_stiffness]);
        }
        message.integers.push(mesh.patches.len() as u32);
        for patch in &mesh.patches {
            message.integers.extend([u32::from(patch.body), patch.material]);
            message.list(patch.elements.iter().copied());
            message.list(patch.kinds.iter().map(|&kind| kind as u32));
            message.list(patch.nodes.iter().copied());
        }
        message
    }

    /// Deserializes the local mesh.
    ///
    /// # Errors
    /// The message was not written by [`pack`](Self::pack).
    pub fn unpack<const D: usize>(self) -> Result<LocalMesh<D>> {
        let mut reader = Reader { integers: &self.integers };
        reader
            .local_mesh(&self.reals)
            .ok_or_else(|| Error::internal("partition: a message with a piece of the mesh is damaged"))
    }

    /// Serializes lists of integers.
    pub fn of_lists(lists: &[&[i32]]) -> Self {
        let mut message = Self::default();
        for list in lists {
            message.list(list.iter().map(|&item| item as u32));
        }
        message
    }

    /// The lists that were serialized; `None` if there are not `N` of them.
    pub fn into_lists<const N: usize>(self) -> Option<[Vec<i32>; N]> {
        let mut reader = Reader { integers: &self.integers };
        let mut lists = [const { Vec::new() }; N];
        for list in &mut lists {
            *list = reader.list()?.iter().map(|&item| item as i32).collect();
        }
        reader.integers.is_empty().then_some(lists)
    }

    /// Sends the message to a rank, which receives it with [`receive`](Self::receive).
    pub fn send(&self, world: &impl CommunicatorCollectives, rank: i32) {
        let to = world.process_at_rank(rank);
        to.send(&[self.integers.len() as u64, self.reals.len() as u64][..]);
        self.integers.chunks(CHUNK).for_each(|chunk| to.send(chunk));
        self.reals.chunks(CHUNK).for_each(|chunk| to.send(chunk));
    }

    /// Receives a message from a rank.
    pub fn receive(world: &impl CommunicatorCollectives, rank: i32) -> Self {
        let from = world.process_at_rank(rank);
        let mut lengths = [0_u64; 2];
        from.receive_into(&mut lengths[..]);
        let mut message =
            Self { integers: vec![0; lengths[0] as usize], reals: vec![0.0; lengths[1] as usize] };
        for chunk in message.integers.chunks_mut(CHUNK) {
            from.receive_into(chunk);
        }
        for chunk in message.reals.chunks_mut(CHUNK) {
            from.receive_into(chunk);
        }
        message
    }

    /// Writes a list: its length, then its items.
    fn list(&mut self, items: impl ExactSizeIterator<Item = u32>) {
        self.integers.push(items.len() as u32);
        self.integers.extend(items);
    }

    /// Writes named sets: their number, then for each its name and its members.
    fn sets<T>(&mut self, sets: &BTreeMap<String, Vec<T>>, write: impl Fn(&T, &mut Vec<u32>)) {
        self.integers.push(sets.len() as u32);
        for (name, members) in sets {
            self.list(name.bytes().map(u32::from));
            let start = self.integers.len();
            self.integers.push(0);
            members.iter().for_each(|member| write(member, &mut self.integers));
            self.integers[start] = (self.integers.len() - start - 1) as u32;
        }
    }
}

/// The unread rest of a message. Methods return `None` if it is too short or invalid.
struct Reader<'a> {
    integers: &'a [u32],
}

impl<'a> Reader<'a> {
    fn number(&mut self) -> Option<u32> {
        let (&first, rest) = self.integers.split_first()?;
        self.integers = rest;
        Some(first)
    }

    fn list(&mut self) -> Option<&'a [u32]> {
        let length = self.number()? as usize;
        let (list, rest) = self.integers.split_at_checked(length)?;
        self.integers = rest;
        Some(list)
    }

    fn sets<T>(&mut self, read: impl Fn(&[u32]) -> Vec<T>) -> Option<BTreeMap<String, Vec<T>>> {
        let count = self.number()?;
        let mut sets = BTreeMap::new();
        for _ in 0..count {
            let name: Vec<u8> = self.list()?.iter().map(|&byte| byte as u8).collect();
            sets.insert(String::from_utf8(name).ok()?, read(self.list()?));
        }
        Some(sets)
    }

    fn local_mesh<const D: usize>(&mut self, reals: &[f64]) -> Option<LocalMesh<D>> {
        let [first, owned, total] = [self.number()?, self.number()?, self.number()?];
        let assembled = self.number()? as usize;
        let plane = *PlaneState::ALL.get(self.number()? as usize)?;
        let ghosts: Vec<i32> = self.list()?.iter().map(|&global| global as i32).collect();
        let input_node = self.list()?.to_vec();
        let input_element = self.list()?.to_vec();
        let mine = self.list()?.iter().map(|&mine| mine == 1).collect();
        let kinds = self.list()?.iter().map(|&kind| ElementKind::ALL.get(kind as usize).copied());
        let nodes = owned as usize + ghosts.len();
        let (points, mut reals) = reals.split_at_checked(nodes * D)?;
        let mut mesh = Mesh::with_points(points.as_chunks::<D>().0.to_vec());
        mesh.plane = plane;
        mesh.kinds = kinds.collect::<Option<_>>()?;
        mesh.body = self.list()?.iter().map(|&body| body as u16).collect();
        mesh.piece = self.list()?.to_vec();
        mesh.nodes = self.list()?.to_vec();
        for kind in &mesh.kinds {
            mesh.offsets.push(mesh.offsets.last()? + kind.nodes() as u32);
        }
        mesh.facet_sets = self.sets(|pairs| {
            pairs
                .as_chunks::<2>()
                .0
                .iter()
                .map(|&[element, side]| Facet { element, side: side as u8 })
                .collect()
        })?;
        mesh.point_sets = self.sets(<[u32]>::to_vec)?;
        mesh.element_sets = self.sets(<[u32]>::to_vec)?;
        let index = IndexMap { first: first as i32, owned: owned as usize, ghosts, total: total as i32 };
        for _ in 0..self.number()? {
            let [pair, contactor] = [self.number()?, self.number()?];
            let nodes = self.list()?.to_vec();
            let (weights, rest) = reals.split_at_checked(nodes.len())?;
            let (&[area, stiffness, element_stiffness], rest) = rest.split_first_chunk()?;
            reals = rest;
            let weights = weights.to_vec();
            mesh.ties.push(Tie { pair, nodes, weights, contactor, area, stiffness, element_stiffness });
        }
        for _ in 0..self.number()? {
            let (body, material) = (self.number()? as u16, self.number()?);
            let elements = self.list()?.to_vec();
            let kinds = self.list()?.iter().map(|&kind| ElementKind::ALL.get(kind as usize).copied());
            let kinds = kinds.collect::<Option<_>>()?;
            let nodes = self.list()?.to_vec();
            mesh.patches.push(ElementPatch { body, material, elements, kinds, nodes });
        }
        let whole = self.integers.is_empty() && reals.is_empty();
        whole.then_some(LocalMesh { mesh, assembled, mine, index, input_node, input_element })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> LocalMesh<2> {
        let mut mesh = Mesh::with_points(vec![[0.0, -0.5], [1.0, 0.25], [1.0, 1.0], [0.0, 1.0], [3.0, 4.0]]);
        mesh.push(ElementKind::Quad4, [0, 1, 2, 3]);
        mesh.push(ElementKind::Tri3, [1, 4, 2]);
        mesh.plane = PlaneState::Axisymmetric;
        mesh.body[1] = 1;
        mesh.piece[1] = 3;
        mesh.facet_sets
            .insert("bö.left".into(), vec![Facet { element: 0, side: 3 }, Facet { element: 1, side: 1 }]);
        mesh.point_sets.insert("empty".into(), vec![]);
        mesh.element_sets.insert("b".into(), vec![1]);
        let of = |nodes: Vec<u32>, area| Tie {
            pair: 2,
            weights: vec![area; nodes.len()],
            nodes,
            contactor: 1,
            area,
            stiffness: 3.0,
            element_stiffness: 4.0,
        };
        mesh.ties = vec![of(vec![0, 4], 0.5), of(vec![1, 2, 3], 0.25)];
        mesh.patches = vec![ElementPatch {
            body: 1,
            material: 2,
            elements: vec![1, ElementPatch::ELSEWHERE],
            kinds: vec![ElementKind::Tri3; 2],
            nodes: vec![1, 4, 2, 0, 1, 2],
        }];
        let index = IndexMap { first: 7, owned: 3, ghosts: vec![1, 12], total: 20 };
        LocalMesh {
            mesh,
            assembled: 1,
            mine: vec![true, false],
            index,
            input_node: vec![5, 4, 3, 2, 1],
            input_element: vec![8, 9],
        }
    }

    /// A local mesh is unchanged by serialization, including an empty one.
    #[test]
    fn what_is_packed_is_unpacked() {
        assert_eq!(Message::pack(&sample()).unpack::<2>().expect("whole"), sample());
        let index = IndexMap { first: 0, owned: 0, ghosts: vec![], total: 9 };
        let mesh = Mesh::with_points(vec![]);
        let empty = LocalMesh::<3> {
            mesh,
            assembled: 0,
            mine: vec![],
            index,
            input_node: vec![],
            input_element: vec![],
        };
        assert_eq!(Message::pack(&empty).unpack::<3>().expect("whole"), empty);
    }

    /// Lists are unchanged by serialization; their number is part of the message.
    #[test]
    fn lists_are_unpacked() {
        let message = || Message::of_lists(&[&[3, -1], &[], &[i32::MAX]]);
        assert_eq!(message().into_lists(), Some([vec![3, -1], vec![], vec![i32::MAX]]));
        assert_eq!(message().into_lists::<2>(), None);
        assert_eq!(message().into_lists::<4>(), None);
    }

    /// A truncated message is rejected and not read beyond its end.
    #[test]
    fn cut_messages_are_refused() {
        let whole = Message::pack(&sample());
        for length in 0..whole.integers.len() {
            let cut = Message { integers: whole.integers[..length].to_vec(), reals: whole.reals.clone() };
            assert!(cut.unpack::<2>().is_err(), "{length}");
        }
    }
}
