//! The generators that profiles can name: a new one is its own file and one entry here.

use std::cell::Cell;

use crate::generation::{
    BiRiskRrtGenerator, Generated, GenerationInput, GenerationParams, Generator, RiskRrtGenerator,
    RrtStarGenerator, Tree,
};

/// A generator that profiles can name.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct GeneratorKind {
    /// Its name in profiles.
    pub name: &'static str,
    /// What limits the growth of one cycle: samples drawn or nodes added.
    pub iterations: fn(&mut GenerationParams) -> &mut u32,
    /// Most candidates that one tree offers.
    pub max_candidates: fn(&GenerationParams) -> u32,
    /// Makes it.
    pub build: fn(GenerationParams) -> Box<dyn Generator>,
}

impl GeneratorKind {
    /// Makes it and lets it generate once; also says whether `should_stop` has cut that short.
    pub fn generate(
        &self,
        params: GenerationParams,
        input: &GenerationInput<'_>,
        tree: Option<Tree>,
        seed: u64,
        should_stop: &dyn Fn() -> bool,
    ) -> (Generated, bool) {
        // Once told to stop, it is told so for good.
        let cut = Cell::new(false);
        let should_stop = || {
            cut.set(cut.get() || should_stop());
            cut.get()
        };
        let generated = (self.build)(params).generate(input, tree, seed, &should_stop);
        (generated, cut.get())
    }
}

/// All of them, the paper's first.
pub const GENERATORS: &[GeneratorKind] = &[
    GeneratorKind {
        name: "rrt-star",
        iterations: |params| &mut params.tree.iterations,
        max_candidates: |params| params.candidates.max_candidates,
        build: |params| Box::new(RrtStarGenerator { params }),
    },
    GeneratorKind {
        name: "risk-rrt",
        iterations: |params| &mut params.risk_rrt.nodes,
        max_candidates: |params| params.risk_rrt.max_candidates,
        build: |params| Box::new(RiskRrtGenerator { params }),
    },
    GeneratorKind {
        name: "bi-risk-rrt",
        iterations: |params| &mut params.risk_rrt.nodes,
        max_candidates: |params| params.risk_rrt.max_candidates,
        build: |params| Box::new(BiRiskRrtGenerator { params }),
    },
];

/// The generator of that name.
pub fn find(name: &str) -> Option<&'static GeneratorKind> {
    GENERATORS.iter().find(|kind| kind.name == name)
}

/// The names there are, for messages.
pub fn known() -> Vec<String> {
    GENERATORS.iter().map(|kind| kind.name.to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_generator_bears_its_name_and_grows_as_it_is_told() {
        for kind in GENERATORS {
            let mut params = GenerationParams::default();
            *(kind.iterations)(&mut params) = 17;
            assert_ne!(params, GenerationParams::default(), "{}", kind.name);
            assert_eq!((kind.build)(params).name(), kind.name);
        }
    }
}
