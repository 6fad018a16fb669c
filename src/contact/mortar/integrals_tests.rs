//! Integrals of pairs: derivatives, resultants, moments, and the consequences of the partition of
//! unity.

use super::*;
use crate::taylor::{scatter, taylor_rate};

const LINES: [ElementKind; 2] = [ElementKind::Line2, ElementKind::Line3];
const FACES: [ElementKind; 5] =
    [ElementKind::Tri3, ElementKind::Tri6, ElementKind::Quad4, ElementKind::Quad8, ElementKind::Quad9];
const ALL: WantedVariations =
    WantedVariations { normal: true, slip_velocity: true, slip_increment: true, fixed_places: false };
const RANGE: Range = Range { share: 1.0, deep: [0.3, 0.6], open: [0.0, 0.6] };
/// For facets that stand nearly upright on each other.
const WIDE: Range = Range { share: 1.0, deep: [4.5, 9.0], open: [4.5, 9.0] };

/// A contactor and a target above it, shifted, slightly rotated and bent by `bend`, at
/// approximately this gap \[m\].
fn coordinates<const D: usize>(kinds: [ElementKind; 2], seed: u32, bend: f64, gap: f64) -> Vec<f64> {
    let nodes =
        |kind: ElementKind| crate::space::reference(kind).node_coordinates().iter().take(kind.nodes());
    let flat = |at: &[f64; 3]| Vector::<D>::from_fn(|i, _| if i + 1 < D { at[i] } else { 0.0 });
    let over = |at: &[f64; 3]| {
        let mut y = flat(at);
        let flip = if D == 2 { 0 } else { 1 };
        y[flip] = 0.4 - y[flip];
        if D == 3 {
            let (x, z) = (y[0], y[1]);
            y[0] = 0.31 + 0.9 * x - 0.3 * z;
            y[1] = 0.3 * x + 0.9 * z;
        }
        y[D - 1] = gap;
        y
    };
    let places = nodes(kinds[0]).map(flat).chain(nodes(kinds[1]).map(over));
    let plain: Vec<f64> = places.flat_map(|x| x.as_slice().to_vec()).collect();
    plain.iter().zip(scatter(plain.len(), seed)).map(|(x, noise)| x + bend * noise).collect()
}

fn vectors<const D: usize>(z: &[f64]) -> Vec<Vector<D>> {
    z.chunks_exact(D).map(Vector::from_column_slice).collect()
}

fn with_pair<const D: usize, R>(
    kinds: [ElementKind; 2],
    z: &[f64],
    reference: Option<&[Vector<D>]>,
    plane: PlaneState,
    then: impl FnOnce(&FacetPair<'_, D>) -> R,
) -> R {
    with_pair_in((RANGE, NormalOf::Contactor), kinds, z, reference, plane, then)
}

fn with_pair_in<const D: usize, R>(
    (range, normal_of): (Range, NormalOf),
    kinds: [ElementKind; 2],
    z: &[f64],
    reference: Option<&[Vector<D>]>,
    plane: PlaneState,
    then: impl FnOnce(&FacetPair<'_, D>) -> R,
) -> R {
    let all = vectors::<D>(z);
    let (x, y) = all.split_at(kinds[0].nodes());
    then(&FacetPair {
        contactor: PlacedFacet { kind: kinds[0], nodes: x },
        target: Opposite::Facet(PlacedFacet { kind: kinds[1], nodes: y }),
        measure: reference.map_or(AreaMeasure::Current, AreaMeasure::Reference),
        range,
        across: AcrossPlane { plane, origin: 1.5 },
        normal_of,
    })
}

/// The states across the plane in this many dimensions.
fn planes(dimension: usize) -> &'static [PlaneState] {
    if dimension == 2 { &[PlaneState::Strain, PlaneState::Axisymmetric] } else { &[PlaneState::Strain] }
}

fn all_pairs(kinds: &[ElementKind]) -> Vec<[ElementKind; 2]> {
    kinds.iter().flat_map(|&a| kinds.iter().map(move |&b| [a, b])).collect()
}

/// All integrals as one vector: first those of the geometry, then the sums of the fields.
fn values<const D: usize>(pair: &FacetPair<'_, D>, fields: &[Vec<Vector<D>>; 2]) -> Vec<f64> {
    let sums = pair.integrate(&mut PairWorkspace::default()).expect("they overlap");
    let mut all = Vec::new();
    for vertex in sums.vertices.iter().take(pair.contactor.kind.corners()) {
        all.extend([vertex.area, vertex.gap]);
        all.extend(vertex.normal.iter());
        for field in fields {
            let relative: Vector<D> = field.iter().zip(vertex.coefficients).map(|(f, c)| f * c).sum();
            all.extend(relative.iter());
        }
    }
    all
}

fn change<const D: usize>(
    pair: &FacetPair<'_, D>,
    fields: &[Vec<Vector<D>>; 2],
    d: &[Vector<D>],
) -> Vec<f64> {
    let width = 2 + 3 * D;
    let mut all = vec![0.0; width * pair.contactor.kind.corners()];
    let fields = PairFields { fields: [&fields[0], &fields[1]] };
    pair.vary(&fields, ALL, None, &mut PairWorkspace::default(), |vertex, node, by| {
        let row = &mut all[vertex * width..][..width];
        row[0] += by.area.dot(&d[node]);
        row[1] += by.gap.dot(&d[node]);
        for (rows, tensor) in row[2..].chunks_exact_mut(D).zip([by.normal, by.slips[0], by.slips[1]]) {
            rows.iter_mut().zip((tensor * d[node]).iter()).for_each(|(row, value)| *row += value);
        }
    });
    all
}

/// Turns the target by the angle with this tangent.
fn tilt<const D: usize>(kinds: [ElementKind; 2], z: &mut [f64], tangent: f64) {
    for place in z.chunks_exact_mut(D).skip(kinds[0].nodes()) {
        place[D - 1] += tangent * (place[0] - 0.2);
    }
}

fn varies<const D: usize>(
    kinds: [ElementKind; 2],
    reference: bool,
    (gap, tangent): (f64, f64),
    plane: PlaneState,
) {
    for (seed, normal_of) in
        (0..5).flat_map(|seed| [NormalOf::Contactor, NormalOf::Target].map(|of| (seed, of)))
    {
        let mut z = coordinates::<D>(kinds, seed, 0.08, gap);
        tilt::<D>(kinds, &mut z, tangent);
        let undeformed = vectors::<D>(&coordinates::<D>(kinds, seed + 50, 0.08, gap));
        let undeformed = reference.then_some(&undeformed[..kinds[0].nodes()]);
        let nodes = z.len() / D;
        let fields = [3, 4].map(|more| vectors::<D>(&scatter(nodes * D, seed + more)));
        let direction: Vec<f64> = scatter(z.len(), seed + 7).iter().map(|d| 1e-3 * d).collect();
        let range = (if tangent == 0.0 { RANGE } else { WIDE }, normal_of);
        let f = |z: &[f64]| with_pair_in(range, kinds, z, undeformed, plane, |pair| values(pair, &fields));
        let df = |z: &[f64], d: &[f64]| {
            with_pair_in(range, kinds, z, undeformed, plane, |pair| change(pair, &fields, &vectors(d)))
        };
        let rate = taylor_rate(f, df, &z, &direction);
        let place = format!("{kinds:?}, seed {seed}, gap {gap}, tangent {tangent}, {normal_of:?}");
        assert!(rate > 1.9, "{place}: rate {rate}");
    }
}

/// Area, gap, normal and slips of every vertex match their variations, for every pair of facets and
/// both measures, in contact and in the fading range, and where the facets hardly face each other.
#[test]
fn integrals_move_as_their_variations_say() {
    for (reference, place) in [
        (false, (-0.05, 0.0)),
        (true, (-0.05, 0.0)),
        (false, (0.45, 0.0)),
        (true, (0.45, 0.0)),
        (false, (-0.45, 0.0)),
        (false, (-0.05, 2.4)),
        (true, (-0.05, -2.4)),
    ] {
        for &plane in planes(2) {
            all_pairs(&LINES).into_iter().for_each(|kinds| varies::<2>(kinds, reference, place, plane));
        }
        all_pairs(&FACES)
            .into_iter()
            .for_each(|kinds| varies::<3>(kinds, reference, place, PlaneState::Strain));
    }
}

/// The weight of the angle between two facets is 1 up to 60 degrees and 0 from 90 degrees on.
#[test]
fn upright_facets_have_no_weight() {
    let area = |tangent: f64| {
        let kinds = [ElementKind::Line2; 2];
        let mut z = coordinates::<2>(kinds, 1, 0.0, 0.0);
        tilt::<2>(kinds, &mut z, tangent);
        with_pair_in::<2, _>((WIDE, NormalOf::Contactor), kinds, &z, None, PlaneState::Strain, |pair| {
            let sums = pair.integrate(&mut PairWorkspace::default()).expect("they overlap");
            let sides = [(kinds[0], pair.contactor.nodes), (kinds[1], pair.target.nodes())];
            (pair_facing(sides).expect("they face each other"), sums.cover)
        })
    };
    // The contactor reaches from -1 to 1, the target from -0.6 to 1.4.
    for tangent in [0.0, 1.0, 1.73] {
        let (facing, cover) = area(tangent);
        assert!(facing.part == 1.0 && facing.by_nodes.is_none());
        assert!((cover - 1.6).abs() < 1e-14, "{cover}");
    }
    let (facing, cover) = area(4.0);
    // With s = cos(atan(4)) / 0.5.
    let s = 2.0 / 17.0_f64.sqrt();
    let part = s * s * (3.0 - 2.0 * s);
    assert!((facing.part - part).abs() < 1e-14);
    assert!((cover - 1.6 * part).abs() < 1e-14, "{cover}");
    let weights = [1.0, 0.0, -0.3].map(|cosine| crate::contact::mortar::facing::facing(cosine).0);
    assert_eq!(weights, [1.0, 0.0, 0.0]);
}

/// Integrals over an obstacle match their variations, on the deformed and on the undeformed area, in the plane and in
/// axisymmetry.
#[test]
fn integrals_over_an_obstacle_move_as_their_variations_say() {
    let disc = crate::contact::obstacle::Sphere::new(
        Vector::<2>::new(0.2, -1.0),
        0.9,
        crate::contact::obstacle::Side::Outside,
    );
    for kind in LINES {
        for (&plane, reference) in planes(2).iter().flat_map(|plane| [(plane, false), (plane, true)]) {
            let z = coordinates::<2>([kind, kind], 3, 0.04, 0.0)[..2 * kind.nodes()].to_vec();
            let undeformed = vectors::<2>(&z.iter().map(|x| 0.9 * x + 2.0).collect::<Vec<_>>());
            let fields = [3, 4].map(|seed| vectors::<2>(&scatter(z.len(), seed)));
            let with = |z: &[f64], then: &dyn Fn(&FacetPair<'_, 2>) -> Vec<f64>| {
                let nodes = vectors::<2>(z);
                let rule = super::super::obstacle::rule_of(&disc, kind, plane);
                then(&FacetPair {
                    contactor: PlacedFacet { kind, nodes: &nodes },
                    target: Opposite::Obstacle(PlacedObstacle { obstacle: &disc, rule }),
                    measure: if reference {
                        AreaMeasure::Reference(&undeformed)
                    } else {
                        AreaMeasure::Current
                    },
                    range: RANGE,
                    across: AcrossPlane { plane, origin: 1.5 },
                    normal_of: NormalOf::Contactor,
                })
            };
            let f = |z: &[f64]| with(z, &|pair| values(pair, &fields));
            let df = |z: &[f64], d: &[f64]| with(z, &|pair| change(pair, &fields, &vectors(d)));
            let direction: Vec<f64> = scatter(z.len(), 7).iter().map(|d| 1e-3 * d).collect();
            let rate = taylor_rate(f, df, &z, &direction);
            assert!(rate > 1.9, "{kind} {plane:?} {reference}: rate {rate}");
        }
    }
}

/// A pressure on a cone acts on the area of the ring: its nodal forces have the axial sum of the pressure.
#[test]
fn pressures_act_on_rings() {
    let z = [0.5, 0.0, 2.0, 1.0, 2.3, 1.2, 0.2, -0.2];
    let carried = [Carried { normal: 3.0, friction: Vector::zeros() }; MOST_CORNERS];
    let force = with_pair([ElementKind::Line2; 2], &z, None, PlaneState::Axisymmetric, |pair| {
        force::<2>(pair, &carried)
    });
    let axial = force[1] + force[3];
    // The contactor's outward normal is to the right of its direction. Radii are 1.5 larger.
    let ring = std::f64::consts::PI * (3.5_f64.powi(2) - 2.0_f64.powi(2));
    assert!((axial / (3.0 * ring) - 1.0).abs() < 1e-12, "{axial}");
}

fn force<const D: usize>(pair: &FacetPair<'_, D>, carried: &[Carried<D>; MOST_CORNERS]) -> Vec<f64> {
    let sums = pair.integrate(&mut PairWorkspace::default()).expect("they overlap");
    let mut force = vec![0.0; pair.nodes() * D];
    for (vertex, carried) in sums.vertices.iter().zip(carried).take(pair.contactor.kind.corners()) {
        for (a, force) in force.chunks_exact_mut(D).enumerate() {
            let nodal = vertex.pushes[a] * carried.normal + carried.friction * vertex.coefficients[a];
            force.iter_mut().zip(nodal.iter()).for_each(|(f, n)| *f += n);
        }
    }
    force
}

fn tractions<const D: usize>(seed: u32) -> [Carried<D>; MOST_CORNERS] {
    std::array::from_fn(|vertex| {
        let random = scatter(D + 1, seed + vertex as u32);
        Carried { normal: 1.5 + random[D], friction: Vector::from_column_slice(&random[..D]) }
    })
}

fn forces_vary<const D: usize>(kinds: [ElementKind; 2], reference: bool, plane: PlaneState) {
    for (seed, normal_of) in
        (0..5).flat_map(|seed| [NormalOf::Contactor, NormalOf::Target].map(|of| (seed, of)))
    {
        let setting = (RANGE, normal_of);
        let z = coordinates::<D>(kinds, seed, 0.08, -0.05);
        let undeformed = vectors::<D>(&coordinates::<D>(kinds, seed + 50, 0.08, -0.05));
        let undeformed = reference.then_some(&undeformed[..kinds[0].nodes()]);
        let carried = tractions::<D>(seed);
        let direction: Vec<f64> = scatter(z.len(), seed + 7).iter().map(|d| 1e-3 * d).collect();
        let f = |z: &[f64]| with_pair_in(setting, kinds, z, undeformed, plane, |pair| force(pair, &carried));
        let df = |z: &[f64], d: &[f64]| {
            let mut stiffness = vec![0.0; z.len() * z.len()];
            let frozen = FrozenFacet {
                carried,
                changes: FrozenChanges { under_pressure: true, under_friction: true, area: true },
                ..FrozenFacet::default()
            };
            with_pair_in(setting, kinds, z, undeformed, plane, |pair| {
                pair.add_frozen(&frozen, &mut stiffness, &mut PairWorkspace::default())
            });
            let nodes = z.len() / D;
            let entry = |row: usize, column: usize| {
                stiffness[((row / D * nodes + column / D) * D + row % D) * D + column % D]
            };
            (0..z.len())
                .map(|row| -(0..z.len()).map(|column| entry(row, column) * d[column]).sum::<f64>())
                .collect()
        };
        let rate = taylor_rate(f, df, &z, &direction);
        assert!(rate > 1.9, "{kinds:?}, seed {seed}, {normal_of:?}: rate {rate}");
    }
}

/// Forces of frozen tractions match their geometric stiffness, for every pair of facets and both
/// measures.
#[test]
fn forces_move_as_their_stiffness_says() {
    for reference in [false, true] {
        for &plane in planes(2) {
            all_pairs(&LINES).into_iter().for_each(|kinds| forces_vary::<2>(kinds, reference, plane));
        }
        all_pairs(&FACES)
            .into_iter()
            .for_each(|kinds| forces_vary::<3>(kinds, reference, PlaneState::Strain));
    }
}

fn resultants<const D: usize>(kinds: [ElementKind; 2]) -> [f64; 2] {
    let mut worst = [0.0_f64; 2];
    for seed in 0..5 {
        let z = coordinates::<D>(kinds, seed, 0.08, -0.05);
        let mut carried = tractions::<D>(seed);
        carried.iter_mut().for_each(|carried| carried.friction = Vector::zeros());
        let nodes = vectors::<D>(&z);
        let forces =
            vectors::<D>(&with_pair(kinds, &z, None, PlaneState::Strain, |pair| force(pair, &carried)));
        let total: Vector<D> = forces.iter().sum();
        let size: f64 = forces.iter().map(|f| f.norm()).sum();
        let moment =
            nodes.iter().zip(&forces).map(|(x, f)| x * f.transpose() - f * x.transpose()).sum::<Tensor<D>>();
        worst = [worst[0].max(total.norm() / size), worst[1].max(moment.amax() / size)];
    }
    worst
}

/// Forces have no resultant. Pressures have no moment if points are paired along the normal: on
/// straight lines and on triangles. On bent facets the chord between the points leaves a small
/// moment, proportional to the bend times the gap.
#[test]
fn pressures_have_neither_resultant_nor_moment() {
    for kinds in all_pairs(&LINES) {
        let [resultant, moment] = resultants::<2>(kinds);
        assert!(resultant < 1e-14, "{kinds:?}: {resultant:e}");
        let bound =
            if kinds[0] == ElementKind::Line2 && kinds[1] == ElementKind::Line2 { 1e-14 } else { 2e-2 };
        assert!(moment < bound, "{kinds:?}: {moment:e}");
    }
    for kinds in all_pairs(&FACES) {
        let [resultant, moment] = resultants::<3>(kinds);
        assert!(resultant < 1e-14, "{kinds:?}: {resultant:e}");
        let bound = if kinds == [ElementKind::Tri3; 2] { 1e-14 } else { 3e-2 };
        assert!(moment < bound, "{kinds:?}: {moment:e}");
    }
}

/// Weights sum to one: over a target that covers a flat contactor completely, a uniform pressure
/// gives the consistent nodal loads.
#[test]
fn a_uniform_pressure_gives_consistent_loads() {
    for kinds in all_pairs(&FACES) {
        let mut z = coordinates::<3>(kinds, 0, 0.0, -0.01);
        for y in z[3 * kinds[0].nodes()..].chunks_exact_mut(3) {
            y[0] = 60.0 * (y[0] - 0.45);
            y[1] = 60.0 * (y[1] - 0.25);
        }
        let carried = [Carried { normal: 2.0, friction: Vector::zeros() }; MOST_CORNERS];
        let force = with_pair(kinds, &z, None, PlaneState::Strain, |pair| force::<3>(pair, &carried));
        let element = crate::space::reference(kinds[0]);
        let rule = element.rule(4);
        let table = element.tabulate(&rule);
        let nodes = kinds[0].nodes();
        for a in 0..nodes {
            let exact: f64 = (0..rule.len()).map(|q| rule.weights[q] * table.n[q * nodes + a]).sum();
            assert!((force[3 * a + 2] + 2.0 * exact).abs() < 1e-13, "{kinds:?} {a}: {}", force[3 * a + 2]);
            assert!(force[3 * a].abs() + force[3 * a + 1].abs() < 1e-15);
        }
    }
}

/// The largest difference between the matrix of the potential and the derivative of the gradient of the
/// weighted gaps, relative to the largest entry.
fn potential_error<const D: usize>(
    kinds: [ElementKind; 2],
    z: &[f64],
    undeformed: Option<&[Vector<D>]>,
) -> f64 {
    let (pressures, size) = ([0.7, 1.3, -0.4, 0.9], z.len());
    let range = (if undeformed.is_some() { WIDE } else { RANGE }, NormalOf::Contactor);
    let gradient = |z: &[f64]| {
        with_pair_in(range, kinds, z, undeformed, PlaneState::Strain, |pair| {
            let mut all = vec![0.0; size];
            let none = vec![Vector::zeros(); pair.nodes()];
            pair.vary(
                &PairFields { fields: [&none, &none] },
                WantedVariations::default(),
                None,
                &mut PairWorkspace::default(),
                |vertex, node, by: &VertexVariation<D>| {
                    let entries = all[node * D..].iter_mut().zip(by.gap.iter());
                    entries.for_each(|(all, gap)| *all += pressures[vertex] * gap);
                },
            );
            all
        })
    };
    let mut stiffness = vec![0.0; size * size];
    let potential = pressures.map(|pressure| VertexPotential { pressure, ..VertexPotential::default() });
    let frozen = FrozenFacet::<D> { potential, ..FrozenFacet::default() };
    with_pair_in(range, kinds, z, undeformed, PlaneState::Strain, |pair| {
        pair.add_frozen(&frozen, &mut stiffness, &mut PairWorkspace::default())
    });
    let nodes = size / D;
    // Small, because the weight of open points fades by the square of the gap.
    let step = 1e-8;
    let (mut error, mut scale) = (0.0_f64, 0.0_f64);
    for column in 0..size {
        let moved = |by: f64| {
            let mut z = z.to_vec();
            z[column] += by;
            gradient(&z)
        };
        let (plus, minus) = (moved(step), moved(-step));
        for row in 0..size {
            let slope = (plus[row] - minus[row]) / (2.0 * step);
            let place = ((row / D * nodes + column / D) * D + row % D) * D + column % D;
            error = error.max((slope + stiffness[place]).abs());
            scale = scale.max(slope.abs());
        }
    }
    error / scale
}

/// The matrix of the potential is the derivative of its gradient for every pair of flat facets that touch.
#[test]
fn the_potential_has_the_hessian_of_its_gradient() {
    fn check<const D: usize>(kinds: [ElementKind; 2]) {
        let error = potential_error::<D>(kinds, &coordinates::<D>(kinds, 3, 0.0, 0.0), None);
        assert!(error < 1e-6, "{kinds:?}: {error:e}");
    }
    all_pairs(&LINES).into_iter().for_each(check::<2>);
    all_pairs(&FACES).into_iter().for_each(check::<3>);
}

/// Over a target at an angle, at fixed coordinates of the points on a linear facet, only products of gap and
/// angle are left out, of order 2 in the angle if the sides meet. The area does not vary here: the contactor's facet is covered as a whole, and the area is
/// the undeformed one.
#[test]
fn the_potential_knows_the_angle_between_the_sides() {
    let kinds = [ElementKind::Line2; 2];
    let error = |tangent: f64| {
        let mut z = coordinates::<2>(kinds, 3, 0.0, 0.0);
        z[4..].chunks_exact_mut(2).for_each(|place| place[0] = 0.2 + 3.0 * (place[0] - 0.2));
        let undeformed = vectors::<2>(&z[..4]);
        tilt::<2>(kinds, &mut z, tangent);
        potential_error::<2>(kinds, &z, Some(&undeformed))
    };
    let errors = [0.04, 0.02].map(error);
    assert!(errors[0] < 1e-3 && errors[0] > 3.8 * errors[1], "{errors:?}");
}

/// Derivatives of area, weighted gap and normal at each vertex.
fn derivatives(kinds: [ElementKind; 2], z: &[f64], fixed_places: bool) -> Vec<f64> {
    let mut all = Vec::new();
    with_pair::<3, _>(kinds, z, None, PlaneState::Strain, |pair| {
        let none = vec![Vector::zeros(); pair.nodes()];
        let varying = WantedVariations { normal: true, fixed_places, ..WantedVariations::default() };
        let fields = PairFields { fields: [&none, &none] };
        pair.vary(&fields, varying, None, &mut PairWorkspace::default(), |_, _, by| {
            all.extend(by.area.iter().chain(&by.gap).chain(&by.normal));
        });
    });
    all
}

/// Integrals of derivatives are the derivatives of the sums over points: to rounding on flat facets and to
/// the error of the quadrature on bent ones.
#[test]
fn derivatives_at_fixed_places_are_those_of_the_sums() {
    for kinds in all_pairs(&FACES) {
        for (bend, bound) in [(0.0, 1e-12), (0.02, 2e-2)] {
            let z = coordinates::<3>(kinds, 3, bend, -0.01);
            let [sums, fixed] = [false, true].map(|fixed| derivatives(kinds, &z, fixed));
            let apart = sums.iter().zip(&fixed).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < bound, "{kinds:?} {bend}: {apart:e}");
            assert!(bend == 0.0 || apart > 0.0);
        }
    }
}

/// Where an edge of the target crosses one of the contactor at a small angle and close to a corner, the
/// corners of the overlap move fast along the edges. Derivatives at fixed places do not depend on that.
#[test]
fn nearly_parallel_edges_keep_derivatives_at_fixed_places() {
    let kinds = [ElementKind::Quad4; 2];
    let turned = |angle: f64| {
        let mut z: Vec<f64> = [[-1.0, -1.0, 0.02], [1.0, -1.0, 0.0], [1.0, 1.0, 0.02], [-1.0, 1.0, 0.0]]
            .into_iter()
            .flatten()
            .collect();
        // Its side at y = 1 crosses that of the contactor at x = 0.9.
        for [x, y, up] in [[-1.3, 1.0, -0.03], [0.95, 1.0, -0.01], [0.8, -1.4, -0.02], [-1.2, -1.5, -0.01]] {
            let lift = if y > 0.0 { angle * (x - 0.9) } else { 0.0 };
            z.extend([x, y - lift, up]);
        }
        z
    };
    let found = [1e-6, 1e-7, 1e-8].map(|angle| derivatives(kinds, &turned(angle), true));
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart(&found[1], &found[2]) < 1e-6, "{:e}", apart(&found[1], &found[2]));
    assert!(apart(&found[0], &found[2]) < 1e-5, "{:e}", apart(&found[0], &found[2]));
    let sums = derivatives(kinds, &turned(1e-8), false);
    assert!(apart(&sums, &found[2]) > 1e-3, "{:e}", apart(&sums, &found[2]));
}
