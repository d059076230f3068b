//! A planner of one's own in a run of the bench.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use anyhow::Context;
use curionav_deployment::package::Package;
use curionav_in_process::{play_by, prepare};
use curionav_own_planner::attended::Tally;
use curionav_own_planner::{Attended, Run, ScanView, Source};
use curionav_planning::candidates::CandidateSet;
use curionav_planning::generation::GenerationInput;
use curionav_planning::occupancy::StaticMap;
use curionav_planning::profile::Profile;
use curionav_robot::arbiter::own_planner::OwnPlanner;
use curionav_runtime::fields::Fields;
use curionav_runtime::locked::locked;
use curionav_schemas::{Mission, RunResult, Scan, words};

/// As long as a built-in generator has for an answer in lockstep.
const LIMIT: Duration = Duration::from_secs(10);

/// The planners of one's own that a worker has started, and the maps of their runs.
pub(super) struct OwnPlanners {
    by_source: BTreeMap<String, Arc<Mutex<Attended>>>,
    fields: Fields,
}

impl OwnPlanners {
    pub(super) fn new() -> Self {
        Self { by_source: BTreeMap::new(), fields: Fields::of_maps([]) }
    }

    /// The profile of the planner that `text` names; nothing if that is a profile.
    pub(super) fn profile(&mut self, text: &str) -> anyhow::Result<Option<Profile>> {
        let Some(attended) = self.find(text)? else { return Ok(None) };
        let attended = locked(&attended);
        attended.description().profile(attended.source()).map(Some)
    }

    fn find(&mut self, text: &str) -> anyhow::Result<Option<Arc<Mutex<Attended>>>> {
        if let Some(known) = self.by_source.get(text) {
            return Ok(Some(Arc::clone(known)));
        }
        let Some(source) = Source::parse(text)? else { return Ok(None) };
        let attended = Arc::new(Mutex::new(Attended::start(source)?));
        self.by_source.insert(text.to_owned(), Arc::clone(&attended));
        Ok(Some(attended))
    }

    /// Plays `package` with the planner that `text` names, in this thread.
    pub(super) fn play(&mut self, text: &str, package: &Package) -> anyhow::Result<(RunResult, Tally)> {
        let attended = self.find(text)?.with_context(|| format!("`{text}` is a profile"))?;
        let prepared = prepare(&package.request, "robot", &self.fields).map_err(|r| package.refusal(&r))?;
        let map = self.fields.map(prepared.order.map)?;
        let asked = Asked { attended: Arc::clone(&attended), map, scan: None, has_begun: false };
        let played = play_by(Some(Box::new(asked)), prepared, &self.fields, &mut || true);
        let result = played.map_err(|end| anyhow::anyhow!("the run failed: {}", words::say("end", &*end)))?;
        let tally = locked(&attended).tally().clone();
        Ok((result, tally))
    }
}

/// A planner as the robot of one run asks it.
struct Asked {
    attended: Arc<Mutex<Attended>>,
    map: Arc<StaticMap>,
    scan: Option<ScanView>,
    has_begun: bool,
}

impl OwnPlanner for Asked {
    fn see(&mut self, scan: &Scan) {
        self.scan = Some(ScanView::of(scan));
    }

    fn candidates(&mut self, mission: &Mission, input: &GenerationInput<'_>) -> CandidateSet {
        let mut attended = locked(&self.attended);
        if !self.has_begun {
            self.has_begun = true;
            let order = &mission.order;
            attended.begin(&Run { robot: &order.robot, map: &self.map.grid, seed: order.seed }, input);
        }
        attended.candidates(input, self.scan.as_ref(), LIMIT)
    }
}
