//! What the robot does when something it needs is not there: the table "Degraded modes" of
//! `docs/failures.md`, a test a line.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use curionav_planning::profile::Term;
use curionav_schemas::{Action, Clock, CommandReason, Decision, Degradation, Evaluated};

use super::base::TICK;
use super::fault::{Episode, Fault, Nonsense};
use super::replica::FOREIGN;
use super::robot::Driven;
use super::world::World;
use super::{arbiter, corridor_map, robot};

/// When the fault begins and when the run ends, seconds.
const FROM: f64 = 4.0;
const END: f64 = 12.0;

/// Decisions made and ticks driven since the fault began.
struct Mode {
    decisions: Vec<Decision>,
    ticks: Vec<Driven>,
    /// When each replica was asked which question, from the start.
    asked: Vec<(Duration, String)>,
}

impl Mode {
    /// A robot with `pool` (generators, cpc, cnc) to which `fault` happens and lasts.
    fn of(pool: [usize; 3], fault: Option<Fault>, in_process: bool) -> Self {
        Self::with_trees(1, pool, fault, in_process)
    }

    fn with_trees(trees: u32, pool: [usize; 3], fault: Option<Fault>, in_process: bool) -> Self {
        let (fields, map) = corridor_map::fields();
        let mission = corridor_map::mission(map, 1001, Clock::Realtime, trees);
        Self::in_world(World::new(&fields, mission, in_process, pool), fault)
    }

    /// A robot whose profile has a term that is not built in, with one replica of it, to which `fault` happens.
    fn with_foreign_term(fault: Option<Fault>, in_process: bool) -> Self {
        let (fields, map) = corridor_map::fields();
        let mut mission = corridor_map::mission(map, 1001, Clock::Realtime, 1);
        corridor_map::change_profile(&mut mission, |profile| {
            profile.terms.insert(FOREIGN.to_owned(), Term::new(1.0, 1.0));
        });
        let world = World::new(&fields, mission, in_process, [2, 2, 2]);
        world.start_replica((FOREIGN.to_owned(), format!("{FOREIGN}-0")));
        Self::in_world(world, fault)
    }

    fn in_world(world: Arc<World>, fault: Option<Fault>) -> Self {
        arbiter::start(&world);
        world.executor.spawn(robot::run(world.clone()));
        let (from, until) = (Duration::from_secs_f64(FROM), Duration::from_secs(60));
        let episodes = fault.map(|fault| Episode { fault, from, until }).into_iter().collect();
        world.executor.spawn(world.clone().play(episodes));
        world.executor.run(Duration::from_secs_f64(END));
        world.executor.end();
        let state = world.state();
        let decisions = state.decided.iter().map(|(decision, _)| decision.clone());
        // A decision's stamp is when the robot saw what it is about: one tick before, it was still well.
        Self {
            decisions: decisions.filter(|d| d.stamp > FROM + TICK).collect(),
            ticks: state.robot.driven.iter().filter(|t| t.now > FROM + TICK).cloned().collect(),
            asked: state.asked.clone(),
        }
    }

    fn drives_at_the_end(&self) -> bool {
        self.ticks.iter().rev().take(20).any(|tick| tick.v > 0.3)
    }

    /// Seconds from the fault to the stand that lasts to the end.
    fn stands_after(&self) -> f64 {
        let last = self.ticks.iter().rev().find(|tick| tick.v > 0.0);
        last.map_or(0.0, |tick| tick.now - FROM)
    }

    fn says(&self, degraded: &Degradation) -> bool {
        self.decisions.iter().any(|d| d.degraded.contains(degraded))
    }

    fn last_reason(&self) -> Option<CommandReason> {
        self.ticks.last().and_then(Driven::reason)
    }
}

fn locally(term: &str) -> Degradation {
    Degradation::EvaluatedLocally { term: term.into() }
}

fn not_at_all(term: &str) -> Degradation {
    Degradation::NotEvaluated { term: term.into() }
}

/// Holding for the horizon of 1.2 s, braking from 1 m/s for 2 s, and some ticks of delay.
const HOLD_AND_BRAKE: f64 = 1.2 + 2.0 + 0.5;

#[test]
fn without_a_cpc_pool_it_drives_on_with_its_own_scores() {
    let mode = Mode::of([2, 0, 2], None, true);
    for decision in &mode.decisions {
        let expected = if decision.uncertain { vec![locally("cpc")] } else { Vec::new() };
        assert_eq!((decision.action, &decision.degraded), (Action::Follow, &expected), "{decision:?}");
    }
    assert!(mode.drives_at_the_end() && mode.says(&locally("cpc")));
}

#[test]
fn without_a_cpc_pool_and_left_to_itself_it_stands_while_uncertain_and_drives_while_not() {
    let mode = Mode::of([2, 0, 2], None, false);
    for decision in &mode.decisions {
        assert_eq!(decision.uncertain, !decision.degraded.is_empty(), "{decision:?}");
        assert_eq!(decision.uncertain, decision.action != Action::Follow, "{decision:?}");
    }
    assert!(mode.says(&not_at_all("cpc")));
    assert!(mode.decisions.iter().any(|d| d.action == Action::Hold), "the tail is driven first");
    assert!(mode.decisions.iter().any(|d| d.action == Action::Stop), "then it stops");
    assert!(mode.decisions.iter().any(|d| d.action == Action::Follow), "and goes on");
}

#[test]
fn without_a_cnc_pool_it_drives_on_with_its_own_scores() {
    let mode = Mode::of([2, 2, 0], None, true);
    assert!(mode.says(&locally("cnc")) && mode.drives_at_the_end());
}

#[test]
fn without_a_cnc_pool_and_left_to_itself_it_never_sets_off() {
    let mode = Mode::of([2, 2, 0], None, false);
    assert!(mode.says(&not_at_all("cnc")));
    assert!(mode.decisions.iter().all(|d| d.action == Action::Stop) && mode.stands_after() == 0.0);
}

#[test]
fn a_term_that_is_not_built_in_counts_like_any_other() {
    for in_process in [true, false] {
        let mode = Mode::with_foreign_term(None, in_process);
        assert!(mode.drives_at_the_end());
        assert!(mode.decisions.iter().all(|d| d.evaluated.get(FOREIGN) == Some(&Evaluated::Pool)));
    }
}

#[test]
fn without_a_replica_of_a_term_that_is_not_built_in_it_holds_and_stops() {
    // By name: cnc-0, cnc-1, comfort-0. Gone, hung, and answering nonsense come to the same.
    for fault in [Fault::Crash(2), Fault::Hang(2), Fault::Garbage(2, Nonsense::NotANumber)] {
        for in_process in [true, false] {
            let mode = Mode::with_foreign_term(Some(fault), in_process);
            assert!(mode.says(&not_at_all("comfort")), "{fault:?}");
            assert!(
                mode.decisions.iter().any(|d| d.action == Action::Hold),
                "{fault:?}: the tail comes first"
            );
            assert!(!mode.drives_at_the_end(), "{fault:?}");
            assert!(mode.stands_after() < HOLD_AND_BRAKE, "{fault:?}: {:.1} s", mode.stands_after());
        }
    }
}

#[test]
fn without_a_generator_it_drives_on_with_its_own_candidates() {
    let mode = Mode::of([0, 2, 2], None, true);
    assert!(mode.says(&Degradation::GeneratedLocally) && mode.drives_at_the_end());
}

#[test]
fn of_several_trees_those_that_were_grown_are_enough() {
    let lossy = Fault::Weather { delay: 0.002, loss: 0.3, repeated: 0.0 };
    let mode = Mode::with_trees(3, [2, 2, 2], Some(lossy), false);
    let partly = |d: &&Decision| d.degraded.contains(&Degradation::PartlyGenerated);
    assert!(mode.decisions.iter().filter(partly).any(|d| d.action == Action::Follow));
    let alone = Mode::with_trees(3, [2, 2, 2], Some(lossy), true);
    assert!(alone.says(&Degradation::GeneratedLocally) && !alone.says(&Degradation::PartlyGenerated));
}

#[test]
fn when_the_pool_is_lost_it_drives_on_alone_or_holds_and_stops() {
    let alone = Mode::of([2, 2, 2], Some(Fault::NoPool), true);
    assert!(alone.says(&Degradation::GeneratedLocally) && alone.says(&locally("cnc")));
    assert!(alone.drives_at_the_end());

    let mode = Mode::of([2, 2, 2], Some(Fault::NoPool), false);
    assert!(mode.says(&Degradation::NotGenerated));
    let actions: Vec<Action> = mode.decisions.iter().map(|d| d.action).collect();
    let holds = actions.iter().take_while(|action| **action == Action::Hold).count();
    // The last good one was made at 3.9 s and is valid for 1.2 s: cycles at 4.2, 4.5 and 4.8 s.
    assert!((2..=4).contains(&holds), "{actions:?}");
    assert!(actions[holds..].iter().all(|action| *action == Action::Stop), "{actions:?}");
    assert!(mode.stands_after() < HOLD_AND_BRAKE, "{:.1} s", mode.stands_after());
}

#[test]
fn a_pool_that_is_slow_throughout_is_asked_few_questions_twice() {
    // Scores take up to 46 ms: longer than a quarter of a stage's 120 ms, and less than half of it.
    let mode = Mode::of([2, 2, 2], Some(Fault::Overload(4.0)), true);
    // The first few answers after the change tell what is usual from then on.
    let last: Vec<_> = mode.asked.iter().filter(|(at, _)| at.as_secs_f64() > END - 3.0).collect();
    let different: BTreeSet<_> = last.iter().map(|(_, question)| question).collect();
    let again = last.len() - different.len();
    assert!(last.len() > 20 && 10 * again < last.len(), "{again} of {} questions: {last:?}", last.len());
    assert!(mode.drives_at_the_end());
}

#[test]
fn without_a_localizer_it_stops() {
    let mode = Mode::of([2, 2, 2], Some(Fault::NoLocalizer), true);
    assert!(matches!(mode.last_reason(), Some(CommandReason::DecisionExpired | CommandReason::BeliefTooOld)));
    // No decision without a belief; the driver drives on the one before for 0.5 s.
    assert!(mode.ticks.iter().any(|tick| tick.reason() == Some(CommandReason::BeliefTooOld)));
    assert!(mode.stands_after() < 0.5 + 2.0 + 0.5, "{:.1} s", mode.stands_after());
}

#[test]
fn a_belief_that_grows_old_stops_it_even_if_it_is_said_again() {
    let mode = Mode::of([2, 2, 2], Some(Fault::OldBelief), true);
    assert!(mode.ticks.iter().any(|tick| tick.reason() == Some(CommandReason::BeliefTooOld)));
    assert!(mode.stands_after() < 0.5 + 2.0 + 0.5, "{:.1} s", mode.stands_after());
}

#[test]
fn it_stops_when_nothing_says_where_people_are() {
    let mode = Mode::of([2, 2, 2], Some(Fault::NoPeople), true);
    let late = mode.decisions.iter().filter(|d| d.stamp > FROM + 1.0 + 0.1);
    assert!(late.clone().count() > 20 && late.clone().all(|d| d.action == Action::Stop));
    assert!(late.clone().all(|d| d.degraded == [Degradation::PeopleUnknown]));
    assert_eq!(mode.last_reason(), Some(CommandReason::ToldToStop));
    assert!(mode.stands_after() < 1.0 + 0.3 + 2.0 + 0.5, "{:.1} s", mode.stands_after());
}

#[test]
fn without_an_arbiter_it_drives_what_is_left_of_the_horizon_and_stops() {
    for fault in [Fault::ArbiterCrash, Fault::NoRobot] {
        let mode = Mode::of([2, 2, 2], Some(fault), true);
        assert!(mode.ticks.iter().any(|tick| tick.reason() == Some(CommandReason::DecisionExpired)));
        assert!(mode.stands_after() < HOLD_AND_BRAKE, "{:.1} s", mode.stands_after());
    }
}

#[test]
fn without_a_driver_the_base_stops_by_itself() {
    let mode = Mode::of([2, 2, 2], Some(Fault::DriverCrash), true);
    assert!(mode.stands_after() < 0.3 + 2.0 + 0.3, "{:.1} s", mode.stands_after());
}
