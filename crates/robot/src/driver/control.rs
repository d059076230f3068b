//! From decision and belief to a command.

use curionav_mission::convert;
use curionav_mission::robot_limits::Ages;
use curionav_planning::arbitration::SLOW;
use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::motion::{RobotModel, step};
use curionav_planning::tracking::track;
use curionav_schemas::{Action, Belief, CommandReason, Confidence, Decision, Odometry, Reason, Scan};

use super::guard::{Arrival, Guard, Situation, Verdict};
use super::seen_way::SeenWay;
use super::told::OnItsWay;

/// What is further ahead of the robot's clock than this is of another run, or of the time before the base started
/// over, seconds.
const FUTURE_MAX: f64 = 0.2;

/// What the driver knows at one tick.
pub struct Inputs<'a> {
    /// Measured motion now.
    pub odometry: &'a Odometry,
    /// Newest belief, and odometry of its tick.
    pub belief: Option<(&'a Belief, &'a Odometry)>,
    /// Newest scan, and odometry of its tick.
    pub scan: Option<(&'a Scan, &'a Odometry)>,
    /// Why the newest scan shows too little, if it does.
    pub blind: Option<CommandReason>,
    /// What the laser has seen lately.
    pub seen: &'a SeenWay,
    /// Newest decision.
    pub decision: Option<&'a Decision>,
    /// The belief it was made from, while that is remembered.
    pub made_from: Option<&'a Belief>,
    /// What the mission lets the base do.
    pub robot: &'a RobotModel,
    /// What the base does when it has to stop.
    pub stopping: &'a RobotModel,
    /// How old belief, scan and decision may be.
    pub ages: Ages,
    /// Seconds until the next command.
    pub period: f64,
    /// What the base does before the command of now reaches it: in real time it arrives after the odometry it was
    /// made from.
    pub on_its_way: &'a [OnItsWay],
}

/// A command and why.
pub struct Command {
    /// What to drive.
    pub twist: Twist,
    /// What becomes of the decision, and why.
    pub reason: CommandReason,
}

/// The command of one tick. What is missing or old stops the robot.
pub fn command(inputs: &Inputs<'_>, guard: &mut Guard) -> Command {
    if let Some((scan, at_scan)) = inputs.scan {
        guard.see(scan, pose_of(at_scan));
    }
    let arrival = on_arrival(inputs.odometry, inputs.on_its_way, inputs.robot);
    tracked(inputs, arrival, guard).unwrap_or_else(|reason| Command {
        twist: braking(arrival.twist, inputs.stopping, inputs.period),
        reason,
    })
}

/// Fails with the first reason if something is older than `most` seconds, and with the second if it is of a time to
/// come.
fn is_current(
    age: f64,
    most: f64,
    [too_old, of_another_run]: [CommandReason; 2],
) -> Result<(), CommandReason> {
    match age {
        age if age > most => Err(too_old),
        age if age < -FUTURE_MAX => Err(of_another_run),
        _ => Ok(()),
    }
}

/// The command that tracks the decision, or the reason to stop instead.
fn tracked(inputs: &Inputs<'_>, arrival: Arrival, guard: &mut Guard) -> Result<Command, CommandReason> {
    let Inputs { odometry, robot, stopping, ages, period, .. } = *inputs;
    let now = odometry.stamp;
    let decision = inputs.decision.ok_or(CommandReason::NoDecision)?;
    if decision.action == Action::Stop {
        return Err(if decision.arrived { CommandReason::Arrived } else { CommandReason::ToldToStop });
    }
    let decision_age = now - decision.stamp;
    is_current(
        decision_age,
        decision.valid_for_s.min(ages.decision),
        [CommandReason::DecisionExpired, CommandReason::DecisionOfAnotherRun],
    )?;
    let (belief, at_belief) = inputs.belief.ok_or(CommandReason::NoBelief)?;
    let made_from = inputs.made_from.ok_or(CommandReason::DecisionBeliefUnknown)?;
    let stop = [CommandReason::BeliefTooOld, CommandReason::BeliefOfAnotherRun];
    is_current(now - belief.stamp, ages.belief, stop)?;
    if belief.health.confidence == Confidence::Lost && decision.reason != Reason::Localises {
        return Err(CommandReason::Lost);
    }
    if let Some(blind) = inputs.blind {
        return Err(blind);
    }
    let (scan, _) = inputs.scan.ok_or(CommandReason::NoScan)?;
    is_current(now - scan.stamp, ages.scan, [CommandReason::ScanTooOld, CommandReason::ScanOfAnotherRun])?;
    let reference = convert::trajectory(decision, made_from).map_err(|_| CommandReason::DecisionInvalid)?;
    // The believed pose moved on by what odometry has measured since.
    let pose = Pose2::new(belief.x, belief.y, belief.heading)
        .compose(pose_of(at_belief).relative(pose_of(odometry)));
    let moving = arrival.twist;
    let tracked = track(&reference, decision_age, pose, moving, robot, period);
    let wanted = match belief.health.confidence {
        Confidence::Sure => tracked,
        Confidence::Doubtful | Confidence::Lost => stopping.limit(moving, slow(tracked), period),
    };
    let seen = inputs.seen.slowed(wanted, pose_of(odometry), now, stopping, period);
    let pose = pose_of(odometry);
    let further_age_max = ages.scan;
    let situation = Situation { pose, now, arrival, stopping, period, further_age_max };
    let limited = |twist| stopping.limit(moving, twist, period);
    Ok(match guard.judge(seen, &situation) {
        Verdict::Safe if seen != wanted => Command { twist: limited(seen), reason: CommandReason::WayUnseen },
        Verdict::Safe if wanted != tracked => Command { twist: wanted, reason: CommandReason::InDoubt },
        Verdict::Safe => Command { twist: wanted, reason: CommandReason::Tracking },
        Verdict::Slower(twist) => Command { twist: limited(twist), reason: CommandReason::Slowed },
        Verdict::Brakes(twist) => Command { twist: limited(twist), reason: CommandReason::TooClose },
    })
}

/// The same curve at no more than the speed of a robot that doubts where it is.
fn slow(twist: Twist) -> Twist {
    let share = (SLOW / twist.v.abs()).min(1.0);
    Twist { v: share * twist.v, omega: share * twist.omega }
}

/// How the base will be moving when a command of now reaches it: as measured, and on towards the commands that are
/// still on their way. Braking from what is measured alone would ask for the same speed twice, and take twice as long.
pub fn on_arrival(odometry: &Odometry, on_its_way: &[OnItsWay], robot: &RobotModel) -> Arrival {
    let measured = Twist { v: odometry.v, omega: odometry.omega };
    let mut arrival = Arrival { pose: pose_of(odometry), twist: measured, after: 0.0 };
    for OnItsWay { twist, seconds } in on_its_way {
        arrival.twist = robot.limit(arrival.twist, *twist, *seconds);
        arrival.pose = step(arrival.pose, arrival.twist, *seconds);
        arrival.after += seconds;
    }
    arrival
}

/// Full braking on the present curve: where that leads was free when it was chosen.
pub fn braking(moving: Twist, robot: &RobotModel, period: f64) -> Twist {
    let v = robot.limit(moving, Twist::default(), period).v;
    let omega = if moving.v != 0.0 { moving.omega * v / moving.v } else { 0.0 };
    robot.limit(moving, Twist { v, omega }, period)
}

/// Where odometry has the robot.
pub fn pose_of(odometry: &Odometry) -> Pose2 {
    Pose2::new(odometry.x, odometry.y, odometry.heading)
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_mission::guard_settings::GuardSettings;
    use curionav_testing::golden;

    fn guard() -> Guard {
        Guard::new(GuardSettings::default(), Vec::new())
    }

    fn inputs<'a>(
        odometry: &'a Odometry,
        belief: &'a Belief,
        scan: &'a Scan,
        decision: &'a Decision,
        robot: &'a RobotModel,
    ) -> Inputs<'a> {
        Inputs {
            odometry,
            belief: Some((belief, odometry)),
            scan: Some((scan, odometry)),
            decision: Some(decision),
            made_from: Some(belief),
            blind: None,
            seen: &SeenWay::ALL,
            robot,
            stopping: robot,
            ages: Ages::DEFAULT,
            period: 0.1,
            on_its_way: &[],
        }
    }

    fn moving() -> (Odometry, Belief, Scan, Decision) {
        let (mut odometry, mut belief) = (golden::odometry(), golden::belief());
        let (mut scan, mut decision) = (golden::scan(), golden::decision());
        (odometry.stamp, belief.stamp, scan.stamp, decision.stamp) = (10.0, 10.0, 10.0, 10.0);
        (odometry.v, odometry.omega) = (0.5, 0.0);
        scan.ranges.0.fill(scan.range_max as f32);
        decision.action = Action::Follow;
        decision.valid_for_s = 1.2;
        let steps = 13;
        decision.dt = 0.3;
        decision.x = (0..steps).map(|k| belief.x + 0.15 * f64::from(k + 1)).collect();
        decision.y = vec![belief.y; 13].into();
        decision.heading = vec![belief.heading; 13].into();
        decision.v = vec![0.5; 13].into();
        decision.omega = vec![0.0; 13].into();
        (odometry, belief, scan, decision)
    }

    #[test]
    fn every_kind_of_age_stops_it() {
        let robot = RobotModel::default();
        let (odometry, belief, scan, decision) = moving();
        let reason = |o: &Odometry, b: &Belief, s: &Scan, d: &Decision| {
            command(&inputs(o, b, s, d, &robot), &mut guard()).reason
        };
        assert_eq!(reason(&odometry, &belief, &scan, &decision), CommandReason::Tracking);
        let mut old = decision.clone();
        old.stamp = 8.7;
        assert_eq!(reason(&odometry, &belief, &scan, &old), CommandReason::DecisionExpired);
        let mut old = belief.clone();
        old.stamp = 9.4;
        assert_eq!(reason(&odometry, &old, &scan, &decision), CommandReason::BeliefTooOld);
        let mut old = scan.clone();
        old.stamp = 9.4;
        assert_eq!(reason(&odometry, &belief, &old, &decision), CommandReason::ScanTooOld);
    }

    #[test]
    fn what_is_ahead_of_the_clock_is_no_younger_than_what_is_too_old() {
        let robot = RobotModel::default();
        let (odometry, belief, scan, decision) = moving();
        let reason =
            |b: &Belief, s: &Scan| command(&inputs(&odometry, b, s, &decision, &robot), &mut guard()).reason;
        // A tick ahead is on another way from the base; 40 s ahead is of the time before it started over.
        let (mut ahead, mut before) = (belief.clone(), belief.clone());
        (ahead.stamp, before.stamp) = (10.1, 50.0);
        assert_eq!(reason(&ahead, &scan), CommandReason::Tracking);
        assert_eq!(reason(&before, &scan), CommandReason::BeliefOfAnotherRun);
        let (mut ahead, mut before) = (scan.clone(), scan.clone());
        (ahead.stamp, before.stamp) = (10.1, 50.0);
        assert_eq!(reason(&belief, &ahead), CommandReason::Tracking);
        assert_eq!(reason(&belief, &before), CommandReason::ScanOfAnotherRun);
    }

    #[test]
    fn it_follows_while_it_tracks_and_while_it_makes_way_and_never_when_it_stops() {
        let robot = RobotModel::default();
        let (odometry, belief, mut scan, decision) = moving();
        let told =
            |s: &Scan, d: &Decision| command(&inputs(&odometry, &belief, s, d, &robot), &mut guard()).reason;
        assert!(told(&scan, &decision).follows());
        let stop = Decision { action: Action::Stop, ..decision.clone() };
        assert!(!told(&scan, &stop).follows());
        scan.ranges.0.fill(0.4);
        assert_eq!(told(&scan, &decision), CommandReason::TooClose);
    }

    #[test]
    fn in_doubt_it_brakes_to_a_slow_speed_and_when_lost_it_follows_no_plan() {
        let robot = RobotModel::default();
        let (mut odometry, mut belief, scan, mut decision) = moving();
        let told = |odometry: &Odometry, belief: &Belief, decision: &Decision| {
            let Command { twist, reason } =
                command(&inputs(odometry, belief, &scan, decision, &robot), &mut guard());
            (twist.v, reason)
        };
        belief.health.confidence = Confidence::Doubtful;
        let (v, reason) = told(&odometry, &belief, &decision);
        // 0.5 m/s less 0.5 m/s2 * 0.1 s
        assert!((v - 0.45).abs() < 1e-12 && reason == CommandReason::InDoubt, "{v} {reason:?}");
        odometry.v = 0.2;
        assert_eq!(told(&odometry, &belief, &decision), (0.2, CommandReason::InDoubt));
        belief.health.confidence = Confidence::Lost;
        let (v, reason) = told(&odometry, &belief, &decision);
        assert!(v < 0.16 && reason == CommandReason::Lost, "{v} {reason:?}");
        decision.reason = Reason::Localises;
        assert_eq!(told(&odometry, &belief, &decision), (0.2, CommandReason::InDoubt));
    }

    #[test]
    fn what_is_wrong_with_a_decision_is_said_though_its_belief_is_forgotten() {
        let robot = RobotModel::default();
        let (odometry, belief, scan, decision) = moving();
        let reason = |newest: Option<&Decision>| {
            let known = inputs(&odometry, &belief, &scan, &decision, &robot);
            command(&Inputs { decision: newest, made_from: None, ..known }, &mut guard()).reason
        };
        assert_eq!(reason(None), CommandReason::NoDecision);
        assert_eq!(reason(Some(&decision)), CommandReason::DecisionBeliefUnknown);
        let old = Decision { stamp: 8.7, ..decision.clone() };
        assert_eq!(reason(Some(&old)), CommandReason::DecisionExpired);
        let future = Decision { stamp: 10.3, ..decision.clone() };
        assert_eq!(reason(Some(&future)), CommandReason::DecisionOfAnotherRun);
        let stop = Decision { action: Action::Stop, arrived: true, ..decision.clone() };
        assert_eq!(reason(Some(&stop)), CommandReason::Arrived);
    }

    #[test]
    fn a_decision_that_leads_backwards_is_driven_where_the_laser_has_looked() {
        let robot = RobotModel { v_reverse: 0.3, ..RobotModel::default() };
        let (mut odometry, mut belief, mut scan, mut decision) = moving();
        (odometry.v, belief.v, belief.omega) = (-0.2, -0.2, 0.0);
        // Half a turn, a degree between beams.
        scan.angle_min = -std::f64::consts::FRAC_PI_2;
        scan.angle_increment = 1.0_f64.to_radians();
        scan.ranges = vec![scan.range_max as f32; 181].into();
        let (sin, cos) = curionav_planning::numerics::sin_cos(belief.heading);
        for k in 0..13 {
            let way = 0.06 * (k + 1) as f64;
            (decision.x.0[k], decision.y.0[k]) = (belief.x - way * cos, belief.y - way * sin);
            decision.v.0[k] = -0.2;
        }
        for (facing, looked) in [(0.0, false), (std::f64::consts::PI, true)] {
            scan.laser.heading = facing;
            let mut seen = SeenWay::default();
            seen.see(&scan, odometry.heading);
            let known = inputs(&odometry, &belief, &scan, &decision, &robot);
            let Command { twist, reason } = command(&Inputs { seen: &seen, ..known }, &mut guard());
            let expected = if looked { CommandReason::Tracking } else { CommandReason::WayUnseen };
            assert_eq!(reason, expected, "the laser looks to {facing} rad");
            assert!(if looked { twist.v < -0.19 } else { twist.v > -0.16 }, "{twist:?}");
        }
    }

    #[test]
    fn stopping_brakes_within_the_limits() {
        let robot = RobotModel::default();
        let (odometry, belief, scan, mut decision) = moving();
        decision.action = Action::Stop;
        // 0.5 m/s less 0.5 m/s2 * 0.1 s
        let command = command(&inputs(&odometry, &belief, &scan, &decision, &robot), &mut guard());
        assert!((command.twist.v - 0.45).abs() < 1e-12);
    }

    #[test]
    fn stopping_keeps_the_curve() {
        let twist = braking(Twist { v: 0.5, omega: 0.5 }, &RobotModel::default(), 0.1);
        assert!((twist.omega / twist.v - 1.0).abs() < 1e-12, "{twist:?}");
        let back = braking(Twist { v: -0.5, omega: 0.5 }, &RobotModel::default(), 0.1);
        assert!((back.v + 0.45).abs() < 1e-12 && (back.omega - 0.45).abs() < 1e-12, "{back:?}");
    }

    #[test]
    fn a_base_that_obeys_a_tick_late_brakes_as_hard() {
        let robot = RobotModel::default();
        let (mut odometry, belief, scan, mut decision) = moving();
        decision.action = Action::Stop;
        let (mut told, mut ticks) = (Twist { v: odometry.v, omega: 0.0 }, 0);
        while odometry.v > 0.0 {
            let on_its_way = [OnItsWay { twist: told, seconds: 0.1 }];
            let of_now =
                Inputs { on_its_way: &on_its_way, ..inputs(&odometry, &belief, &scan, &decision, &robot) };
            let next = command(&of_now, &mut guard()).twist;
            // The base carries out what it was told a tick ago.
            let reached = robot.limit(Twist { v: odometry.v, omega: 0.0 }, told, 0.1);
            (odometry.v, told, ticks) = (reached.v, next, ticks + 1);
        }
        // From 0.5 m/s at 0.5 m/s2, a tick late; rounding may leave a trace of speed for one more.
        assert!((11..=12).contains(&ticks), "{ticks} ticks");
    }
}
