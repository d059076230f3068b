//! Candidates and search trees.

use std::ops::Range;

use curionav_planning::arbitration::{Place, Previous};
use curionav_planning::candidates::CandidateSet;
use curionav_planning::generation::Tree;
use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::states::{Columns, States};
use curionav_planning::trajectory::Trajectory;
use curionav_schemas::{self as wire, F64Array, Refusal, Reject, TypedSlice};

/// Candidates.
pub fn candidates(c: wire::CandidateSet) -> Result<CandidateSet, Reject> {
    let states = States { x: c.x.0, y: c.y.0, heading: c.heading.0, v: c.v.0, omega: c.omega.0 };
    CandidateSet::new(c.steps as usize, c.dt, c.id.0, states)
        .map_err(|e| Refusal::invalid(e).at("candidates"))
}

/// Candidates.
pub fn candidates_to_wire(c: &CandidateSet) -> wire::CandidateSet {
    let States { x, y, heading, v, omega } = c.all_states().clone();
    wire::CandidateSet {
        count: c.len() as u32,
        steps: c.steps() as u32,
        dt: c.dt(),
        id: c.id().into(),
        x: x.into(),
        y: y.into(),
        heading: heading.into(),
        v: v.into(),
        omega: omega.into(),
    }
}

/// Candidates for `term`, which reads `columns` of them; the others are left out.
pub fn shard(c: wire::CandidateShard, term: &str, columns: Columns) -> Result<CandidateSet, Reject> {
    let read = |name: &str, is_read: bool, column: Option<F64Array>| match (is_read, column) {
        (false, _) => Ok(Vec::new()),
        (true, Some(column)) => Ok(column.0),
        (true, None) => {
            let detail = format!("is missing, and the term `{term}` reads it");
            Err(Refusal::WrongStructure { detail }.at(format!("candidates.{name}")))
        }
    };
    let states = States {
        heading: read("heading", columns.heading, c.heading)?,
        v: read("v", columns.v, c.v)?,
        omega: read("omega", columns.omega, c.omega)?,
        x: c.x.0,
        y: c.y.0,
    };
    CandidateSet::of_columns(columns, c.steps as usize, c.dt, c.id.0, states)
        .map_err(|e| Refusal::invalid(e).at("candidates"))
}

/// `columns` of candidates `range` alone, which must know them.
pub fn shard_to_wire(
    c: &CandidateSet,
    range: Range<usize>,
    columns: Columns,
) -> wire::CandidateShardSlices<'_> {
    let states = range.start * c.steps()..range.end * c.steps();
    fn of<'a>(column: &'a [f64], states: &Range<usize>) -> TypedSlice<'a, f64> {
        TypedSlice(&column[states.clone()])
    }
    let all = c.all_states();
    wire::CandidateShard {
        count: range.len() as u32,
        steps: c.steps() as u32,
        dt: c.dt(),
        id: TypedSlice(&c.id()[range]),
        x: of(&all.x, &states),
        y: of(&all.y, &states),
        heading: columns.heading.then(|| of(&all.heading, &states)),
        v: columns.v.then(|| of(&all.v, &states)),
        omega: columns.omega.then(|| of(&all.omega, &states)),
    }
}

/// What `decision`, made from `belief`, asks the robot to drive.
pub fn trajectory(decision: &wire::Decision, belief: &wire::Belief) -> Result<Trajectory, Reject> {
    let pose = Pose2::new(belief.x, belief.y, belief.heading);
    let wire::Decision { x, y, heading, v, omega, .. } = decision.clone();
    let states = States { x: x.0, y: y.0, heading: heading.0, v: v.0, omega: omega.0 };
    Trajectory::new((pose, Twist { v: belief.v, omega: belief.omega }), decision.dt, states)
        .map_err(|e| Refusal::invalid(e).at("decision"))
}

/// A place that the robot has not left.
pub fn place(p: wire::Place) -> Place {
    Place { position: Point2::new(p.x, p.y), since: p.since }
}

/// A place that the robot has not left.
pub fn place_to_wire(p: Place) -> wire::Place {
    wire::Place { x: p.position.x, y: p.position.y, since: p.since }
}

/// The trajectory that an earlier cycle has chosen.
pub fn previous(p: wire::Previous) -> Result<Previous, Reject> {
    let knots = States { x: p.x.0, y: p.y.0, heading: p.heading.0, v: p.v.0, omega: p.omega.0 };
    let trajectory = Trajectory::through(&knots, p.dt).map_err(|e| Refusal::invalid(e).at("previous"))?;
    Ok(Previous { trajectory, candidate: p.candidate, stamp: p.stamp, valid_for: p.valid_for_s })
}

/// The trajectory that an earlier cycle has chosen.
pub fn previous_to_wire(p: &Previous) -> wire::Previous {
    let knots = p.trajectory.knots();
    wire::Previous {
        candidate: p.candidate,
        stamp: p.stamp,
        valid_for_s: p.valid_for,
        dt: p.trajectory.dt(),
        x: knots.x.into(),
        y: knots.y.into(),
        heading: knots.heading.into(),
        v: knots.v.into(),
        omega: knots.omega.into(),
    }
}

/// A search tree; the schema has checked that its parents exist and form no cycle.
pub fn tree(t: wire::Tree) -> Tree {
    Tree {
        parent: t.parent.0,
        columns: t.columns.into_iter().map(|(name, numbers)| (name, numbers.0)).collect(),
    }
}

/// A search tree.
pub fn tree_to_wire(t: Tree) -> wire::Tree {
    wire::Tree {
        parent: t.parent.into(),
        columns: t.columns.into_iter().map(|(name, numbers)| (name, numbers.into())).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_schemas::Message;

    #[test]
    fn every_kind_of_tree_crosses_the_wire_unchanged() {
        let one = Tree::new(vec![Tree::NO_PARENT, 0], [("x", vec![1.0, 1.5]), ("y", vec![2.0, 1.0 / 3.0])]);
        let two = Tree::new(vec![Tree::NO_PARENT, 0, Tree::NO_PARENT], [("root", vec![0.1, 1.0 / 3.0])]);
        let none = Tree::new(Vec::new(), [("goal", vec![9.0, 7.0, 3.0])]);
        for sent in [Tree::default(), one, two, none] {
            let bytes = tree_to_wire(sent.clone()).encode();
            let arrived = tree(wire::Tree::decode(&bytes, None).expect("a valid tree"));
            assert_eq!(arrived, sent);
            assert!(arrived.is_sound());
        }
    }
}
