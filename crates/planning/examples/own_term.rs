//! A cost term of one's own: how far a candidate stays below a comfortable distance from walls.
//!
//! `cargo run --release -p curionav-planning --example own_term`

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

use std::sync::Arc;

use curionav_planning::arbitration::{Scores, total_costs};
use curionav_planning::candidates::CandidateSet;
use curionav_planning::evaluation::{Costs, Evaluator, each};
use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::nalgebra::Matrix3;
use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
use curionav_planning::parameters;
use curionav_planning::profile::{Profile, Term};
use curionav_planning::scene::{Belief, People, Scene};
use curionav_planning::states::{Columns, States};
use curionav_planning::terms::{Built, BuiltIn, DerivedFields, Task};

parameters! {
    /// Parameters of `clearance`.
    pub struct ClearanceParams {
        /// Distance from walls that costs nothing, metres.
        pub comfort: f64 [0.0, 10.0, "m", "beyond it no wall is near"] = 1.5,
    }
}

/// Term `clearance`: the metres missing to `comfort`, summed over the states.
struct ClearanceEvaluator {
    map: Arc<StaticMap>,
    params: ClearanceParams,
}

impl Evaluator for ClearanceEvaluator {
    fn evaluate(&self, _: &Scene, candidates: &CandidateSet, should_stop: &dyn Fn() -> bool) -> Costs {
        let missing = |i: usize| {
            let p = candidates.all_states().position(i);
            (self.params.comfort - self.map.to_obstacle.at(&self.map.grid, p)).max(0.0)
        };
        each(candidates, should_stop, |c| candidates.range(c).map(missing).sum())
    }
}

/// What the registry of terms, `crates/planning/src/terms/built_in.rs`, lists.
enum Clearance {}

impl BuiltIn for Clearance {
    const NAME: &'static str = "clearance";
    // No service evaluates it: the arbiter does.
    const LOCAL: bool = true;
    const COLUMNS: Columns = Columns::POSITIONS;
    type Params = ClearanceParams;

    // Inside the crate: `profile.clearance.clone()`.
    fn params(_: &Profile) -> ClearanceParams {
        ClearanceParams::default()
    }

    fn evaluator<F: DerivedFields>(params: ClearanceParams, _: &Task, fields: &F) -> Built<F::Error> {
        Ok(Arc::new(ClearanceEvaluator { map: fields.map()?, params }))
    }
}

/// Straight ways along a corridor of 10 m by 4 m, each `y` metres from its lower wall.
fn ways(ys: &[f64]) -> Result<CandidateSet, Box<dyn std::error::Error>> {
    let mut states = States::default();
    for &y in ys {
        for k in 1..=13 {
            states.push(Pose2::new(1.0 + 0.3 * f64::from(k), y, 0.0), Twist { v: 1.0, omega: 0.0 });
        }
    }
    Ok(CandidateSet::new(13, 0.3, (0..ys.len() as u32).collect(), states)?)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let cells = (0..100 * 40).map(|i| if [0, 39].contains(&(i / 100)) { 100 } else { 0 }).collect();
    let map = Arc::new(StaticMap::new(OccupancyGrid::new(100, 40, 0.1, Pose2::default(), cells)?));
    let belief = Belief {
        pose: Pose2::new(1.0, 2.0, 0.0),
        covariance: Matrix3::from_diagonal_element(0.01),
        twist: Twist::default(),
    };
    let scene = Scene::new(belief, People::default());
    let candidates = ways(&[0.5, 1.0, 2.0])?;

    let mut profile = Profile::default();
    profile.terms.clear();
    // 0.5 m below comfort, in every state, costs one.
    profile.terms.insert(Clearance::NAME.to_owned(), Term::new(0.5, 1.0));
    let evaluator = Clearance::evaluator(Clearance::params(&profile), &Task::default(), &map)?;
    let mut scores = Scores::new(candidates.len());
    scores.insert(Clearance::NAME, 0, &evaluator.evaluate(&scene, &candidates, &|| false)?)?;
    let totals = total_costs(&profile, &scene, candidates.steps(), &scores);
    for (index, total) in totals.total.iter().enumerate() {
        println!(
            "{:.1} m from the wall costs {:.2}",
            candidates.all_states().y[13 * index],
            total.ok_or("not scored")?
        );
    }
    if !totals.total.is_sorted_by(|a, b| a > b) {
        return Err("more room should cost less".into());
    }
    Ok(())
}

#[test]
fn more_room_costs_less() {
    main().unwrap();
}
