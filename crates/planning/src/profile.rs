//! A planner as data: which generator, which cost terms, which thresholds.
//!
//! The paper's planner, its ablations and every baseline are profiles over the same generators and
//! evaluators. The file `profiles/curiosity.toml` documents every field beside its default; a test
//! holds that file and [`Profile::default`] equal.

use std::collections::BTreeMap;

use crate::parameters::{FieldError, Range};

use crate::collision::CollisionParams;
use crate::collision_risk::RiskParams;
use crate::crowd_cluster::GroupParams;
use crate::evaluation::cpc::{CpcParams, InformationParams};
use crate::evaluation::distance::DistanceMeasure;
use crate::evaluation::hccdm::HccdmParams;
use crate::evaluation::human_space::HumanSpaceParams;
use crate::evaluation::information_to_go::InformationToGoParams;
use crate::forecast::ForecastParams;
use crate::generation::{self, GenerationParams, GeneratorPart};
use crate::sight::SightParams;
mod load;

crate::parameters! {
    /// Everything that decides how a robot plans.
    #[non_exhaustive]
    pub struct Profile {
        /// Short name, as on the command line.
        pub name: String [name, "give a name"] = "curiosity".to_owned(),
        /// One sentence for people.
        pub description: String = "The paper's planner: curiosity for landmarks while lost, respect for people always."
            .to_owned(),
        /// Which trajectory generator is asked.
        pub generator: String [name, "give a name"] = "rrt-star".to_owned(),
        /// Search trees grown side by side in a cycle, each with a seed and a generator of its own; the candidates
        /// of all compete. 1 is the paper's.
        pub trees: u32
            [1.0, 8.0, "trees", "with the most candidates each may offer they still fit into one message"] = 1,
        /// States per candidate, K. Every candidate has exactly this many (A12).
        pub steps: usize [in GeneratorPart::STEPS] = 13,
        /// Seconds between states, and of one paper-rate planning cycle (A26).
        pub dt: f64 [in GeneratorPart::DT] = 0.3,
        /// Candidates slower than this on average, m/s, compete only if no faster one is free (D4).
        pub min_speed: f64 [in GeneratorPart::MIN_SPEED] = 0.35,
        /// A candidate that turns at least this far in all, radians, is not slow: where the way lies behind,
        /// turning on the spot is getting on.
        pub min_turn: f64 [0.0, 100.0, "rad", "no horizon has room for more"] = 0.75,
        /// How raw costs become comparable before they are weighted (D1).
        pub normalisation: Normalisation [words] = Normalisation::Fixed,
        /// Which distance to the goal the term `distance` sums (A11).
        pub distance: DistanceMeasure [words] = DistanceMeasure::Geodesic,
        /// The terms of the cost, by name (eqs. 5 and 6).
        pub terms: BTreeMap<String, Term> [table; 1.0, 16.0, "each is a question in every cycle"] = BTreeMap::from([
            ("cnc".to_owned(), Term::new(0.106, 2.2)),
            ("cpc".to_owned(), Term { when: Condition::Uncertain, ..Term::new(0.1, 2.2) }),
            ("distance".to_owned(), Term::new(2.0, 1.0)),
        ]),
        /// When the position counts as uncertain (eq. 5).
        pub uncertainty: UncertaintySwitch [table] = UncertaintySwitch::default(),
        /// Which people matter (A21).
        pub working_zone: WorkingZone [table] = WorkingZone::default(),
        /// When the goal is reached.
        pub goal: GoalTolerance [table] = GoalTolerance::default(),
        /// How far a decision outlives the cycle that made it.
        pub hold: HoldLimits [table] = HoldLimits::default(),
        /// When the robot has not got away from where it is for too long.
        pub patience: Patience [table] = Patience::default(),
        /// How reluctantly the robot changes its mind.
        pub persistence: Persistence [table] = Persistence::default(),
        /// What is believed of something that only the driver sees.
        pub unseen: UnseenParams [table] = UnseenParams::default(),
        /// Where people will be.
        pub forecast: ForecastParams [table] = ForecastParams::default(),
        /// How much room is kept around the robot.
        pub collision: CollisionParams [table] = CollisionParams::default(),
        /// How the Risk-RRT baselines and the term `risk` see and weigh risk.
        pub risk: RiskParams [table] = RiskParams::default(),
        /// How the human comfort and crowd density map is built (eqs. 16 to 18).
        pub hccdm: HccdmParams [table] = HccdmParams::default(),
        /// How large the rooms of the term `human-space` are, and the waves of `doppler`.
        pub human_space: HumanSpaceParams [table] = HumanSpaceParams::default(),
        /// Who belongs together, and what room they take, for the terms `cnc` and `human-space`.
        pub groups: GroupParams [table] = GroupParams::default(),
        /// Whether walls hide people from the terms that count them.
        pub sight: SightParams [table] = SightParams::default(),
        /// What the term `information-to-go` makes of uncertainty on the way to the goal.
        pub information_to_go: InformationToGoParams [table] = InformationToGoParams::default(),
        /// When predicted observations are credited (D5).
        pub cpc: CpcParams [table] = CpcParams::default(),
        /// What an observation is worth to the prediction (eq. 8).
        pub information: InformationParams [table] = InformationParams::default(),
        /// How candidates come to be, besides what the profile says elsewhere.
        pub generation: GenerationParams [table] = GenerationParams::default(),
    } check Self::agrees
}

impl Profile {
    /// Seconds a candidate looks ahead, `T_h = K dt`.
    pub fn horizon(&self) -> f64 {
        self.steps as f64 * self.dt
    }

    /// Radius of the Working Zone, `(v_max + v_ped) T_h + D_pd`: people farther away cannot come within
    /// personal distance before the horizon. `v_max` is the robot's, m/s; the result is metres.
    pub fn working_zone_radius(&self, v_max: f64) -> f64 {
        (v_max + self.working_zone.v_people_max) * self.horizon() + self.hccdm.personal_distance
    }

    /// The part of this profile that a generator needs.
    pub fn generator_part(&self) -> GeneratorPart {
        GeneratorPart {
            steps: self.steps,
            dt: self.dt,
            min_speed: self.min_speed,
            held: self.hold.max_age,
            generation: self.generation.clone(),
            collision: self.collision,
            risk: self.risk,
            forecast: self.forecast,
            information: self.information,
        }
    }

    /// What limits the growth of one cycle: samples drawn by RRT*, nodes added by Risk-RRT and Bi-Risk-RRT; 1 for a
    /// planner of one's own. Zero if there is no such generator.
    pub fn iterations(&self) -> u32 {
        let mut params = self.generation.clone();
        let built_in = generation::find(&self.generator).map(|kind| *(kind.iterations)(&mut params));
        // One question a cycle; none would only warm it up.
        built_in.unwrap_or(u32::from(generation::own::is_own(&self.generator)))
    }

    /// The terms that count in a scene, in order of their names: those whose condition holds and whose
    /// weight is not zero. Exactly these have to be evaluated.
    pub fn active_terms(&self, uncertain: bool) -> impl Iterator<Item = (&str, &Term)> {
        self.terms
            .iter()
            .filter(move |(_, term)| term.weight > 0.0 && (uncertain || term.when == Condition::Always))
            .map(|(name, term)| (name.as_str(), term))
    }

    /// What `term` weighs for a robot that is impatient or not.
    pub fn weight(&self, term: &Term, impatient: bool) -> f64 {
        if impatient && term.gives_way { term.weight * self.patience.share } else { term.weight }
    }

    /// What a check of each number alone does not find.
    fn agrees(&self) -> Result<(), FieldError> {
        if self.terms.keys().any(String::is_empty) {
            return Err(FieldError::new("terms", "has a term without a name", "name it"));
        }
        if self.active_terms(false).next().is_none() {
            let mend = "give one a weight above 0 and leave out its `when`";
            return Err(FieldError::new("terms", "needs a term that always counts", mend));
        }
        Ok(())
    }
}

crate::parameters! {
    /// One term of the cost: `weight * raw / (scale * K)` under fixed scales.
    ///
    /// Raw costs of this project's terms are sums over the K states of a candidate, so the scale is given
    /// per state and multiplied by K: changing the horizon leaves the balance of the terms alone.
    #[derive(Copy)]
    pub struct Term {
        /// The raw cost per state, in the term's unit, that counts as one. Greater than zero.
        pub scale: f64 [1e-6, 1e9, "", "the terms are divided by it and their sum has to stay finite"],
        /// Weight (w1, w2, w3 of eqs. 5 and 6). Zero switches the term off, and it is not evaluated.
        #[serde(default = "one")]
        pub weight: f64 [0.0, 1e6, "", "0 switches the term off, and the sum has to stay finite"],
        /// When the term counts.
        #[serde(default)]
        pub when: Condition [words],
        /// Whether it counts less while the robot is impatient (`patience`).
        #[serde(default)]
        pub gives_way: bool,
    }
}

impl Term {
    /// One that always counts.
    pub fn new(scale: f64, weight: f64) -> Self {
        Self { scale, weight, when: Condition::Always, gives_way: false }
    }
}

fn one() -> f64 {
    1.0
}

crate::parameters! {
    /// When a term counts.
    #[derive(Default)]
    #[non_exhaustive]
    pub enum Condition {
        /// In every cycle.
        #[default]
        Always,
        /// Only while the position is uncertain (the second case of eq. 5).
        Uncertain,
    }
}

crate::parameters! {
    /// How raw costs become comparable.
    #[derive(Default)]
    #[non_exhaustive]
    pub enum Normalisation {
        /// By the term's own scale: a candidate's total depends on that candidate alone (D1).
        #[default]
        Fixed,
        /// By the least and greatest raw cost of the batch (A13's literal reading). Small differences are
        /// blown up and one missing candidate can change the order of the others.
        MinMax,
        /// The same, and each term counts besides by how much it tells candidates apart: one minus the entropy of its
        /// costs (the weights of the baseline `risk-aware`). A term that is equal for all counts nothing.
        Entropy,
    }
}

crate::parameters! {
    /// Eq. 5's switch, with hysteresis (D3).
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct UncertaintySwitch {
        /// `Thr'`, m2 + rad2: above it the position counts as uncertain (A9).
        pub threshold: f64
            [1e-6, 1000.0, "m2 + rad2", "no filter is more certain, and none that localises less"] = 0.1,
        /// The position counts as certain again below this share of the threshold, (0, 1].
        pub release_ratio: f64
            [0.01, 1.0, "", "at 1 there is no hysteresis, at none the position never counts as certain again"] = 0.8,
    }
}

crate::parameters! {
    /// The disc around the robot inside which people are looked at (A21).
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct WorkingZone {
        /// Fastest walking expected, m/s.
        pub v_people_max: f64 [0.0, 15.0, "m/s", "no person runs faster"] = 1.0,
        /// Metres by which a person must leave the zone to be forgotten, so that clusters do not flicker.
        pub hysteresis: f64 [0.0, 100.0, "m", "people farther away are not met within a horizon"] = 0.5,
    }
}

crate::parameters! {
    /// When the goal is reached.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct GoalTolerance {
        /// The arbiter ends when the estimated position is nearer than this, metres (D13).
        pub arrive_distance: f64 [in Range::GOAL_TOLERANCE] = 0.3,
        /// Error of position with which the robot still counts as being at the goal, metres: the mission's
        /// `goal_tolerance`.
        pub tolerance: f64 [in Range::GOAL_TOLERANCE] = 0.5,
        /// A robot that is nearer than `arrive_distance` goes on until the distance and this many standard deviations
        /// of its position are within `tolerance`, or until what it would drive no longer ends nearer to the goal, for
        /// 5 s at most.
        pub sigma_factor: f64 [0.0, 10.0, "standard deviations", "ten are certainty"] = 0.0,
    }
}

impl GoalTolerance {
    /// Whether a robot that believes it is `distance` metres from the goal, with this standard deviation of position,
    /// is taken to be there.
    pub(crate) fn is_sure(&self, distance: f64, sigma: f64) -> bool {
        self.sigma_factor == 0.0 || distance + self.sigma_factor * sigma <= self.tolerance
    }
}

crate::parameters! {
    /// How far a decision outlives the cycle that made it.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct HoldLimits {
        /// Seconds after its scene's stamp for which a followed trajectory is valid: four paper cycles, in
        /// which a person's forecast has drifted by about 0.2 m.
        pub max_age: f64
            [in GeneratorPart::HELD] = 1.2,
        /// Metres the robot may have strayed from the trajectory for its tail still to be held.
        pub max_deviation: f64 [0.0, 100.0, "m", "farther away it is another trajectory"] = 0.5,
        /// Metres by which a candidate may leap between states beyond what the robot's top speed covers;
        /// a candidate that leaps farther is unreachable (Alg. 2, line 4).
        pub reach_tolerance: f64 [0.0, 100.0, "m", "leaps beyond it are no trajectory"] = 0.3,
    }
}

crate::parameters! {
    /// When the robot has not got away from where it is for too long. For a while it is then impatient: terms with
    /// `gives_way` count less, so that it passes people from whom it would otherwise turn away. Then it is patient
    /// again, and lets people pass.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct Patience {
        /// Seconds for which the robot has to stay within `radius`. At 0 it is never impatient, as in the paper.
        pub after: f64 [0.0, 1000.0, "s", "a mission does not last longer"] = 0.0,
        /// How far it has to get away from where it came to, metres; at most as far as half its top speed takes it in
        /// `after` seconds.
        pub radius: f64 [0.01, 100.0, "m", "nearer is the same place, and farther is another room"] = 3.0,
        /// Seconds for which the robot is impatient.
        pub lasts: f64 [0.0, 1000.0, "s", "a mission does not last longer"] = 8.0,
        /// Seconds in one place, of those for which it has been impatient, after which it is so no longer: something
        /// stands right before it, and it has to give way.
        pub stands: f64 [0.0, 1000.0, "s", "a mission does not last longer"] = 2.0,
        /// A robot that is nearer to its goal is impatient while people are as near to it, metres: it cannot keep away
        /// from them and arrive. At 0 that makes no difference, as in the paper.
        pub near_goal: f64 [0.0, 100.0, "m", "beyond that people are not at the goal"] = 0.0,
        /// What a term that gives way weighs while the robot is impatient, as a share of its weight.
        pub share: f64 [0.01, 1.0, "", "a term that counts for nothing is left out, and none counts for more"] = 0.2,
    }
}

crate::parameters! {
    /// How reluctantly the robot changes its mind.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct Persistence {
        /// Cost by which another candidate must be better than one that continues the previous decision.
        /// Zero is the paper's pure argmin.
        pub margin: f64 [0.0, 1e6, "", "costs have to stay finite"] = 0.0,
        /// A candidate continues the previous decision if its states lie within this many metres of it on
        /// average.
        pub same_within: f64 [0.0, 100.0, "m", "farther away it is another trajectory"] = 0.3,
    }
}

crate::parameters! {
    /// When the robot is taken to stand before something that the planner does not know of.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct UnseenParams {
        /// Seconds for which the driver has to brake because something is too close until the scene has someone there.
        /// At 0 it never has, as in the paper.
        pub after: f64 [0.0, 1000.0, "s", "a mission does not last longer"] = 0.0,
        /// Seconds for which the scene has someone there, after the driver has braked last.
        pub keep: f64 [0.0, 1000.0, "s", "a mission does not last longer"] = 6.0,
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
        let part = profile.generator_part();
        assert_eq!((part.steps, part.dt, part.min_speed), (20, 0.2, 0.1));
        assert_eq!(part.collision, profile.collision);
    }

    #[test]
    fn a_term_without_weight_is_not_asked_for() {
        let mut profile = Profile::default();
        profile.terms.get_mut("cnc").unwrap().weight = 0.0;
        let terms = |uncertain| profile.active_terms(uncertain).map(|(m, _)| m).collect::<Vec<_>>();
        assert_eq!(terms(false), ["distance"]);
        assert_eq!(terms(true), ["cpc", "distance"]);
    }
}
