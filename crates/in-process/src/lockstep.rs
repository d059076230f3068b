//! World and robot, tick by tick.

use curionav_crowdsim::scenario::PeopleKind;
use curionav_mission::fields::Fields;
use curionav_robot::arbiter::own_planner::OwnPlanner;
use curionav_schemas::{MissionEnd, Refusal, Reject, RunResult};

use crate::inject::Prepared;
use crate::judge::{Judge, outcome_of};
use crate::robot::Robot;
use crate::sensed::sense;

/// Plays `prepared` to its end.
///
/// # Errors
/// Why the mission ended without an outcome: it was refused, or the world failed.
pub fn play(prepared: Prepared, fields: &Fields) -> Result<RunResult, Box<MissionEnd>> {
    play_while(prepared, fields, &mut || true)
}

/// Plays `prepared` to its end, or until `goes_on`, which is asked before each tick, says no.
///
/// # Errors
/// As those of [`play`]; and if it does not go on, that the mission is cancelled.
pub fn play_while(
    prepared: Prepared,
    fields: &Fields,
    goes_on: &mut dyn FnMut() -> bool,
) -> Result<RunResult, Box<MissionEnd>> {
    play_by(None, prepared, fields, goes_on)
}

/// As [`play_while`], with the planner of one's own that the profile names as its generator.
///
/// # Errors
/// As those of [`play_while`].
pub fn play_by(
    own: Option<Box<dyn OwnPlanner>>,
    prepared: Prepared,
    fields: &Fields,
    goes_on: &mut dyn FnMut() -> bool,
) -> Result<RunResult, Box<MissionEnd>> {
    let Prepared { mut world, order, profile, .. } = prepared;
    if world.scenario().people.kind == PeopleKind::Live {
        let detail = "is `live`, and a run in one process has no people from elsewhere; use a deployment";
        return Err(world_failed(Refusal::invalid(detail).at("people.kind")));
    }
    let mut judge = Judge::new(order.plan_every);
    let mut robot = Robot::planned_by(own, order, fields)?;
    let outcome = loop {
        if let Some(outcome) = outcome_of(robot.mission())? {
            break outcome;
        }
        if !goes_on() {
            return Err(Box::new(MissionEnd::Cancelled));
        }
        let answer = robot.answer(sense(&world).map_err(world_failed)?)?;
        let decisions = answer.decision.as_slice();
        if let Some(outcome) = judge.tick(&world, robot.mission(), Some(answer.belief), decisions).outcome {
            break outcome;
        }
        world.step(answer.command);
    };
    judge.finish(&world, robot.mission(), &profile.name, outcome, fields).map_err(world_failed)
}

fn world_failed(reject: Reject) -> Box<MissionEnd> {
    Box::new(MissionEnd::WorldFailed { reject })
}
