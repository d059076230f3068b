//! A planner as data: which generator, which cost terms, which thresholds.
//!
//! The paper's planner, its ablations and every baseline are profiles over the same generators and
//! evaluators. The file `profiles/curiosity.toml` documents every field beside its default; a test
//! holds that file and [`Profile::default`] equal.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::collision::CollisionParams;
use crate::collision_risk::RiskParams;
use crate::evaluation::cpc::{CpcParams, InformationParams};
use crate::evaluation::distance::DistanceMeasure;
use crate::evaluation::hccdm::HccdmParams;
use crate::forecast::ForecastParams;
use crate::generation::GenerationParams;

mod load;

pub use load::ProfileError;

/// Most states a candidate may have, so that one request stays small (a minute at the paper's step).
pub const MAX_STEPS: usize = 200;

/// Most cost terms a profile may list; each is a query in every cycle.
pub const MAX_TERMS: usize = 16;

/// Most trees grown side by side: with the most candidates each may offer they still fit into one batch.
pub const MAX_TREES: u32 = 8;

/// Everything that decides how a robot plans.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Profile {
    /// Short name, as on the command line.
    pub name: String,
    /// One sentence for people.
    pub description: String,
    /// Which trajectory generator is asked.
    pub generator: String,
    /// Search trees grown side by side in a cycle, each with a seed and a generator of its own; the candidates
    /// of all compete. 1 is the paper's.
    pub trees: u32,
    /// States per candidate, K. Every candidate has exactly this many (A12).
    pub steps: usize,
    /// Seconds between states, and of one paper-rate planning cycle (A26).
    pub dt: f64,
    /// Candidates slower than this on average, m/s, compete only if no faster one is free (D4).
    pub min_speed: f64,
    /// A candidate that turns at least this far in all, radians, is not slow: where the way lies behind,
    /// turning on the spot is getting on.
    pub min_turn: f64,
    /// How raw costs become comparable before they are weighted (D1).
    pub normalisation: Normalisation,
    /// Which distance to the goal the metric `distance` sums (A11).
    pub distance: DistanceMeasure,
    /// The terms of the cost, by metric (eqs. 5 and 6).
    pub terms: BTreeMap<String, Term>,
    /// When the position counts as uncertain (eq. 5).
    pub uncertainty: UncertaintySwitch,
    /// Which people matter (A21).
    pub working_zone: WorkingZone,
    /// When the goal is reached.
    pub goal: GoalTolerance,
    /// How far a decision outlives the cycle that made it.
    pub hold: HoldLimits,
    /// How reluctantly the robot changes its mind.
    pub persistence: Persistence,
    /// Where people will be.
    pub forecast: ForecastParams,
    /// How much room is kept around the robot.
    pub collision: CollisionParams,
    /// How the Risk-RRT baselines and the metric `risk` see and weigh risk.
    pub risk: RiskParams,
    /// How the human comfort and crowd density map is built (eqs. 16 to 18).
    pub hccdm: HccdmParams,
    /// When predicted observations are credited (D5).
    pub cpc: CpcParams,
    /// What an observation is worth to the prediction (eq. 8).
    pub information: InformationParams,
    /// How candidates come to be; what the profile says elsewhere is filled in by
    /// [`Profile::generation_params`].
    pub generation: GenerationParams,
}

impl Default for Profile {
    fn default() -> Self {
        let term = |scale, weight, when| Term { scale, weight, when };
        Self {
            name: "curiosity".to_owned(),
            description:
                "The paper's planner: curiosity for landmarks while lost, respect for people always."
                    .to_owned(),
            generator: "rrt-star".to_owned(),
            trees: 1,
            steps: 13,
            dt: 0.3,
            min_speed: 0.35,
            min_turn: 0.75,
            normalisation: Normalisation::Fixed,
            distance: DistanceMeasure::Geodesic,
            terms: BTreeMap::from([
                ("cnc".to_owned(), term(0.106, 2.2, Condition::Always)),
                ("cpc".to_owned(), term(0.1, 2.2, Condition::Uncertain)),
                ("distance".to_owned(), term(2.0, 1.0, Condition::Always)),
            ]),
            uncertainty: UncertaintySwitch::default(),
            working_zone: WorkingZone::default(),
            goal: GoalTolerance::default(),
            hold: HoldLimits::default(),
            persistence: Persistence::default(),
            forecast: ForecastParams::default(),
            collision: CollisionParams::default(),
            risk: RiskParams::default(),
            hccdm: HccdmParams::default(),
            cpc: CpcParams::default(),
            information: InformationParams::default(),
            generation: GenerationParams::default(),
        }
    }
}

impl Profile {
    /// Seconds a candidate looks ahead, `T_h = K dt`.
    pub fn horizon(&self) -> f64 {
        self.steps as f64 * self.dt
    }

    /// Radius of the Working Zone, `(v_max + v_ped) T_h + D_pd`: whoever is farther cannot come within
    /// personal distance before the horizon. `v_max` is the robot's, m/s; the result is metres.
    pub fn working_zone_radius(&self, v_max: f64) -> f64 {
        (v_max + self.working_zone.v_people_max) * self.horizon() + self.working_zone.personal_distance
    }

    /// The generator's parameters, complete: with K, the time step, the slowest speed and the margins that
    /// this profile says once for everybody.
    pub fn generation_params(&self) -> GenerationParams {
        let mut params = self.generation.clone();
        params.collision = self.collision;
        params.risk = self.risk;
        params.candidates.steps = self.steps as u32;
        params.candidates.dt = self.dt;
        params.candidates.slow = self.min_speed;
        params
    }

    /// What a cycle's growth is limited by: samples drawn by RRT*, nodes added by Risk-RRT and Bi-Risk-RRT.
    pub fn iterations(&self) -> u32 {
        match self.generator.as_str() {
            "rrt-star" => self.generation.tree.iterations,
            _ => self.generation.risk_rrt.nodes,
        }
    }

    /// Most candidates one tree offers.
    pub fn max_candidates(&self) -> u32 {
        match self.generator.as_str() {
            "rrt-star" => self.generation.candidates.max_candidates,
            _ => self.generation.risk_rrt.max_candidates,
        }
    }

    /// The terms that count in a scene, in order of their metric: those whose condition holds and whose
    /// weight is not zero. Exactly these metrics have to be evaluated.
    pub fn active_terms(&self, uncertain: bool) -> impl Iterator<Item = (&str, &Term)> {
        self.terms
            .iter()
            .filter(move |(_, term)| term.weight > 0.0 && (uncertain || term.when == Condition::Always))
            .map(|(metric, term)| (metric.as_str(), term))
    }
}

/// One term of the cost: `weight * raw / (scale * K)` under fixed scales.
///
/// Raw costs of this project's metrics are sums over the K states of a candidate, so the scale is given
/// per state and multiplied by K: changing the horizon leaves the balance of the terms alone.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Term {
    /// The raw cost per state, in the metric's unit, that counts as one. Greater than zero.
    pub scale: f64,
    /// Weight (w1, w2, w3 of eqs. 5 and 6). Zero switches the term off and its metric is not asked.
    #[serde(default = "one")]
    pub weight: f64,
    /// When the term counts.
    #[serde(default)]
    pub when: Condition,
}

fn one() -> f64 {
    1.0
}

/// When a term counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Condition {
    /// In every cycle.
    #[default]
    Always,
    /// Only while the position is uncertain (the second case of eq. 5).
    Uncertain,
}

/// How raw costs become comparable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Normalisation {
    /// By the term's own scale: a candidate's total depends on that candidate alone (D1).
    #[default]
    Fixed,
    /// By the least and greatest raw cost of the batch (A13's literal reading). Small differences are
    /// blown up and one missing candidate can change the order of the others.
    MinMax,
}

/// Eq. 5's switch, with hysteresis (D3).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct UncertaintySwitch {
    /// `Thr'`, m2 + rad2: above it the position counts as uncertain (A9).
    pub threshold: f64,
    /// The position counts as certain again below this share of the threshold, (0, 1].
    pub release_ratio: f64,
}

impl Default for UncertaintySwitch {
    fn default() -> Self {
        Self { threshold: 0.1, release_ratio: 0.8 }
    }
}

/// The disc around the robot inside which people are looked at (A21).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WorkingZone {
    /// Fastest walking expected, m/s.
    pub v_people_max: f64,
    /// Personal distance D_pd, metres (A16).
    pub personal_distance: f64,
    /// Metres by which a person must leave the zone to be forgotten, so that clusters do not flicker.
    pub hysteresis: f64,
}

impl Default for WorkingZone {
    fn default() -> Self {
        Self { v_people_max: 1.0, personal_distance: 1.5, hysteresis: 0.5 }
    }
}

/// When the goal is reached.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GoalTolerance {
    /// The arbiter ends when the estimated position is nearer than this, metres (D13).
    pub arrive_distance: f64,
}

impl Default for GoalTolerance {
    fn default() -> Self {
        Self { arrive_distance: 0.3 }
    }
}

/// How far a decision outlives the cycle that made it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HoldLimits {
    /// Seconds after its scene's stamp for which a followed trajectory is valid: four paper cycles, in
    /// which a person's forecast has drifted by about 0.2 m.
    pub max_age: f64,
    /// Metres the robot may have strayed from the trajectory for its tail still to be held.
    pub max_deviation: f64,
    /// Metres by which a candidate may leap between states beyond what the robot's top speed covers;
    /// a candidate that leaps farther is unreachable (Alg. 2, line 4).
    pub reach_tolerance: f64,
}

impl Default for HoldLimits {
    fn default() -> Self {
        Self { max_age: 1.2, max_deviation: 0.5, reach_tolerance: 0.3 }
    }
}

/// How reluctantly the robot changes its mind.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Persistence {
    /// Cost by which another candidate must be better than one that continues the previous decision.
    /// Zero is the paper's pure argmin.
    pub margin: f64,
    /// A candidate continues the previous decision if its states lie within this many metres of it on
    /// average.
    pub same_within: f64,
}

impl Default for Persistence {
    fn default() -> Self {
        Self { margin: 0.0, same_within: 0.3 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_working_zone_is_what_can_come_near_within_the_horizon() {
        // (1 + 1) m/s * 3.9 s + 1.5 m
        assert!((Profile::default().working_zone_radius(1.0) - 9.3).abs() < 1e-12);
    }

    #[test]
    fn the_generator_plans_as_far_and_keeps_as_clear_as_the_arbiter() {
        let mut profile = Profile { steps: 20, dt: 0.2, min_speed: 0.1, ..Profile::default() };
        profile.collision.person_margin = 0.7;
        let params = profile.generation_params();
        assert_eq!((params.candidates.steps, params.candidates.dt, params.candidates.slow), (20, 0.2, 0.1));
        assert_eq!(params.collision, profile.collision);
        assert_eq!(Profile::default().generation_params(), GenerationParams::default());
    }

    #[test]
    fn a_term_without_weight_is_not_asked_for() {
        let mut profile = Profile::default();
        profile.terms.get_mut("cnc").unwrap().weight = 0.0;
        let metrics = |uncertain| profile.active_terms(uncertain).map(|(m, _)| m).collect::<Vec<_>>();
        assert_eq!(metrics(false), ["distance"]);
        assert_eq!(metrics(true), ["cpc", "distance"]);
    }
}
