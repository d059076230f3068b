//! The planner, cycle by cycle.

use std::collections::BTreeMap;
use std::sync::Arc;

use curionav_mission::convert;
use curionav_planning::arbitration::{Scores, Verdict};
use curionav_planning::geometry::Point2;
use curionav_planning::motion::{OdometryNoise, RobotModel};
use curionav_planning::occupancy::{Obstacles, StaticMap};
use curionav_planning::planner::{Planner as Planning, PlannerError};
use curionav_planning::profile::Profile;
use curionav_planning::sensor::LaserModel;
use curionav_robot::arbiter::decision_message::decision;
use curionav_schemas::{self as wire, Belief, Evaluated, Message, People, Refusal, Reject, Value};
use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::fields::FIELDS;
use crate::refusal::{invalid, message, optional, part, refused};

/// Plans for one robot on one map.
#[pyclass]
pub(crate) struct Planner {
    map: Arc<StaticMap>,
    setup: Setup,
    planning: Planning,
    goal: Option<Point2>,
    cycles: u64,
}

/// What a planner is made from.
struct Setup {
    profile: Profile,
    robot: RobotModel,
    laser: LaserModel,
    noise: OdometryNoise,
    seed: u64,
}

impl Setup {
    fn planning(&self, map: &Arc<StaticMap>) -> Result<Planning, PlannerError> {
        let planning = Planning::new(Arc::clone(map), self.profile.clone(), self.robot.clone())?;
        Ok(planning.with_seed(self.seed).with_laser(self.laser).with_odometry_noise(self.noise))
    }
}

fn refusal(error: &PlannerError) -> Reject {
    let field = match error {
        PlannerError::GoalNotFree { .. } => "goal",
        PlannerError::Profile(_) | PlannerError::Course(_) | PlannerError::NoEvaluator { .. } => "profile",
    };
    Refusal::invalid(error).at(field)
}

/// Decision and candidates as bytes, raw costs by term, and totals, of NaN where there is none.
type Plan<'py> =
    (Bound<'py, PyBytes>, Bound<'py, PyBytes>, Bound<'py, PyDict>, Bound<'py, PyArray1<f64>>, bool);

#[pymethods]
impl Planner {
    /// Map, profile, robot, laser and noise as bytes.
    #[new]
    fn new(
        py: Python<'_>,
        map: &[u8],
        profile: &[u8],
        robot: Option<&[u8]>,
        laser: Option<&[u8]>,
        noise: Option<&[u8]>,
        seed: u64,
    ) -> PyResult<Self> {
        let grid = convert::occupancy_grid(message("map", map)?).map_err(|reject| refused(&reject))?;
        let profile: Value = part("profile", profile)?;
        let robot = optional("robot", robot)?.as_ref().map_or_else(Default::default, convert::robot_model);
        let laser = optional("laser", laser)?.as_ref().map_or_else(Default::default, convert::laser);
        let noise = optional("odometry_noise", noise)?.as_ref().map_or_else(Default::default, convert::noise);
        let made = py.detach(|| {
            let setup = Setup {
                profile: convert::parameters("profile", &profile)?,
                robot: convert::checked("robot", robot)?,
                laser: convert::checked("laser", laser)?,
                noise: convert::checked("odometry_noise", noise)?,
                seed,
            };
            let map = FIELDS.insert(grid);
            let planning = setup.planning(&map).map_err(|error| refusal(&error))?;
            Ok((map, setup, planning))
        });
        let (map, setup, planning) = made.map_err(|reject: Reject| refused(&reject))?;
        Ok(Self { map, setup, planning, goal: None, cycles: 0 })
    }

    /// Forgets goal, trees, obstacles and what was decided.
    fn reset(&mut self) -> PyResult<()> {
        let planning = self.setup.planning(&self.map).map_err(|error| refused(&refusal(&error)))?;
        self.planning = planning;
        self.goal = None;
        self.cycles = 0;
        Ok(())
    }

    /// Plans once, towards x, y and perhaps a heading.
    #[pyo3(signature = (stamp, belief, people, goal, obstacles=None))]
    fn plan<'py>(
        &mut self,
        py: Python<'py>,
        stamp: f64,
        belief: &[u8],
        people: &[u8],
        goal: (f64, f64, Option<f64>),
        obstacles: Option<PyReadonlyArray2<'py, f64>>,
    ) -> PyResult<Plan<'py>> {
        let belief: Belief = message("belief", belief)?;
        let people: People = message("people", people)?;
        let obstacles = obstacles.map(|places| points(&places)).transpose()?;
        let (x, y, goal_heading) = goal;
        let now = Now { stamp, belief, people, goal: Point2::new(x, y), goal_heading, obstacles };
        let planned = py.detach(|| self.planned(&now)).map_err(|reject| refused(&reject))?;
        let Planned { decision, candidates, scores, verdict, uncertain } = planned;
        let costs = PyDict::new(py);
        for (term, _) in self.setup.profile.active_terms(uncertain) {
            let of_term = (0..scores.len()).map(|i| scores.cost(term, i).unwrap_or(f64::NAN)).collect();
            costs.set_item(term, PyArray1::from_vec(py, of_term))?;
        }
        let total = verdict.totals.total.iter().map(|total| total.unwrap_or(f64::NAN)).collect();
        Ok((
            PyBytes::new(py, &decision.encode()),
            PyBytes::new(py, &candidates.encode()),
            costs,
            PyArray1::from_vec(py, total),
            uncertain,
        ))
    }
}

/// What a cycle is told.
struct Now {
    stamp: f64,
    belief: Belief,
    people: People,
    goal: Point2,
    goal_heading: Option<f64>,
    obstacles: Option<Vec<Point2>>,
}

/// What comes of a cycle.
struct Planned {
    decision: wire::Decision,
    candidates: wire::CandidateSet,
    scores: Scores,
    verdict: Verdict,
    uncertain: bool,
}

impl Planner {
    fn planned(&mut self, now: &Now) -> Result<Planned, Reject> {
        if self.goal != Some(now.goal) {
            self.planning.set_goal(now.goal).map_err(|error| refusal(&error))?;
            self.goal = Some(now.goal);
        }
        self.planning.set_goal_heading(now.goal_heading);
        if let Some(places) = &now.obstacles {
            let obstacles = Obstacles::at(places.iter().copied(), &self.map.grid);
            self.planning.set_obstacles(obstacles).map_err(Refusal::failed)?;
        }
        let belief = convert::belief(&now.belief);
        let people = convert::people_at(&now.people, &belief, now.stamp);
        let verdict = self.planning.cycle(belief, &people, now.stamp).map_err(Refusal::failed)?;
        self.cycles += 1;
        let cycle = self.planning.last().ok_or_else(|| Refusal::failed("nothing was planned"))?;
        let active = self.setup.profile.active_terms(cycle.scene.uncertain);
        let evaluated: BTreeMap<_, _> = active.map(|(term, _)| (term.to_owned(), Evaluated::Local)).collect();
        let id = (0, self.cycles);
        Ok(Planned {
            decision: decision(id, &cycle.scene, &verdict.decision, evaluated, Vec::new(), 0),
            candidates: convert::candidates_to_wire(&cycle.candidates),
            scores: cycle.scores.clone(),
            uncertain: cycle.scene.uncertain,
            verdict,
        })
    }
}

/// Rows of x and y.
fn points(places: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<Point2>> {
    let places = places.as_array();
    if places.ncols() != 2 {
        return Err(invalid("obstacles", format!("has {} columns; give x and y", places.ncols())));
    }
    Ok(places.rows().into_iter().map(|row| Point2::new(row[0], row[1])).collect())
}
