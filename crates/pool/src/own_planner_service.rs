//! A planner of one's own as a service: it answers as generators do, under a role of its own name.
//!
//! Each robot has a process of the planner to itself, because a planner may remember what it saw. A run of a robot
//! begins with the question that warms the service up, and whenever what stays the same on a run has changed.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use anyhow::Context;
use curionav_own_planner::{Attended, Description, Run, ScanView, Source};
use curionav_planning::candidates::CandidateSet;
use curionav_planning::generation::{GenerationInput, own};
use curionav_runtime::convert;
use curionav_runtime::fields::Fields;
use curionav_runtime::locked::locked;
use curionav_runtime::process::{Running, Start};
use curionav_runtime::serve::Asked;
use curionav_runtime::topic::Inbox;
use curionav_schemas::{
    GenerateReply, GenerateRequest, MapId, Refusal, Reject, RobotModel, Scan, Tree, keys,
};
use zenoh::Session;

use crate::generator::with_input;
use crate::pool_service;

/// Robots that one service plans for: each has a process.
const SEATS_MOST: usize = 16;

/// Serves the planner that `planner` names.
pub fn run(planner: String, start: Start<'_>) -> Running<'_> {
    Box::pin(serve(planner, start))
}

async fn serve(planner: String, start: Start<'_>) -> anyhow::Result<()> {
    let source = Source::parse(&planner)?
        .with_context(|| format!("planner: `{planner}` is a profile; give FILE.py:NAME or a program"))?;
    let of = source.clone();
    let description =
        tokio::task::spawn_blocking(move || Attended::start(of).map(|it| it.description().clone())).await??;
    let role = description.generator();
    let seats = Seats {
        instance: start.config.instance.clone(),
        session: start.session.clone(),
        source,
        description,
        seats: Mutex::default(),
    };
    let answer = move |fields: &Fields, request: GenerateRequest, asked: Asked<'_>| {
        let reply = seats.answer(fields, request, asked)?;
        Ok((reply.candidates.count as usize, reply))
    };
    let budget = |request: &GenerateRequest| {
        (request.iterations > 0).then(|| Duration::from_millis(request.budget_ms.into()))
    };
    pool_service::run(&role, "Candidates offered", start, budget, answer).await
}

/// The processes of all robots.
struct Seats {
    instance: String,
    session: Session,
    source: Source,
    description: Description,
    /// By robot.
    seats: Mutex<BTreeMap<String, Arc<Mutex<Seat>>>>,
}

/// The process of one robot.
struct Seat {
    attended: Attended,
    /// What stays the same on the run that it has begun.
    begun: Option<Need>,
    /// Of the newest question.
    tick: u64,
    scans: Option<Inbox<Scan>>,
    scan: Option<ScanView>,
}

/// What stays the same on a run.
#[derive(Debug, Clone, PartialEq)]
struct Need {
    map: MapId,
    goal: [f64; 2],
    robot: RobotModel,
    seed: u64,
    epoch: u64,
}

impl Need {
    fn of(request: &GenerateRequest) -> Self {
        Self {
            map: request.map,
            goal: [request.goal_x, request.goal_y],
            robot: request.robot_model.clone(),
            seed: request.seed,
            epoch: request.epoch,
        }
    }

    /// Whether a run that began with this goes on; the question that warms up says no epoch.
    fn goes_on(&self, request: &GenerateRequest) -> bool {
        let now = Self::of(request);
        *self == Self { epoch: self.epoch, ..now.clone() } && (self.epoch == 0 || self.epoch == now.epoch)
    }
}

impl Seats {
    fn answer(
        &self,
        fields: &Fields,
        request: GenerateRequest,
        asked: Asked<'_>,
    ) -> Result<GenerateReply, Reject> {
        let role = self.description.generator();
        if request.generator != role {
            return Err(Refusal::UnknownName { found: request.generator, known: vec![role] }.at("generator"));
        }
        let warms_up = request.iterations == 0;
        let budget = Duration::from_millis(request.budget_ms.into());
        let map = fields.map(request.map)?;
        let seat = self.seat(asked.name)?;
        let mut seat = locked(&seat);
        if !warms_up && asked.came.elapsed() >= budget {
            return Err(Refusal::Stopped.into());
        }
        seat.look();
        let began = asked.came.elapsed();
        let candidates = with_input(
            fields,
            &request,
            |_| {},
            |input| {
                let run = Run { robot: asked.name, map: &map.grid, seed: request.seed };
                own::within_zones(input, |input| seat.ask(&run, input, &request, budget, asked))
            },
        )??;
        Ok(GenerateReply {
            epoch: request.epoch,
            seq: request.seq,
            instance: self.instance.clone(),
            candidates: convert::candidates_to_wire(&candidates),
            tree: Tree::default(),
            elapsed_us: (asked.came.elapsed() - began).as_micros() as u64,
            cut: false,
        })
    }

    /// The process of `robot`, which is started if it has none. Meanwhile other robots are answered.
    fn seat(&self, robot: &str) -> Result<Arc<Mutex<Seat>>, Reject> {
        if let Some(seat) = taken(&locked(&self.seats), robot)? {
            return Ok(seat);
        }
        let started = Arc::new(Mutex::new(self.start(robot)?));
        let mut seats = locked(&self.seats);
        // Another question of the robot may have been faster, and other robots may have come.
        if let Some(seat) = taken(&seats, robot)? {
            return Ok(seat);
        }
        seats.insert(robot.to_owned(), Arc::clone(&started));
        Ok(started)
    }

    fn start(&self, robot: &str) -> Result<Seat, Reject> {
        let attended =
            Attended::start(self.source.clone()).map_err(|error| refused(&format!("{error:#}")))?;
        let key = keys::robot(robot, "scan").map_err(Refusal::invalid)?;
        let scans = self.description.scan.then(|| Inbox::new(&self.session, &key)).transpose();
        let scans = scans.map_err(Refusal::failed)?;
        Ok(Seat { attended, begun: None, tick: 0, scans, scan: None })
    }
}

/// The process that `robot` has; refused if it has none and there is no room for another.
fn taken(
    seats: &BTreeMap<String, Arc<Mutex<Seat>>>,
    robot: &str,
) -> Result<Option<Arc<Mutex<Seat>>>, Reject> {
    match seats.get(robot) {
        Some(seat) => Ok(Some(Arc::clone(seat))),
        None if seats.len() >= SEATS_MOST => Err(Refusal::Overloaded.into()),
        None => Ok(None),
    }
}

impl Seat {
    /// Takes note of the newest scan.
    fn look(&mut self) {
        let Some(scans) = &self.scans else { return };
        if let Some(scan) = std::iter::from_fn(|| scans.try_next()).last() {
            self.scan = Some(ScanView::of(&scan));
        }
    }

    /// What the planner proposes, or that it has begun.
    fn ask(
        &mut self,
        run: &Run<'_>,
        input: &GenerationInput<'_>,
        request: &GenerateRequest,
        budget: Duration,
        asked: Asked<'_>,
    ) -> Result<CandidateSet, Reject> {
        let warms_up = request.iterations == 0;
        let has_started_over = !warms_up && request.scene.tick < self.tick;
        self.tick = if warms_up { 0 } else { request.scene.tick };
        let goes_on = self.begun.as_ref().is_some_and(|begun| begun.goes_on(request));
        if !goes_on || has_started_over || self.attended.tally().deaths > 0 {
            self.attended.begin(run, input);
        }
        self.begun = Some(Need::of(request));
        let before = self.attended.tally().faults();
        let candidates = match warms_up {
            true => CandidateSet::empty(input.params.steps, input.params.dt),
            false => self.attended.candidates(
                input,
                self.scan.as_ref(),
                budget.saturating_sub(asked.came.elapsed()),
            ),
        };
        let tally = self.attended.tally();
        match tally.faults() > before || tally.deaths > 0 {
            true => Err(refused(self.attended.last_fault())),
            false => Ok(candidates),
        }
    }
}

fn refused(why: &str) -> Reject {
    Refusal::failed(why).into()
}
