//! The generators that profiles can name: a new one is its own file and one entry here.

use crate::generation::{
    Generated, GenerationInput, GenerationParams, GeneratorPart, Pace, Tree, bi_risk_rrt, dwa, hrvo_robot,
    mppi, recovery, risk_rrt, rrt_star_generator, transient_goal,
};

/// A generator that profiles can name.
#[derive(Debug, Clone, Copy)]
pub struct GeneratorKind {
    /// Its name in profiles.
    pub name: &'static str,
    /// Tables of [`GenerationParams`] that not all generators read, and this one does.
    pub tables: &'static [&'static str],
    /// What limits the work of one cycle: samples drawn, nodes added, rollouts, or candidates.
    pub iterations: fn(&mut GenerationParams) -> &mut u32,
    /// Makes the candidates of one cycle. All that lasts is in the tree: it gets what the last cycle answered.
    pub grow: fn(&GenerationInput<'_>, Option<Tree>, &Pace<'_>) -> Generated,
}

impl GeneratorKind {
    /// What it generates, or ways out for a robot that does not get away; also says whether that was cut short. `spent`
    /// gives the share of the time for it that is over. The robot is as slow as the speed zones around it ask. Only a
    /// way out leads backwards.
    pub fn generate(
        &self,
        input: &GenerationInput<'_>,
        tree: Option<Tree>,
        spent: &dyn Fn() -> f64,
    ) -> (Generated, bool) {
        let share = input.allowed_share();
        let allowed = input.robot.slowed(share);
        let robot = allowed.forwards();
        // What is slow is so in comparison with what is allowed.
        let mut params = GeneratorPart { min_speed: share * input.params.min_speed, ..input.params.clone() };
        let pace = Pace::new(spent);
        // People who stop are counted on only where nothing is free otherwise.
        let people_stop = std::mem::replace(&mut params.collision.people_stop, false);
        let first_try = GenerationInput { robot: &robot, params: &params, ..*input };
        let mut generated = self.generate_once(&first_try, allowed.v_reverse, tree, &pace);
        if people_stop && generated.candidates.is_empty() {
            params.collision.people_stop = true;
            let second_try = GenerationInput { robot: &robot, params: &params, ..*input };
            generated = self.generate_once(&second_try, allowed.v_reverse, Some(generated.tree), &pace);
        }
        (generated, pace.has_cut())
    }

    fn generate_once(
        &self,
        input: &GenerationInput<'_>,
        v_reverse: f64,
        tree: Option<Tree>,
        pace: &Pace<'_>,
    ) -> Generated {
        match recovery::ways_out(input, v_reverse, pace) {
            Some(candidates) => Generated { candidates, tree: tree.unwrap_or_default() },
            None => (self.grow)(input, tree, pace),
        }
    }
}

/// All of them, the paper's first.
pub const GENERATORS: &[GeneratorKind] = &[
    GeneratorKind {
        name: "rrt-star",
        tables: &[],
        iterations: |params| &mut params.tree.iterations,
        grow: rrt_star_generator::generate,
    },
    GeneratorKind {
        name: "risk-rrt",
        tables: &["risk_rrt"],
        iterations: |params| &mut params.risk_rrt.nodes,
        grow: risk_rrt::generate,
    },
    GeneratorKind {
        name: "bi-risk-rrt",
        tables: &["risk_rrt", "bi_risk_rrt"],
        iterations: |params| &mut params.risk_rrt.nodes,
        grow: bi_risk_rrt::generate,
    },
    GeneratorKind {
        name: "transient-goal",
        tables: &["transient_goal"],
        iterations: |params| &mut params.transient_goal.offers,
        grow: transient_goal::generate,
    },
    GeneratorKind {
        name: "mppi",
        tables: &["mppi"],
        iterations: |params| &mut params.mppi.rollouts,
        grow: mppi::generate,
    },
    GeneratorKind {
        name: "dwa",
        tables: &["dwa"],
        iterations: |params| &mut params.dwa.samples,
        grow: dwa::generate,
    },
    GeneratorKind {
        name: "hrvo-robot",
        tables: &["hrvo_robot"],
        iterations: |params| &mut params.hrvo_robot.offers,
        grow: hrvo_robot::generate,
    },
];

/// The generator of that name.
pub fn find(name: &str) -> Option<&'static GeneratorKind> {
    GENERATORS.iter().find(|kind| kind.name == name)
}

/// Tables of [`GenerationParams`] that only other generators than `kind` read: they need not travel to it.
pub fn tables_not_read_by(kind: &GeneratorKind) -> impl Iterator<Item = &'static str> {
    let all = GENERATORS.iter().flat_map(|kind| kind.tables).copied();
    all.filter(|table| !kind.tables.contains(table))
}

/// The names of all generators, for messages.
pub fn generator_names() -> Vec<String> {
    GENERATORS.iter().map(|kind| kind.name.to_owned()).collect()
}
