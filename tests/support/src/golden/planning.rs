//! Examples of what generators, evaluators, the arbiter and the driver exchange.

use super::{MAP, laser, odometry_noise, parameters, robot_model, scene};
use curionav_schemas::{
    Action, CandidateSet, CandidateShard, CommandReason, Crowd, CycleReport, Decision, Degradation,
    EvaluateRequest, Evaluated, F64Array, Footprint, GenerateReply, GenerateRequest, Memory, NO_PARENT,
    ObstacleCells, Place, Previous, PreviousState, Reason, RejectedCandidate, Rejection, Scores, TermReport,
    TermTime, Timings, Tree, Twist,
};
use std::collections::BTreeMap;

/// Two candidates of three states.
pub fn candidate_set() -> CandidateSet {
    CandidateSet {
        count: 2,
        steps: 3,
        dt: 0.3,
        id: vec![4, 9].into(),
        x: vec![1.5, 1.7, 1.9, 1.5, 1.75, 2.0].into(),
        y: vec![-0.4, -0.4, -0.4, -0.4, -0.3, -0.25].into(),
        heading: vec![0.3, 0.3, 0.3, 0.3, 0.25, 0.2].into(),
        v: vec![0.7, 0.7, 0.7, 0.8, 0.85, 0.9].into(),
        omega: vec![0.0, 0.0, 0.0, -0.1, -0.15, -0.15].into(),
    }
}

/// A root with two children.
pub fn tree() -> Tree {
    Tree {
        parent: vec![NO_PARENT, 0, 0].into(),
        columns: columns([("x", vec![1.3, 2.0, 2.2]), ("y", vec![-0.45, -0.3, 0.1])]),
    }
}

/// What a generator that searches from both ends sends: two roots.
pub fn tree_of_two_roots() -> Tree {
    Tree {
        parent: vec![NO_PARENT, 0, NO_PARENT].into(),
        columns: columns([
            ("found", vec![0.0]),
            ("omega", vec![-0.1, 0.0, 0.0]),
            ("risk", vec![0.0]),
            ("root", vec![1.3, -0.45, 0.31, 4.2, 8.0, 6.5, -2.34, 0.0]),
            ("v", vec![0.8, 0.85, 0.0]),
        ]),
    }
}

fn columns<const N: usize>(columns: [(&str, Vec<f64>); N]) -> BTreeMap<String, F64Array> {
    columns.map(|(name, numbers)| (name.to_owned(), numbers.into())).into()
}

/// A request that hands back a tree.
pub fn generate_request() -> GenerateRequest {
    GenerateRequest {
        epoch: 2,
        seq: 14,
        budget_ms: 120,
        map: MAP,
        goal_x: 8.0,
        goal_y: 6.5,
        scene: scene(),
        tree: Some(tree()),
        seed: 0x0123_4567_89ab_cdef,
        iterations: 400,
        generator: "rrt-star".into(),
        robot_model: robot_model(Footprint::Disc { radius: 0.3 }),
        laser: laser(),
        params: parameters(&[("goal_bias", 0.1.into())]),
    }
}

/// The answer with two candidates.
pub fn generate_reply() -> GenerateReply {
    GenerateReply {
        epoch: 2,
        seq: 14,
        instance: "generator-0".into(),
        candidates: candidate_set(),
        tree: tree(),
        elapsed_us: 5_210,
        cut: false,
    }
}

/// The answer of one that ran out of time.
pub fn cut_generate_reply() -> GenerateReply {
    GenerateReply { cut: true, ..generate_reply() }
}

/// A shard of two candidates.
pub fn evaluate_request() -> EvaluateRequest {
    EvaluateRequest {
        epoch: 2,
        seq: 14,
        shard: 1,
        budget_ms: 80,
        map: MAP,
        goal_x: 8.0,
        goal_y: 6.5,
        laser: laser(),
        robot_model: robot_model(Footprint::Disc { radius: 0.3 }),
        odometry_noise: odometry_noise(),
        scene: scene(),
        candidates: candidate_set().into(),
        params: parameters(&[("stride", 4.into())]),
    }
}

/// The same for a term that reads positions alone.
pub fn evaluate_request_of_positions() -> EvaluateRequest {
    let candidates = CandidateShard { heading: None, v: None, omega: None, ..candidate_set().into() };
    EvaluateRequest { candidates, ..evaluate_request() }
}

/// Costs of two candidates.
pub fn scores() -> Scores {
    Scores {
        epoch: 2,
        seq: 14,
        shard: 1,
        term: "cpc".into(),
        instance: "cpc-1".into(),
        cost: vec![0.42, 0.37].into(),
        elapsed_us: 830,
        slots: 2,
    }
}

/// A decision to follow candidate 9.
pub fn decision() -> Decision {
    Decision {
        epoch: 2,
        seq: 14,
        tick: 42,
        stamp: 4.2,
        valid_for_s: 1.2,
        action: Action::Follow,
        reason: Reason::LeastCost,
        arrived: false,
        candidate: Some(9),
        dt: 0.3,
        x: vec![1.5, 1.75, 2.0].into(),
        y: vec![-0.4, -0.3, -0.25].into(),
        heading: vec![0.3, 0.25, 0.2].into(),
        v: vec![0.8, 0.85, 0.9].into(),
        omega: vec![-0.1, -0.15, -0.15].into(),
        uncertainty: 0.09,
        uncertain: true,
        evaluated: BTreeMap::from([
            ("cnc".into(), Evaluated::Pool),
            ("cpc".into(), Evaluated::Local),
            ("distance".into(), Evaluated::Local),
        ]),
        degraded: vec![Degradation::EvaluatedLocally { term: "cpc".into() }],
        elapsed_us: 12_345,
    }
}

/// A decision to stop, without a trajectory.
pub fn stop() -> Decision {
    Decision {
        action: Action::Stop,
        reason: Reason::NoneFree { previous: PreviousState::Strayed { distance_m: 0.75 } },
        candidate: None,
        x: F64Array::default(),
        y: F64Array::default(),
        heading: F64Array::default(),
        v: F64Array::default(),
        omega: F64Array::default(),
        evaluated: BTreeMap::new(),
        ..decision()
    }
}

/// The command that begins to follow it.
pub fn twist() -> Twist {
    Twist {
        lease: 17,
        epoch: 2,
        seq: 14,
        tick: 42,
        stamp: 4.2,
        v: 0.8,
        omega: -0.1,
        reason: CommandReason::Tracking,
        since: 3.6,
    }
}

fn term(name: &str, scored: Vec<u32>, raw: Vec<f64>, evaluated: Evaluated) -> TermReport {
    let cost = raw.iter().map(|raw| raw * 2.0).collect();
    TermReport {
        term: name.into(),
        weight: 1.0,
        scale: 0.5,
        active: true,
        evaluated,
        scored: scored.into(),
        raw: raw.into(),
        cost,
        alone: None,
        without: None,
        doubled: None,
        halved: None,
    }
}

/// A cycle with three terms, in which one candidate was rejected and no other could have been followed.
pub fn cycle_report() -> CycleReport {
    CycleReport {
        robot: "r1".into(),
        epoch: 2,
        seq: 14,
        map: MAP,
        scene: scene(),
        candidates: candidate_set(),
        terms: vec![
            term("cnc", vec![0, 1], vec![0.11, 0.07], Evaluated::Pool),
            term("cpc", vec![0, 1], vec![0.42, 0.37], Evaluated::Local),
            TermReport { active: false, ..term("distance", vec![], vec![], Evaluated::None) },
        ],
        scored: vec![0, 1].into(),
        total: vec![1.06, 0.88].into(),
        rejected: vec![RejectedCandidate {
            candidate: 0,
            why: Rejection::HitsPerson { person: 7, after_s: 0.6 },
        }],
        chosen: Some(1),
        runner_up: None,
        margin: None,
        decision: decision(),
        timings: Timings {
            generate_us: 5_900,
            evaluate_us: vec![
                TermTime { term: "cnc".into(), us: 1_400 },
                TermTime { term: "cpc".into(), us: 2_100 },
            ],
            arbitrate_us: 310,
            total_us: 12_345,
        },
        crowds: vec![Crowd { x: 3.55, y: 0.15, sigma: 1.5, weight: 1.0, members: 2 }],
        obstacles: None,
        driven: None,
        gap: 0,
    }
}

/// The same with three candidates, of which one was not scored and two were close, and what each term had to say.
pub fn explained_cycle_report() -> CycleReport {
    let plain = cycle_report();
    let more = |array: F64Array, further: [f64; 3]| F64Array::from([array.0, further.to_vec()].concat());
    let pair = candidate_set();
    let candidates = CandidateSet {
        count: 3,
        id: vec![4, 9, 12].into(),
        x: more(pair.x, [1.5, 1.7, 1.9]),
        y: more(pair.y, [-0.4, -0.5, -0.6]),
        heading: more(pair.heading, [0.3, -0.1, -0.2]),
        v: more(pair.v, [0.7, 0.7, 0.7]),
        omega: more(pair.omega, [-0.1, -0.2, -0.1]),
        ..pair
    };
    CycleReport {
        candidates,
        terms: vec![
            TermReport {
                alone: Some(2),
                without: Some(1),
                doubled: Some(2),
                halved: Some(1),
                ..term("cnc", vec![0, 1, 2], vec![0.11, 0.07, 0.02], Evaluated::Pool)
            },
            TermReport {
                alone: Some(1),
                without: Some(2),
                doubled: Some(1),
                halved: Some(2),
                ..term("cpc", vec![1, 2], vec![0.37, 0.44], Evaluated::Local)
            },
            plain.terms[2].clone(),
        ],
        scored: vec![1, 2].into(),
        total: vec![0.88, 0.92].into(),
        rejected: vec![RejectedCandidate { candidate: 0, why: Rejection::NotScored { term: "cpc".into() } }],
        obstacles: Some(ObstacleCells {
            x: vec![1.525, 1.575].into(),
            y: vec![-0.925, -0.925].into(),
            heading: 0.0,
            side: 0.05,
            close_ways: false,
        }),
        driven: Some(Twist { seq: 13, tick: 41, stamp: 4.1, ..twist() }),
        runner_up: Some(2),
        margin: Some(0.04),
        ..plain
    }
}

/// What was carried into that cycle: a trajectory under way, one tree grown and one not yet.
pub fn memory() -> Memory {
    Memory {
        robot: "r1".into(),
        epoch: 2,
        seq: 14,
        run: 1,
        revision: 3,
        version: "0.1.0".into(),
        uncertain: true,
        members: vec![7, 11].into(),
        place: Some(Place { x: 1.25, y: -0.5, since: 3.6 }),
        region: Some(Place { x: 1.5, y: 2.25, since: 0.6 }),
        impatient_since: Some(3.6),
        unseen: Some(Place { x: 1.5, y: 0.25, since: 3.9 }),
        previous: Some(Previous {
            candidate: Some(3),
            stamp: 3.9,
            valid_for_s: 1.2,
            dt: 0.3,
            x: vec![1.25, 1.5].into(),
            y: vec![-0.5, -0.4].into(),
            heading: vec![0.3, 0.3].into(),
            v: vec![0.8, 0.8].into(),
            omega: vec![0.0, -0.1].into(),
        }),
        driven: Some(Twist { seq: 13, tick: 41, stamp: 4.1, ..twist() }),
        trees: vec![tree(), Tree::default()],
    }
}
