//! Checks of `time`, `start`, `solver` and `output`.

use super::super::{Contact, Line, Linear, Scheme, StageMatrix, Start, Strategy};
use super::Check;
use crate::reader::at::At;
use crate::reader::quantity::Length;
use crate::schemes::Static;

/// More steps than that are a slip of the pen: at a million a day they take three years.
const MOST_STEPS: f64 = 1e9;

/// The same for increments of a load, each of which is a nonlinear solve of its own.
const MOST_INCREMENTS: u32 = 1_000_000;

impl Check<'_> {
    pub(super) fn time(&mut self) {
        let time = &self.case.time;
        self.found.positive("the end", time.end);
        if let Some(step) = time.step {
            self.found.positive("the step", step);
            let message = format!("the step {} is longer than the end time {}", step.value, time.end.value);
            self.found.require(step.value <= time.end.value || time.end.value <= 0.0, step.place, message);
            let steps = time.end.value / step.value;
            let endless = step.value > 0.0 && steps > MOST_STEPS;
            self.found.require(
                !endless,
                step.place,
                format!("the run would take {steps:.1e} steps, more than {MOST_STEPS:e}"),
            );
        }
        self.found.require(
            time.cuts.value <= 30,
            time.cuts.place,
            format!("a step can be halved 30 times at most, not {}", time.cuts.value),
        );
        time.scheme.law().check(&mut self.found);
        if let Scheme::Static(Static { increments }) = &time.scheme.value {
            self.increments(increments.as_ref());
        }
        if time.step.is_none() && !self.case.is_static() {
            self.found.say(time.end.place, "the key 'step' is missing in addition to 'end'");
        }
    }

    fn increments(&mut self, increments: Option<&At<u32>>) {
        let time = &self.case.time;
        match (time.step, increments) {
            (Some(_), Some(increments)) => {
                self.found.say(increments.place, "statics takes 'step' or 'increments', not both")
            }
            (None, None) => {
                self.found.say(
                    time.scheme.place,
                    "the static scheme needs 'increments', or 'step' in addition to 'end'",
                );
                self.found.cure("write for example scheme: { static: { increments: 4 } }");
            }
            (None, Some(increments)) => {
                self.at_least_one("'increments'", increments);
                self.at_most("increments", increments);
            }
            (Some(_), None) => {}
        }
    }

    fn at_most(&mut self, what: &str, count: &At<u32>) {
        let message = format!("{what} must be at most {MOST_INCREMENTS}, found {}", count.value);
        self.found.require(count.value <= MOST_INCREMENTS, count.place, message);
    }

    pub(super) fn start(&mut self) {
        let Some(start) = &self.case.start else { return };
        if self.case.is_static() {
            self.found.say(
                start.place,
                "a static case has no `start`: it begins undeformed and computes an equilibrium",
            );
            self.found.cure("remove `start`");
        }
        if let Start::Equilibrium { increments, .. } = start.value {
            self.found.require(increments > 0, start.place, "the equilibrium needs at least one increment");
            self.at_most("increments", &At { value: increments, place: start.place });
        }
    }

    pub(super) fn solver(&mut self) {
        let (newton, krylov) = (&self.case.solver.newton, &self.case.solver.krylov);
        let given = newton.tolerance.map(|tolerance| ("Newton", tolerance));
        for (what, tolerance) in given.into_iter().chain([("Krylov", krylov.tolerance)]) {
            let fits = tolerance.value > 0.0 && tolerance.value < 1.0;
            let message = format!("the {what} tolerance must be > 0 and < 1, found {}", tolerance.value);
            self.found.require(fits, tolerance.place, message);
        }
        self.at_least_one("'max_iterations'", &newton.max_iterations);
        self.strategy();
        self.conserving();
        let linear = &self.case.solver.linear;
        let rubs = |contact: &Contact| contact.friction.rubs();
        let friction = self.case.contact.values().any(rubs);
        let in_turn = self.case.solver.strategy.value != Strategy::Monolithic;
        if matches!(linear.value, Linear::TwoStage { .. }) {
            if in_turn {
                self.found.say(
                    linear.place,
                    "two_stage requires the monolithic strategy, because it makes the stages of the \
                     staggered strategy itself",
                );
                self.found.cure("write `linear: auto`");
            } else if !friction {
                self.found
                    .say(linear.place, "two_stage solves friction separately, but no contact has friction");
                self.found.cure("write `linear: auto`");
            }
        }
        let is_symmetric = match &self.case.solver.strategy.value {
            Strategy::Monolithic => !friction,
            Strategy::Staggered { matrix, .. } => !friction || *matrix == StageMatrix::Symmetric,
        };
        if linear.needs_symmetry() && !is_symmetric {
            self.found.say(
                linear.place,
                "this linear solver needs a symmetric matrix, but friction makes it non-symmetric",
            );
            self.found.cure(match in_turn {
                true => "write `linear: auto`, or a GMRES preset, or direct, or `matrix: symmetric`",
                false => "write `linear: auto`, or a GMRES preset, or direct, or `strategy: staggered`",
            });
        }
    }

    /// Forces that conserve over a step have a matrix of their own kind.
    fn conserving(&mut self) {
        let solver = &self.case.solver;
        if self.case.time.scheme.value.conserves() && solver.strategy.value != Strategy::Monolithic {
            self.found.say(
                solver.strategy.place,
                "the conserving scheme solves normal contact and friction together in each step",
            );
            self.found.cure("remove `strategy`; the default is monolithic");
        } else if solver.linear.needs_symmetry() && self.case.has_unsymmetric_steps() {
            self.found.say(
                solver.linear.place,
                "this linear solver needs a symmetric matrix, but that of the conserving scheme is \
                 non-symmetric",
            );
            self.found.cure("write `linear: auto`, a GMRES preset, or direct");
        }
    }

    pub(super) fn guard(&mut self) {
        if let Some(motion) = self.case.guard.motion {
            self.found.positive("the motion guard", motion);
        }
        if let Some(energy) = self.case.guard.energy {
            self.found.require(
                energy.value > 0.0 && energy.value.is_finite(),
                energy.place,
                format!("the energy guard must be > 0, found {}", energy.value),
            );
            if self.case.is_static() {
                self.found.say(energy.place, "the energy guard applies to dynamics, but this case is static");
                self.found.cure("remove `energy`");
            }
        }
    }

    fn strategy(&mut self) {
        let Strategy::Staggered { tolerance, max_sweeps, .. } = &self.case.solver.strategy.value else {
            return;
        };
        let fits = tolerance.value > 0.0 && tolerance.value < 1.0;
        let message = format!("the tolerance of the sweeps must be > 0 and < 1, found {}", tolerance.value);
        self.found.require(fits, tolerance.place, message);
        self.at_least_one("'max_sweeps'", max_sweeps);
    }

    /// A line has two ends and a number of points, or neither.
    fn segment(&mut self, line: &Line) {
        match (&line.to, line.points) {
            (Some(to), Some(points)) => {
                self.size("an end of a line", to);
                let values = |end: &At<Vec<Length>>| end.iter().map(|x| x.value).collect::<Vec<_>>();
                let apart = values(&line.from) != values(to);
                self.found.require(apart, to.place, "both ends of the line are the same point");
                let fits = (2..=10_000).contains(&points.value);
                let message = format!("'points' must be from 2 to 10000, found {}", points.value);
                self.found.require(fits, points.place, message);
            }
            (Some(to), None) => {
                self.found.say(to.place, "the number of points of the line is missing");
                self.found.cure("add for example `points: 21`, or remove `to` for a single point");
            }
            (None, Some(points)) => {
                self.found.say(points.place, "the last point of the line is missing");
                self.found.cure("add `to`, or remove `points` for a single point");
            }
            (None, None) => {}
        }
    }

    pub(super) fn output(&mut self) {
        let output = &self.case.output;
        if let Some(checkpoint) = &output.checkpoint {
            self.at_least_one("'every'", &checkpoint.every);
            self.at_least_one("'keep'", &checkpoint.keep);
            checkpoint.wall_time.into_iter().for_each(|limit| self.found.positive("the wall time", limit));
        }
        for line in output.lines.values() {
            self.size("an end of a line", &line.from);
            self.segment(line);
            let Some(on) = &line.on else { continue };
            if self.body_of(on) {
                let whole = !on.contains('.');
                self.found.require(whole, on.place, "a line is placed in a body, not in one of its sets");
            }
        }
        for probe in output.probes.values() {
            self.size("the position of a probe", &probe.at);
            let Some(on) = &probe.on else { continue };
            if self.body_of(on) {
                self.found.require(
                    !on.contains('.'),
                    on.place,
                    "a probe is placed on a body, not on one of its sets",
                );
            }
        }
    }
}
