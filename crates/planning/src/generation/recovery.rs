//! Ways out for a robot that does not get away from where it is, as navigation stacks have in a recovery.
//!
//! A generator that chooses by itself can stand before a person who waits for it, because nothing that it tries is free
//! or costs less than to stand. After some time in one place, ways out are offered instead of what the generator
//! offers.

use crate::candidates::CandidateSet;
use crate::generation::candidates::{SOMEWHERE, Search, find_candidates_by, go_on};
use crate::generation::params::Besides;
use crate::generation::pose_tree::PoseTree;
use crate::generation::{GenerationInput, Pace};

/// The shortest way and straight ways in all directions, with turns on the spot and slow ones, those that end nearest
/// to the goal first; none of them stands if there is another. If the robot insists and nothing gets anywhere, it is
/// the beginning of the way out between people who stand alone. `None` while the robot's time in its place is not over,
/// and where nothing is free.
pub(super) fn ways_out(input: &GenerationInput<'_>, pace: &Pace<'_>) -> Option<CandidateSet> {
    let recovery = &input.params.generation.recovery;
    if recovery.patience <= 0.0 || input.scene.in_place < recovery.patience {
        return None;
    }
    let checker = input.checker();
    // A way out that has been begun is gone, or the robot would turn to and fro between two.
    if let Some(rest) = recovery.insist.then(|| go_on(input, &checker)).flatten() {
        return Some(rest);
    }
    let mut params = input.params.clone();
    let horizon = params.dt * params.steps as f64;
    params.min_speed = SOMEWHERE / horizon;
    params.generation.candidates.besides = Besides { previous: false, arcs: false, ..Besides::default() };
    let here = input.scene.belief.pose.position();
    let way = input.geodesic.descend_for(here, 0.2, input.robot.v_max * horizon);
    let input = GenerationInput { params: &params, ..*input };
    let search = Search { tree: &PoseTree::default(), way: &way, insists: recovery.insist };
    let found = find_candidates_by(&input, search, &checker, pace);
    Some(found).filter(|found| !found.is_empty())
}
