//! State of the points of one contact: the iterate, the history of accepted steps, and the
//! safeguards of Newton's method. Clone it to roll back.

use std::ops::AddAssign;

use super::damping::ActiveDamping;
use super::friction::traction::Branch;
use super::held::FrozenTractions;
pub use super::held::Keep;
use super::history::History;
use super::linearised::{GapLinearisation, GapNode, LinearGaps};
use super::multipliers::Multipliers;
use super::point::{Frozen, Manner, PointState, Status};
use super::rigid::{BodyFrame, TargetLoad};
use crate::tensor::{Tensor, Vector};

/// Changes of the points between two iterates. Sum them over contacts and ranks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Changes {
    /// Closed points.
    pub closed: usize,
    /// Closed points that do more than touch, see [`PointState::presses`].
    pub pressing: usize,
    /// Points whose status differs from that of the last iterate.
    pub changed: usize,
    /// Points whose slip direction reversed, for which the next correction therefore assumes stick.
    pub flipped: usize,
    /// Points whose normal law is open and closed at the linearised gap, or the opposite. The next
    /// correction assumes the latter.
    pub departed: usize,
}

impl AddAssign for Changes {
    fn add_assign(&mut self, other: Self) {
        self.closed += other.closed;
        self.pressing += other.pressing;
        self.changed += other.changed;
        self.flipped += other.flipped;
        self.departed += other.departed;
    }
}

/// Quantities that a stage of the solution holds fixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Hold {
    /// Nothing: the monolithic balance.
    #[default]
    Nothing,
    /// Friction is switched off, for the static start.
    Frictionless,
    /// Stage I (3.6): the friction bound.
    Bound,
    /// Stage II (3.7): the friction bound and the normal tractions.
    BoundAndPressure,
    /// Stage I, variant: the friction traction itself.
    FrictionTraction,
}

/// Sums of squares of the point forces `A t` \[N^2\]. Sum them over contacts and ranks.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SquaredForceChange {
    /// Change of the friction force since it was frozen.
    pub friction: f64,
    /// Normal force.
    pub normal: f64,
}

impl AddAssign for SquaredForceChange {
    fn add_assign(&mut self, other: Self) {
        self.friction += other.friction;
        self.normal += other.normal;
    }
}

/// Branches of the laws in an evaluation: open or closed, stick or slip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Branches {
    /// Branches that follow from gap and slip, as in the equilibrium.
    #[default]
    Actual,
    /// For the right side of the next correction: stick at points whose slip direction reversed, and
    /// the tangents of the laws at the linearised gaps, continued to the gaps.
    Predicted,
    /// As [`Predicted`](Self::Predicted), for its matrix: the laws at the linearised gaps. Points that
    /// were open in the last linear solve have stiffness, but no tractions.
    Linearised,
}

/// Part of the bound that friction has along its next direction, below which a stick state is assumed in
/// between: the cosine of the rotation, if it was on the bound. A slip branch is flat along the slip, and
/// in 3D it is stiff across the slip only for slow slip.
const TURN: f64 = 0.5;

/// Recent iterates of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Track<const D: usize> {
    /// Status in the last iterate, if there was one.
    status: Option<Status>,
    /// No linear solve of this solve is done yet.
    fresh: bool,
    friction_traction: Vector<D>,
    /// The slip direction reversed: the next correction assumes stick.
    flipped: bool,
    /// Whether the point had stiffness in the linear solve after the last iterate of this attempt and
    /// in that after the one before, also of another solve.
    closed: [Option<bool>; 2],
    /// Gap of the last evaluation by linearisation \[m\], if it is known.
    linear_gap: Option<f64>,
    /// The normal law is closed at the linearised gap of the last iterate, or at its gap if none is known.
    predicted_closed: bool,
    /// In the last iterate the normal law is open and predicted closed, or the opposite.
    departs: bool,
}

impl<const D: usize> Track<D> {
    /// The point slips, and in the last iterate it slipped in a direction more than [`TURN`] away.
    /// In the plane this is the opposite direction.
    fn reversed(&self, point: &PointState<D>) -> bool {
        let last = &self.friction_traction;
        self.status == Some(Status::Slip) && slips_off(last, last.norm(), point)
    }

    /// In the first guess of an attempt the point slips against the friction at the end of the last step, or
    /// from stick far below the bound. An error of the guess above the stick velocity has this effect, and so
    /// does a target that changes its velocity. A point that truly reverses passes through stick, and one
    /// that begins to slip passes through friction near the bound.
    fn is_thrown_off(&self, history: &History<D>, point: &PointState<D>) -> bool {
        let History { friction_traction: last, bound, .. } = history;
        self.closed[0].is_none() && *bound > 0.0 && slips_off(last, *bound, point)
    }
}

/// The point slips, and along its traction the `last` one has less than [`TURN`] of the last `bound`.
fn slips_off<const D: usize>(last: &Vector<D>, bound: f64, point: &PointState<D>) -> bool {
    let now = &point.friction_traction;
    point.status == Status::Slip && last.dot(now) < TURN * bound * now.norm()
}

impl<const D: usize> Default for Track<D> {
    fn default() -> Self {
        Self {
            status: None,
            fresh: true,
            friction_traction: Vector::zeros(),
            flipped: false,
            closed: [None; 2],
            linear_gap: None,
            predicted_closed: false,
            departs: false,
        }
    }
}

/// State of all points of one contact on this rank.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactState<const D: usize> {
    /// Points at the last evaluation.
    pub current: Vec<PointState<D>>,
    /// Memory of the accepted steps.
    pub history: Vec<History<D>>,
    track: Vec<Track<D>>,
    linear_gaps: GapLinearisation<D>,
    /// Empty until a freeze: only staggered solves hold tractions.
    held: Vec<FrozenTractions<D>>,
    /// Multipliers of the augmented laws.
    pub(super) multipliers: Multipliers<D>,
    /// Initial gaps that are treated as zero \[m\]; empty if no gap was adjusted.
    adjusted: Vec<f64>,
    /// Gaps of this size are rounding \[m\].
    touching: f64,
    /// Load on a moving rigid target at the last evaluation of the forces; zero for other targets.
    pub load: TargetLoad<D>,
}

impl<const D: usize> ContactState<D> {
    /// This number of open points without history.
    pub fn new(points: usize) -> Self {
        Self {
            current: vec![PointState::default(); points],
            history: vec![History::default(); points],
            track: vec![Track::default(); points],
            linear_gaps: GapLinearisation::default(),
            held: Vec::new(),
            multipliers: Multipliers::default(),
            adjusted: Vec::new(),
            touching: 0.0,
            load: TargetLoad::default(),
        }
    }

    /// The state as seen from the frame of a moving target.
    pub fn seen_from(&self, frame: &BodyFrame<D>) -> Self {
        let mut seen = self.clone();
        let [from_start, from_end] = [frame.at_start(), frame.at_end()].map(Tensor::transpose);
        for history in &mut seen.history {
            history.friction_traction = from_start * history.friction_traction;
            history.normal = from_start * history.normal;
            history.damping_traction = from_start * history.damping_traction;
            history.elastic_slip = from_start * history.elastic_slip;
        }
        seen.multipliers.friction.iter_mut().for_each(|multiplier| *multiplier = from_start * *multiplier);
        seen.held.iter_mut().for_each(|held| held.friction_traction = from_end * held.friction_traction);
        seen
    }

    /// Takes over the points of a state that was evaluated in the frame of a moving target.
    pub fn adopt(&mut self, frame: &BodyFrame<D>, seen: Self) {
        (self.current, self.track, self.linear_gaps) = (seen.current, seen.track, seen.linear_gaps);
        let [at_start, to_space] = [frame.at_start(), frame.at_end()];
        for point in &mut self.current {
            point.traction_at_start = at_start * point.traction_at_start;
            for vector in [
                &mut point.normal,
                &mut point.friction_traction,
                &mut point.viscous_traction,
                &mut point.slip_velocity,
                &mut point.slip_increment,
                &mut point.elastic_slip,
            ] {
                *vector = to_space * *vector;
            }
        }
    }

    /// Sets the precision of the positions \[m\]. Gaps of this size count as rounding.
    pub fn round_gaps(&mut self, known: f64) {
        self.touching = known;
    }

    /// Treats the gaps at the last evaluation as zero from now on. This applies to points that
    /// penetrate and to points at most `apart` from their target \[m\], if their facets face it.
    pub fn adjust(&mut self, apart: f64) {
        let touches = |point: &PointState<D>| point.area > 0.0 && point.gap <= apart;
        let gap = |point: &PointState<D>| if touches(point) { point.gap } else { 0.0 };
        self.adjusted = self.current.iter().map(gap).collect();
    }

    /// The initial gap of point `p` that is treated as zero \[m\].
    pub fn adjusted(&self, p: usize) -> f64 {
        self.adjusted.get(p).copied().unwrap_or(0.0)
    }

    /// Depth of the deepest point below its target \[m\], including its initial overclosure; zero
    /// if no point penetrates.
    pub fn depth(&self) -> f64 {
        let depth = |(p, point): (usize, &PointState<D>)| -(point.gap + self.adjusted(p));
        self.current.iter().enumerate().map(depth).fold(0.0, f64::max)
    }

    /// Discards iterates and safeguards. Call it at the beginning of an attempt, whose linearised gaps are
    /// first those at the end of the last step. Points that were open then have none.
    pub fn begin_attempt(&mut self) {
        self.track.fill(Track::default());
        let gap = |p| self.ended_closed(p).then_some(self.history[p].gap);
        let gaps = LinearGaps::constant((0..self.history.len()).map(gap));
        self.linear_gaps.use_gaps(gaps);
    }

    /// Discards iterates and safeguards, except which points were closed. Call it at the beginning of a
    /// solve.
    pub fn begin(&mut self) {
        for track in &mut self.track {
            *track = Track { closed: track.closed, ..Track::default() };
        }
    }

    /// Stores the linear gaps of the points at a tangent.
    pub fn note_linear_gaps(&mut self, gaps: LinearGaps<D>) {
        self.linear_gaps.note(gaps);
    }

    /// From now on, tangents have the gaps linearised at the last tangent, if there was one since the
    /// last call.
    pub fn linearise_gaps(&mut self) {
        self.linear_gaps.advance();
    }

    /// Tangents have the gaps of the positions again.
    pub fn forget_linear_gaps(&mut self) {
        self.linear_gaps.clear();
    }

    /// Nodes on which linear gaps depend. A node is named once for each gap.
    pub fn gap_nodes(&self) -> impl Iterator<Item = &GapNode<D>> {
        self.linear_gaps.nodes()
    }

    /// Follows nodes to their new indices.
    pub fn renumber(&mut self, new: impl Fn(u32) -> u32) {
        self.linear_gaps.renumber(new);
    }

    /// The gap of point `p` by linearisation \[m\] at these places of the nodes, if it is known.
    pub fn linear_gap(&mut self, p: usize, place: impl Fn(&GapNode<D>) -> Vector<D>) -> Option<f64> {
        let gap = self.linear_gaps.at(p, place);
        self.track[p].linear_gap = gap;
        gap
    }

    /// Point `p` has no target, and so no gap.
    pub fn forget_linear_gap(&mut self, p: usize) {
        let track = &mut self.track[p];
        *track = Track { linear_gap: None, predicted_closed: false, departs: false, ..*track };
    }

    /// Notes whether the normal law of point `p` is closed at its gap, and at the linearised one if it is
    /// known.
    pub fn note_closed(&mut self, p: usize, closed: bool, predicted: Option<bool>) {
        let track = &mut self.track[p];
        track.predicted_closed = predicted.unwrap_or(closed);
        track.departs = track.predicted_closed != closed;
    }

    /// Whether point `p` was closed in the last linear solve; before the first one of an attempt, at
    /// the end of the last step.
    pub fn was_closed(&self, p: usize) -> bool {
        self.track[p].closed[1].unwrap_or_else(|| self.ended_closed(p))
    }

    /// Whether point `p` had a target at the end of the last step, and its normal law is closed at the gap
    /// there.
    fn ended_closed(&self, p: usize) -> bool {
        let history = &self.history[p];
        history.normal.amax() > 0.0 && history.gap - self.offset(p) <= self.touching
    }

    /// Gap at which the normal law of point `p` closes \[m\].
    fn offset(&self, p: usize) -> f64 {
        self.multipliers.offsets.get(p).copied().unwrap_or(0.0)
    }

    /// Compares the current points with the last iterate and stores them as the new one. At points
    /// whose slip reversed, the next correction assumes stick.
    ///
    /// Call it once per Newton iteration, after the evaluation whose tangent comes next.
    pub fn iterate(&mut self) -> Changes {
        let mut changes = Changes::default();
        let points = self.current.iter().zip(&self.history);
        for (track, (point, history)) in self.track.iter_mut().zip(points) {
            let last = track.status;
            let changed = last.is_some_and(|last| last != point.status);
            // A point that was corrected from stick and still slips has truly reversed, or the correction was
            // shortened.
            let flipped = !track.flipped && track.reversed(point) || track.is_thrown_off(history, point);
            changes.closed += usize::from(point.is_closed());
            changes.pressing += usize::from(point.presses);
            changes.changed += usize::from(changed);
            changes.flipped += usize::from(flipped);
            changes.departed += usize::from(track.departs);
            *track = Track {
                status: Some(point.status),
                fresh: last.is_none(),
                friction_traction: point.friction_traction,
                flipped,
                closed: [Some(track.predicted_closed), track.closed[0]],
                ..*track
            };
        }
        changes
    }

    /// Stores tractions for [`Hold`]. A point that is evaluated under a held bound reports that
    /// bound: evaluate with [`Hold::Nothing`] before you store the pressure.
    pub fn freeze(&mut self, keep: Keep) {
        self.held.resize(self.current.len(), FrozenTractions::default());
        let points = self.current.iter().zip(&self.history);
        for (held, (point, history)) in self.held.iter_mut().zip(points) {
            *held = held.kept(keep, point, history);
        }
    }

    /// Difference between the forces of the points and the frozen ones.
    pub fn force_change(&self) -> SquaredForceChange {
        let mut sum = SquaredForceChange::default();
        for (p, point) in self.current.iter().enumerate() {
            let held = self.held.get(p).copied().unwrap_or_default();
            let change = point.friction_traction - held.friction_traction;
            sum.friction += (point.area * change).norm_squared();
            sum.normal += (point.area * point.normal_traction).powi(2);
        }
        sum
    }

    /// Writes the current points to the history when a step of length `dt` \[s\] is accepted.
    pub fn accept(&mut self, dt: f64) {
        for (history, point) in self.history.iter_mut().zip(&self.current) {
            *history = history.advance(point, dt);
        }
        self.begin_attempt();
    }

    /// Names of the numbers of a point that its evaluation reads, in the order of
    /// [`evaluated_from`](Self::evaluated_from).
    pub fn evaluation_names() -> Vec<String> {
        let own = ["offset", "flipped", "fresh", "was_closed", "linear_gap", "held_pressure", "held_bound"]
            .map(str::to_owned);
        let axes =
            |name: &'static str| ["x", "y", "z"].iter().take(D).map(move |axis| format!("{name}_{axis}"));
        let vectors = axes("held_friction").chain(axes("friction_multiplier"));
        History::<D>::names().into_iter().chain(own).chain(vectors).collect()
    }

    /// Number of [`evaluation_names`](Self::evaluation_names).
    pub const EVALUATION_COLUMNS: usize = History::<D>::COLUMNS + 7 + 2 * D;

    /// What the evaluation of all points reads, point by point.
    pub fn evaluated_from(&self) -> Vec<f64> {
        let mut all = Vec::with_capacity(Self::EVALUATION_COLUMNS * self.history.len());
        for (p, (history, track)) in self.history.iter().zip(&self.track).enumerate() {
            let held = self.held.get(p).copied().unwrap_or_default();
            let offset = self.offset(p);
            history.columns(&mut all);
            let flags =
                [track.flipped, track.fresh, self.was_closed(p)].map(|flag| f64::from(u8::from(flag)));
            all.push(offset);
            all.extend(flags);
            all.push(track.linear_gap.unwrap_or(f64::INFINITY));
            all.extend([held.normal_traction, held.bound]);
            all.extend(held.friction_traction.iter());
            all.extend(self.multipliers.friction.get(p).copied().unwrap_or_else(Vector::zeros).iter());
        }
        all
    }

    /// Restores what [`evaluated_from`](Self::evaluated_from) returned. Returns `false` if the
    /// number of points differs.
    pub fn evaluate_from(&mut self, points: &[f64]) -> bool {
        let width = Self::EVALUATION_COLUMNS;
        if points.len() != width * self.history.len() {
            return false;
        }
        self.held.resize(self.history.len(), FrozenTractions::default());
        for (p, point) in points.chunks_exact(width).enumerate() {
            let (history, own) = point.split_at(History::<D>::COLUMNS);
            let Some(history) = History::from_columns(history) else { return false };
            self.history[p] = history;
            if let Some(offset) = self.multipliers.offsets.get_mut(p) {
                *offset = own[0];
            }
            let [flipped, fresh] = [own[1], own[2]].map(|flag| flag != 0.0);
            let closed = [Some(own[3] != 0.0); 2];
            self.track[p] = Track { flipped, fresh, closed, ..Track::default() };
            let (held, multiplier) = own[7..].split_at(D);
            self.held[p] = FrozenTractions::held(own[5], own[6], Vector::from_column_slice(held));
            if let Some(friction) = self.multipliers.friction.get_mut(p) {
                *friction = Vector::from_column_slice(multiplier);
            }
        }
        let linear_gap = |point: &[f64]| {
            let gap = point[History::<D>::COLUMNS + 4];
            gap.is_finite().then_some(gap)
        };
        self.linear_gaps.use_gaps(LinearGaps::constant(points.chunks_exact(width).map(linear_gap)));
        true
    }

    /// Restores the history of a point. The point begins the next step where it ended the last one.
    pub fn resume(&mut self, p: usize, history: History<D>) {
        let History { gap, bound, friction_traction, normal, .. } = history;
        self.current[p] = PointState { gap, bound, friction_traction, normal, ..PointState::default() };
        self.history[p] = history;
        self.track[p] = Track::default();
        if let Some(multiplier) = self.multipliers.friction.get_mut(p) {
            *multiplier = friction_traction;
        }
    }

    /// Evaluation options of point `p`.
    pub fn manner(&self, p: usize, hold: Hold, branches: Branches) -> Manner<D> {
        let held = self.held.get(p).copied().unwrap_or_default();
        let nothing = Frozen::default();
        let frozen = match hold {
            Hold::Nothing => nothing,
            Hold::Frictionless => Frozen::frictionless(),
            Hold::Bound => Frozen { bound: Some(held.bound), ..nothing },
            Hold::BoundAndPressure => {
                Frozen { bound: Some(held.bound), normal_traction: Some(held.normal_traction), ..nothing }
            }
            Hold::FrictionTraction => Frozen { friction_traction: Some(held.friction_traction), ..nothing },
        };
        let predicted = branches != Branches::Actual && self.track[p].flipped;
        let branch = if predicted { Branch::Stick } else { Branch::Actual };
        let offset = self.offset(p);
        let fresh = self.track[p].fresh;
        let multiplier = self.multipliers.friction.get(p).copied();
        let (touching, damping) = (self.touching, ActiveDamping::Whole);
        Manner { branch, frozen, offset, multiplier, touching, fresh, damping }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slipping(direction: f64) -> PointState<2> {
        PointState {
            status: Status::Slip,
            friction_traction: Vector::<2>::new(direction, 0.0),
            ..PointState::default()
        }
    }

    fn open() -> PointState<2> {
        PointState::default()
    }

    /// A point with a target.
    fn covered() -> PointState<2> {
        PointState { normal: Vector::<2>::y(), ..open() }
    }

    /// After a reversal of the slip direction only the next correction assumes stick.
    #[test]
    fn flips_predict_stick_once() {
        let mut state = ContactState::<2>::new(1);
        state.current[0] = slipping(1.0);
        assert_eq!(state.iterate().flipped, 0);
        state.current[0] = slipping(-1.0);
        assert_eq!(state.iterate().flipped, 1);
        assert_eq!(state.manner(0, Hold::Nothing, Branches::Predicted).branch, Branch::Stick);
        assert_eq!(state.manner(0, Hold::Nothing, Branches::Actual).branch, Branch::Actual);
        state.iterate();
        assert_eq!(state.manner(0, Hold::Nothing, Branches::Predicted).branch, Branch::Actual);
    }

    /// A first guess of an attempt that slips against the friction of the last step is corrected from stick,
    /// and so is one that slips from friction far below the bound, whatever its sign. A guess that continues
    /// the slip is not, nor is the guess of a point that was open.
    #[test]
    fn first_guesses_that_turn_predict_stick() {
        let mut state = ContactState::<2>::new(5);
        let last = [0.2, 0.8, 0.0, 1e-9, -1e-9];
        state.current = last.map(slipping).to_vec();
        state.current.iter_mut().for_each(|point| point.bound = 1.0);
        state.current[2] = open();
        state.accept(1e-3);
        state.current = [-1.0, 1.0, -1.0, 1.0, 1.0].map(slipping).to_vec();
        assert_eq!(state.iterate().flipped, 3);
        let branch = |p| state.manner(p, Hold::Nothing, Branches::Predicted).branch;
        let stick = [true, false, false, true, true];
        assert_eq!([0, 1, 2, 3, 4].map(|p| branch(p) == Branch::Stick), stick);
        state.current = [1.0, 1.0, -1.0, 1.0, 1.0].map(slipping).to_vec();
        assert_eq!(state.iterate().flipped, 0, "stick was tried");
        state.begin();
        state.current = [-1.0, 1.0, -1.0, 1.0, 1.0].map(slipping).to_vec();
        assert_eq!(state.iterate().flipped, 0, "a later solve begins with a solution, not with a guess");
    }

    /// Points that open or close between two iterates are counted.
    #[test]
    fn changes_are_counted() {
        let mut state = ContactState::<2>::new(2);
        let mut next = |first, second| {
            state.current = vec![first, second];
            let changes = state.iterate();
            (changes.closed, changes.changed)
        };
        assert_eq!(next(open(), open()), (0, 0));
        assert_eq!(next(slipping(1.0), open()), (1, 1));
        assert_eq!(next(open(), slipping(1.0)), (1, 2));
        assert_eq!(next(open(), slipping(1.0)), (1, 0));
    }

    /// Which points were closed is known across the solves of a step, and from the history at its start.
    #[test]
    fn closed_points_are_known_from_the_iterate_before() {
        let mut state = ContactState::<2>::new(2);
        let was_closed = |state: &ContactState<2>| [0, 1].map(|p| state.was_closed(p));
        let iterate = |state: &mut ContactState<2>, closed: [bool; 2], predicted: [Option<bool>; 2]| {
            [0, 1].into_iter().for_each(|p| state.note_closed(p, closed[p], predicted[p]));
            state.iterate();
            was_closed(state)
        };
        assert_eq!(was_closed(&state), [false, false]);
        assert_eq!(iterate(&mut state, [true, false], [None; 2]), [false, false]);
        state.begin();
        assert_eq!(iterate(&mut state, [false, true], [Some(false), Some(false)]), [true, false]);
        // At the linearised gaps the laws of the last matrix were open.
        assert_eq!(iterate(&mut state, [true, true], [None; 2]), [false, false]);
        state.current = vec![PointState { gap: -0.1, ..covered() }, open()];
        state.accept(1e-3);
        assert_eq!(was_closed(&state), [true, false]);
        assert_eq!(iterate(&mut state, [false, true], [None; 2]), [true, false]);
        assert_eq!(iterate(&mut state, [false, true], [None; 2]), [false, true]);
    }

    /// The linearised gaps of an attempt begin at the end of the last step, at points that were closed there.
    #[test]
    fn attempts_begin_with_the_gaps_of_the_last_step() {
        let mut state = ContactState::<2>::new(5);
        let at = |gap| PointState { gap, ..covered() };
        let uncovered = PointState { normal: Vector::<2>::zeros(), ..at(-0.3) };
        state.current = vec![at(-0.1), at(0.2), open(), uncovered, at(-0.1)];
        // The multiplier of the last point opens its law at this gap.
        state.augment(crate::contact::multipliers::MultiplierSource::Carried);
        state.multipliers.offsets[4] = -0.2;
        state.accept(1e-3);
        state.begin();
        let gaps = |state: &mut ContactState<2>| -> Vec<Option<f64>> {
            (0..5).map(|p| state.linear_gap(p, |node| node.place)).collect()
        };
        let begun = [Some(-0.1), None, None, None, None];
        assert_eq!(gaps(&mut state), begun);
        let next = [None, Some(0.5), None, None, None];
        state.note_linear_gaps(LinearGaps::constant(next.into_iter()));
        state.linearise_gaps();
        assert_eq!(gaps(&mut state), next);
        state.begin_attempt();
        assert_eq!(gaps(&mut state), begun);
        state.forget_linear_gaps();
        assert_eq!(gaps(&mut state), [None; 5]);
    }

    /// A clone taken before a step restores the whole state.
    #[test]
    fn rolls_back_as_one_struct() {
        let mut state = ContactState::<2>::new(1);
        let saved = state.clone();
        state.current[0] = slipping(1.0);
        state.iterate();
        state.freeze(Keep::Pressure);
        state.accept(1e-3);
        assert_ne!(state, saved);
        state.clone_from(&saved);
        assert_eq!(state, saved);
    }

    /// A point is evaluated in the same way after its state was stored and restored.
    #[test]
    fn what_an_evaluation_reads_comes_back() {
        let mut state = ContactState::<2>::new(2);
        state.augment(crate::contact::multipliers::MultiplierSource::Carried);
        state.current = vec![slipping(1.0), PointState { bound: 2.0, normal_traction: 3.0, ..slipping(0.5) }];
        state.accept(1e-3);
        state.freeze(Keep::LastStep);
        state.freeze(Keep::Pressure);
        state.current[0] = slipping(1.0);
        state.iterate();
        state.current[0] = slipping(-1.0);
        state.iterate();
        state.multipliers.offsets[1] = 0.25;
        state.augment_friction();
        state.multipliers.friction[0] = Vector::<2>::new(0.5, -1.5);
        state.note_linear_gaps(LinearGaps::constant([Some(-0.5), None].into_iter()));
        state.linearise_gaps();
        assert_eq!([0, 1].map(|p| state.linear_gap(p, |node| node.place)), [Some(-0.5), None]);
        let mut other = ContactState::<2>::new(2);
        other.augment_friction();
        other.augment(crate::contact::multipliers::MultiplierSource::Carried);
        let stored = state.evaluated_from();
        assert_eq!(ContactState::<2>::EVALUATION_COLUMNS, ContactState::<2>::evaluation_names().len());
        assert_eq!(stored.len(), 2 * ContactState::<2>::EVALUATION_COLUMNS);
        assert!(!other.evaluate_from(&stored[1..]) && other.evaluate_from(&stored));
        assert_eq!(other.history, state.history);
        for hold in [Hold::Nothing, Hold::Bound, Hold::BoundAndPressure, Hold::FrictionTraction] {
            for branches in [Branches::Actual, Branches::Predicted] {
                let manner = |state: &ContactState<2>, p| format!("{:?}", state.manner(p, hold, branches));
                assert!((0..2).all(|p| manner(&other, p) == manner(&state, p)), "{hold:?} {branches:?}");
            }
        }
        assert_eq!(other.manner(0, Hold::Nothing, Branches::Predicted).branch, Branch::Stick);
        for p in 0..2 {
            assert_eq!(other.was_closed(p), state.was_closed(p));
            assert_eq!(other.linear_gap(p, |node| node.place), state.linear_gap(p, |node| node.place));
        }
    }

    /// Held tractions are those of the last freeze, and each stage holds its own.
    #[test]
    fn stages_hold_what_was_frozen() {
        let mut state = ContactState::<2>::new(1);
        state.current[0] = PointState { normal_traction: 3.0, bound: 2.0, area: 0.5, ..slipping(1.0) };
        state.freeze(Keep::Pressure);
        assert_eq!(state.force_change(), SquaredForceChange { friction: 0.25, normal: 2.25 });
        state.freeze(Keep::Friction);
        assert_eq!(state.force_change().friction, 0.0);
        state.current[0] = open();
        let held = |hold| state.manner(0, hold, Branches::Actual).frozen;
        assert_eq!(held(Hold::Nothing), Frozen::default());
        assert_eq!((held(Hold::Bound).bound, held(Hold::Bound).normal_traction), (Some(2.0), None));
        assert_eq!(held(Hold::BoundAndPressure).normal_traction, Some(3.0));
        assert_eq!(held(Hold::FrictionTraction).friction_traction, Some(Vector::<2>::new(1.0, 0.0)));
        assert_eq!(held(Hold::Frictionless), Frozen::frictionless());
    }

    /// Bound and friction traction are relaxed from the previously held values; the pressure is not
    /// relaxed.
    #[test]
    fn what_is_held_goes_part_of_the_way() {
        let mut state = ContactState::<2>::new(1);
        let mut keep = |bound, friction, part| {
            state.current[0] = PointState { normal_traction: bound, bound, ..slipping(friction) };
            [Keep::Pressure, Keep::Friction, Keep::Part(part)]
                .into_iter()
                .for_each(|keep| state.freeze(keep));
            let held = state.manner(0, Hold::BoundAndPressure, Branches::Actual).frozen;
            let friction = state.manner(0, Hold::FrictionTraction, Branches::Actual).frozen.friction_traction;
            (held.normal_traction, held.bound, friction.map(|friction| friction.x))
        };
        assert_eq!(keep(2.0, -4.0, 1.0), (Some(2.0), Some(2.0), Some(-4.0)));
        assert_eq!(keep(6.0, 4.0, 0.25), (Some(6.0), Some(3.0), Some(-2.0)));
        assert_eq!(keep(5.0, 6.0, 0.5), (Some(5.0), Some(4.0), Some(2.0)));
    }

    /// A step begins with the values at the end of the last one, regardless of what a failed
    /// attempt has frozen.
    #[test]
    fn a_step_begins_with_the_last_one() {
        let mut state = ContactState::<2>::new(1);
        let accepted = PointState { normal_traction: 3.0, bound: 2.0, ..slipping(1.0) };
        state.current[0] = accepted;
        state.accept(1e-3);
        state.current[0] = PointState { bound: 7.0, ..slipping(-5.0) };
        state.freeze(Keep::Pressure);
        state.freeze(Keep::Friction);
        state.freeze(Keep::LastStep);
        let held = |hold| state.manner(0, hold, Branches::Actual).frozen;
        assert_eq!(held(Hold::Bound).bound, Some(2.0));
        assert_eq!(held(Hold::FrictionTraction).friction_traction, Some(accepted.friction_traction));
    }
}
