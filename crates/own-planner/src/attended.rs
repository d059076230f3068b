//! A planner of one's own as robots ask it: what goes wrong costs its own run alone, and is counted.

use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use curionav_planning::candidates::CandidateSet;
use curionav_planning::generation::GenerationInput;
use curionav_planning::generation::own::candidates;
use curionav_planning::occupancy::OccupancyGrid;
use serde::{Deserialize, Serialize};

use crate::description::{Check, Description};
use crate::lines::{
    Begin, Beginning, Decide, Question, ScanView, Unusable, read_begun, read_proposals, shown,
};
use crate::process::{Process, Silence};
use crate::source::Source;

/// How long a program may take to start and to begin a run: it may load a learned policy.
const START: Duration = Duration::from_secs(60);
/// Late answers in a row after which a program is ended.
const LATE_MOST: u64 = 3;
/// How long a run waits for answers in all: a slow planner must not outlast what a run may take.
const RUN_MOST: Duration = Duration::from_secs(600);

/// What became of the questions of a run.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tally {
    /// What checked what was proposed.
    pub check: Check,
    /// Cycles in which the planner was asked, or would have been if it had still been there.
    pub asked: u64,
    /// Answers that did not come in time.
    pub late: u64,
    /// Answers that say that the planner has failed.
    pub errors: u64,
    /// Answers that are none.
    pub refused: u64,
    /// Ends of the program, by itself or after late answers.
    pub deaths: u64,
    /// What went wrong first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_fault: Option<String>,
}

impl Tally {
    /// How often something has gone wrong.
    pub fn faults(&self) -> u64 {
        self.late + self.errors + self.refused + self.deaths
    }
}

/// What a run is about, beside what each cycle tells.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// The robot that the planner plans for.
    pub robot: &'a str,
    /// The map that the robot is given.
    pub map: &'a OccupancyGrid,
    /// Of everything random.
    pub seed: u64,
}

/// A planner and the program that runs it, which is started as it is needed.
pub struct Attended {
    source: Source,
    description: Description,
    process: Option<Process>,
    /// Hashes of the maps that the process has.
    maps: Vec<[u8; 32]>,
    tally: Tally,
    late_in_row: u64,
    waited: Duration,
    /// The program has ended in this run, and is not started again.
    is_over: bool,
    /// What went wrong last, in any run.
    last_fault: String,
}

impl Attended {
    /// Starts the planner and asks what it is.
    ///
    /// # Errors
    /// It does not start, or what it says of itself cannot be used; the error says what mends it.
    pub fn start(source: Source) -> anyhow::Result<Self> {
        let place = source.file().display().to_string();
        let (process, description) = hello(&source).with_context(|| place)?;
        Ok(Self {
            source,
            description,
            process: Some(process),
            maps: Vec::new(),
            tally: Tally::default(),
            late_in_row: 0,
            waited: Duration::ZERO,
            is_over: false,
            last_fault: String::new(),
        })
    }

    /// What the planner says of itself.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Where it comes from.
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// What became of the questions of this run so far.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// Begins a run. What is wrong with the planner is counted, and told in no other way.
    pub fn begin(&mut self, run: &Run<'_>, input: &GenerationInput<'_>) {
        self.tally = Tally { check: self.description.check, ..Tally::default() };
        self.late_in_row = 0;
        self.waited = Duration::ZERO;
        self.is_over = false;
        if self.process.is_none() {
            self.maps.clear();
            match hello(&self.source) {
                Ok((process, _)) => self.process = Some(process),
                Err(error) => return self.died(format!("{error:#}")),
            }
        }
        let hash = run.map.hash();
        let with_cells = self.description.map && !self.maps.contains(&hash);
        let beginning = Beginning { robot: run.robot, seed: run.seed, map: run.map, with_cells };
        let question = Question::Begin(Box::new(Begin::new(&beginning, input)));
        match self.ask(&question, START) {
            Some(line) => {
                if with_cells {
                    self.maps.push(hash);
                }
                if let Err(unusable) = read_begun(&line) {
                    self.count(unusable);
                    // A planner that has not begun knows nothing of this run.
                    self.died("it has not begun the run".to_owned());
                }
            }
            None if self.process.is_some() => self.died("it has not begun the run in time".to_owned()),
            None => {}
        }
    }

    /// What the planner proposes for the robot in this cycle, within `limit` and within its own; nothing if it fails.
    pub fn candidates(
        &mut self,
        input: &GenerationInput<'_>,
        scan: Option<&ScanView>,
        limit: Duration,
    ) -> CandidateSet {
        let none = CandidateSet::empty(input.params.steps, input.params.dt);
        self.tally.asked += 1;
        if self.is_over {
            return none;
        }
        let scan = scan.filter(|_| self.description.scan);
        let question = Question::Decide(Box::new(Decide::new(input, scan)));
        let limit = self.description.limit().min(limit);
        let Some(line) = self.ask(&question, limit) else { return none };
        let made = read_proposals(&line).and_then(|proposals| {
            candidates(input, &proposals).map_err(|error| Unusable::Refused(error.to_string()))
        });
        match made {
            Ok(candidates) => candidates,
            Err(unusable) => {
                self.count(unusable);
                none
            }
        }
    }

    /// The line that answers a question; nothing if there is none, which is counted.
    fn ask(&mut self, question: &Question<'_>, limit: Duration) -> Option<Vec<u8>> {
        let process = self.process.as_mut()?;
        let question = match serde_json::to_vec(question) {
            Ok(question) => question,
            Err(error) => {
                self.count(Unusable::Refused(error.to_string()));
                return None;
            }
        };
        let began = Instant::now();
        let answer = process.ask(question, limit);
        self.waited += began.elapsed();
        if !matches!(answer, Err(Silence::Ended(_))) && self.waited >= RUN_MOST {
            self.died(format!("it took {} s in all and was ended", RUN_MOST.as_secs()));
        }
        match answer {
            Ok(line) => {
                self.late_in_row = 0;
                Some(line)
            }
            Err(Silence::Late) => {
                self.tally.late += 1;
                self.late_in_row += 1;
                self.note(format!("no answer within {} s", limit.as_secs_f64()));
                if self.late_in_row >= LATE_MOST && !self.is_over {
                    self.died(format!("it was late {LATE_MOST} times in a row and was ended"));
                }
                None
            }
            Err(Silence::Ended(why)) => {
                self.died(why);
                None
            }
        }
    }

    fn count(&mut self, unusable: Unusable) {
        match unusable {
            Unusable::Failed(why) => {
                self.tally.errors += 1;
                self.note(why);
            }
            Unusable::Refused(why) => {
                self.tally.refused += 1;
                self.note(why);
            }
        }
    }

    /// Ends the program for this run.
    fn died(&mut self, why: String) {
        self.tally.deaths += 1;
        self.is_over = true;
        self.process = None;
        self.note(why);
    }

    /// What went wrong last, in any run; empty if nothing has.
    pub fn last_fault(&self) -> &str {
        &self.last_fault
    }

    fn note(&mut self, why: String) {
        self.last_fault.clone_from(&why);
        tracing::info!(planner = self.description.name, why, "a planner failed");
        self.tally.first_fault.get_or_insert(why);
    }
}

/// Starts the planner of `source` and asks what it is.
fn hello(source: &Source) -> anyhow::Result<(Process, Description)> {
    let mut process = Process::start(source.command()?).with_context(|| source.mend())?;
    let question = serde_json::to_vec(&Question::hello())?;
    let line = match process.ask(question, START) {
        Ok(line) => line,
        Err(Silence::Late) => bail!("no answer to `hello` within {} s; {}", START.as_secs(), source.mend()),
        Err(Silence::Ended(why)) => bail!("{why}; {}", source.mend()),
    };
    if let Err(Unusable::Failed(why)) = read_begun(&line) {
        bail!("{why}");
    }
    let description: Description = serde_json::from_slice(&line).with_context(|| {
        format!("it answered `hello` with `{}`; {}", shown(&String::from_utf8_lossy(&line)), source.mend())
    })?;
    description.check()?;
    Ok((process, description))
}

#[cfg(test)]
mod tests;
