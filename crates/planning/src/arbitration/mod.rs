//! Which candidate is taken: Algorithm 2 from observation to decision.
//!
//! [`Observer`] turns beliefs and people into the scene of a cycle; [`Scores`] gathers raw costs from
//! wherever they were computed; [`arbitrate`] weighs them into the total L' of eqs. 5 and 6, takes the
//! least among what can be followed, and always ends in a [`Decision`]. [`explain`] says how close it
//! was. Nothing here knows a term by name: the profile lists them.

mod arbiter;
mod cost;
mod decision;
mod explanation;
mod last_turn;
mod localising;
mod observer;
mod occupied_goal;
mod scores;

pub use arbiter::{Context, Verdict, arbitrate};
pub use cost::{TermCosts, Totals, total_costs};
pub use decision::{Action, Decision, Lack, Previous, PreviousState, Reason, Rejection};
pub use explanation::{Explanation, TermInfluence, explain};
pub use localising::{Localising, SLOW, Surroundings};
pub use observer::{Observer, Place};
pub use scores::{ScoreError, Scores};
