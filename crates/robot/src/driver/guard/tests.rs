//! The guard against scans drawn by hand, and in a loop with a base that obeys late.

use std::f64::consts::{FRAC_PI_2, PI};

use curionav_mission::guard_settings::ZoneKind;
use curionav_planning::motion::step;
use curionav_schemas::Pose;

use super::*;
use crate::driver::control::on_arrival;
use crate::driver::told::Told;
use curionav_planning::random::{Rng, rng, standard_normal};
use curionav_schemas::Odometry;

const TICK: f64 = 0.1;
const RANGE_MAX: f64 = 10.0;

/// Something that the laser sees.
#[derive(Debug, Clone, Copy)]
enum Thing {
    /// A wall across the way, at this x, as wide as the world.
    Wall(f64),
    /// A body of this radius.
    Body { at: Point2, radius: f64 },
}

impl Thing {
    /// Range at which a ray from `from` in this direction meets it.
    fn range(&self, from: Point2, direction: Direction) -> f64 {
        match *self {
            Self::Wall(x) if direction.cos > 1e-6 => (x - from.x) / direction.cos,
            Self::Wall(_) => f64::INFINITY,
            Self::Body { at, radius } => {
                let (ahead, left) = direction.ahead_and_left(from, at);
                let half = radius * radius - left * left;
                if half < 0.0 || ahead < 0.0 { f64::INFINITY } else { (ahead - half.sqrt()).max(0.0) }
            }
        }
    }

    /// Room between it and the edge of a robot.
    fn room(&self, robot: Pose2, radius: f64) -> f64 {
        match *self {
            Self::Wall(x) => x - robot.x - radius,
            Self::Body { at, radius: body } => at.distance(robot.position()) - body - radius,
        }
    }
}

fn scan(stamp: f64, robot: Pose2, things: &[Thing], beams: u32, noise: Option<&mut Rng>) -> Scan {
    let increment = PI / f64::from(beams - 1);
    let mut noise = noise;
    let ranges: Vec<f32> = (0..beams)
        .map(|i| {
            let direction = Direction::of(robot.heading - FRAC_PI_2 + increment * f64::from(i));
            let nearest =
                things.iter().map(|t| t.range(robot.position(), direction)).fold(f64::INFINITY, f64::min);
            let off = noise.as_mut().map_or(0.0, |rng| 0.03 * standard_normal(rng));
            if nearest < RANGE_MAX { (nearest + off).clamp(0.0, RANGE_MAX) as f32 } else { RANGE_MAX as f32 }
        })
        .collect();
    Scan {
        tick: 0,
        stamp,
        angle_min: -FRAC_PI_2,
        angle_increment: increment,
        range_min: None,
        range_max: RANGE_MAX,
        laser: Pose { x: 0.0, y: 0.0, heading: 0.0 },
        ranges: ranges.into(),
    }
}

/// A base that obeys so many ticks late, with a guard between it and a planner that wants to go straight on.
struct Loop {
    guard: Guard,
    model: RobotModel,
    pose: Pose2,
    twist: Twist,
    told: Told,
    commands: Vec<Twist>,
    tick: u64,
    latency_ticks: u64,
    noise: Option<Rng>,
    beams: u32,
    /// Share of the declared brakes that the base has.
    brakes: f64,
    /// Which way the laser looks, as seen from the robot, radians.
    laser: f64,
}

impl Loop {
    fn new(model: RobotModel, latency_ticks: u64) -> Self {
        Self {
            guard: Guard::new(GuardSettings::default(), Vec::new()),
            model,
            pose: Pose2::default(),
            twist: Twist::default(),
            told: Told::default(),
            commands: Vec::new(),
            tick: 0,
            latency_ticks,
            noise: None,
            beams: 181,
            brakes: 1.0,
            laser: 0.0,
        }
    }

    fn now(&self) -> f64 {
        self.tick as f64 * TICK
    }

    /// A tick of guard and base among these things. The verdict is that of the guard.
    fn tick(&mut self, wanted: Twist, things: &[Thing]) -> Verdict {
        let Pose2 { x, y, heading } = self.pose;
        let Twist { v, omega } = self.twist;
        let odometry = Odometry { tick: self.tick, stamp: self.now(), x, y, heading, v, omega };
        let laser = Pose2 { heading: heading + self.laser, ..self.pose };
        let mut scan = scan(self.now(), laser, things, self.beams, self.noise.as_mut());
        scan.laser.heading = self.laser;
        self.guard.see(&scan, self.pose);
        let latency = self.latency_ticks as f64 * TICK;
        let on_its_way = self.told.on_its_way(self.tick, latency, TICK);
        let arrival = on_arrival(&odometry, &on_its_way, &self.model);
        let told = self.model.limit(arrival.twist, wanted, TICK);
        let situation = Situation {
            pose: self.pose,
            now: self.now(),
            arrival,
            stopping: &self.model,
            period: TICK,
            further_age_max: 0.5,
        };
        let verdict = self.guard.judge(told, &situation);
        let command = match verdict {
            Verdict::Safe => told,
            Verdict::Slower(twist) | Verdict::Brakes(twist) => self.model.limit(arrival.twist, twist, TICK),
        };
        self.told.tell(self.tick, command);
        self.commands.push(command);
        let due = (self.commands.len() as u64).checked_sub(self.latency_ticks + 1);
        let due = due.map_or(Twist::default(), |due| self.commands[due as usize]);
        let base = RobotModel { a_max: self.model.a_max * self.brakes, ..self.model.clone() };
        self.twist = if due.v.abs() < self.twist.v.abs() {
            base.limit(self.twist, due, TICK)
        } else {
            self.model.limit(self.twist, due, TICK)
        };
        self.pose = step(self.pose, self.twist, TICK);
        self.tick += 1;
        verdict
    }
}

fn model(v_max: f64, a_max: f64) -> RobotModel {
    RobotModel { v_max, a_max, ..RobotModel::default() }
}

fn straight(v: f64) -> Twist {
    Twist { v, omega: 0.0 }
}

/// Least room to a wall that is `distance` metres from the edge of a robot at rest, which wants to drive on.
fn least_room(model: &RobotModel, distance: f64, latency_ticks: u64, noise: Option<u64>) -> f64 {
    let wall = Thing::Wall(distance + model.radius());
    let mut drive = Loop::new(model.clone(), latency_ticks);
    drive.noise = noise.map(|seed| rng(seed, 0));
    drive.brakes = 0.9;
    // Fewer suffice for a wall, and take half of the time.
    drive.beams = 91;
    let mut least = f64::INFINITY;
    let mut stood = 0;
    while stood < 5 && drive.tick < 400 {
        drive.tick(straight(model.v_max), &[wall]);
        least = least.min(wall.room(drive.pose, model.radius()));
        stood = if drive.twist.v < 1e-3 && drive.tick > 5 { stood + 1 } else { 0 };
    }
    least
}

/// Greatest speed, m/s, and brakes that a base of this speed needs, m/s2.
const SPEEDS: [(f64, f64); 7] =
    [(0.3, 0.5), (0.5, 0.5), (0.8, 0.5), (1.0, 0.5), (1.2, 1.0), (1.5, 1.0), (2.0, 2.0)];

#[test]
fn no_wall_is_touched_from_any_distance_at_any_speed_however_late_the_base_is() {
    let rows = in_parallel(|v, a| {
        let mut rows = Vec::new();
        for latency in 0..=2 {
            let least = |step: usize, noise: bool| {
                let rooms = (20..=500).step_by(step).map(|centimetre: u64| {
                    let distance = centimetre as f64 * 0.01;
                    least_room(&model(v, a), distance, latency, noise.then_some(centimetre))
                });
                rooms.fold(f64::INFINITY, f64::min)
            };
            rows.push((format!("{v} m/s, {a} m/s2, {latency} ticks"), least(1, false), least(10, true)));
        }
        rows
    });
    for (what, least, noisy) in rows {
        println!("{what}: least room {least:.3} m, with noise {noisy:.3} m");
        assert!(least > 0.0 && noisy > 0.0, "{what}");
    }
}

/// What `run` gives for each of [`SPEEDS`], in their order.
fn in_parallel<T: Send>(run: impl Fn(f64, f64) -> Vec<T> + Sync) -> Vec<T> {
    let run = &run;
    std::thread::scope(|scope| {
        let threads = SPEEDS.map(|(v, a)| scope.spawn(move || run(v, a)));
        threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect()
    })
}

/// The robot's speed when a body that comes at `speed`, so far to the side, meets it. It could be seen for 1.5 s before
/// they would have met.
fn meeting(model: &RobotModel, speed: f64, latency_ticks: u64, side: f64, noise: Option<u64>) -> f64 {
    let mut drive = Loop::new(model.clone(), latency_ticks);
    drive.noise = noise.map(|seed| rng(seed, 1));
    while drive.twist.v < model.v_max - 1e-6 {
        drive.tick(straight(model.v_max), &[]);
    }
    let radius = 0.25;
    let touching = model.radius() + radius;
    let ahead = (touching * touching - side * side).sqrt() + (model.v_max + speed) * 1.5;
    let mut at = Point2::new(drive.pose.x + ahead, side);
    for _ in 0..100 {
        let body = Thing::Body { at, radius };
        drive.tick(straight(model.v_max), &[body]);
        at.x -= speed * TICK;
        if at.distance(drive.pose.position()) <= touching {
            return drive.twist.v;
        }
    }
    0.0
}

#[test]
fn who_comes_and_can_be_seen_in_time_is_met_slowly() {
    let rows = in_parallel(|v, a| {
        let mut rows = Vec::new();
        for latency in 0..=2 {
            let mut worst: f64 = 0.0;
            let mut noisy: f64 = 0.0;
            for decimetres in 0..=16_u64 {
                let speed = decimetres as f64 * 0.1;
                for side in [0.0, 0.2, 0.4] {
                    worst = worst.max(meeting(&model(v, a), speed, latency, side, None));
                    noisy = noisy.max(meeting(&model(v, a), speed, latency, side, Some(decimetres)));
                }
            }
            rows.push((format!("{v} m/s, {a} m/s2, {latency} ticks"), worst, noisy));
        }
        rows
    });
    for (what, worst, noisy) in rows {
        println!("{what}: met at {worst:.2} m/s, with noise {noisy:.2} m/s");
        assert!(worst <= 0.3 && noisy <= 0.35, "{what}");
    }
}

#[test]
fn a_zone_slows_or_stops_whichever_way_the_robot_goes() {
    let corner = |x, y| Point2::new(x, y);
    let vertices = vec![corner(0.3, -0.5), corner(1.5, -0.5), corner(1.5, 0.5), corner(0.3, 0.5)];
    let zone =
        |kind, speed| Zone { name: "front".into(), kind, vertices: vertices.clone(), speed, points: 4 };
    let body = Thing::Body { at: Point2::new(1.2, -0.45), radius: 0.1 };
    let verdict = |zone: Zone, wanted: Twist| {
        let mut drive = Loop::new(model(1.0, 0.5), 0);
        drive.guard = Guard::new(GuardSettings::default(), vec![zone]);
        drive.twist = straight(0.4);
        drive.tick(wanted, &[body]);
        drive.tick(wanted, &[body])
    };
    let turn = Twist { v: 0.0, omega: 0.3 };
    assert_eq!(verdict(zone(ZoneKind::Stop, None), turn), Verdict::Brakes(Twist::default()));
    let slow = verdict(zone(ZoneKind::Slow, Some(0.2)), straight(1.0));
    assert!(matches!(slow, Verdict::Brakes(twist) if twist.v == 0.2), "{slow:?}");
    let noise = Zone { points: 100, ..zone(ZoneKind::Stop, None) };
    assert_eq!(verdict(noise, straight(0.4)), Verdict::Safe);
}

/// A scan of a camera that says nothing of where it sees nothing.
fn of_camera(stamp: f64, robot: Pose2, thing: Thing) -> Scan {
    let mut seen = scan(stamp, robot, &[thing], 181, None);
    seen.ranges.0.iter_mut().filter(|range| **range >= RANGE_MAX as f32).for_each(|range| *range = f32::NAN);
    seen
}

#[test]
fn a_table_top_that_the_laser_does_not_see_is_not_touched() {
    let table = Thing::Body { at: Point2::new(3.0, 0.1), radius: 0.3 };
    let least = |has_camera: bool| {
        let mut drive = Loop::new(model(1.0, 0.5), 1);
        let mut least = f64::INFINITY;
        for _ in 0..80 {
            if has_camera {
                let seen = of_camera(drive.now(), drive.pose, table);
                drive.guard.see_further("camera", &seen, drive.pose);
            }
            drive.tick(straight(1.0), &[]);
            least = least.min(table.room(drive.pose, drive.model.radius()));
        }
        least
    };
    assert!(least(false) < 0.0, "the laser alone drives into it");
    assert!((0.0..0.2).contains(&least(true)), "{} m of room", least(true));
}

#[test]
fn what_a_further_sensor_saw_counts_for_as_long_as_a_scan_may_be_old() {
    let near = Thing::Body { at: Point2::new(0.8, 0.0), radius: 0.3 };
    let verdict = |age: f64| {
        let mut drive = Loop::new(model(1.0, 0.5), 0);
        drive.twist = straight(0.5);
        drive.guard.see_further("camera", &of_camera(-age, Pose2::default(), near), Pose2::default());
        drive.tick(straight(0.5), &[])
    };
    assert!(matches!(verdict(0.0), Verdict::Brakes(_)) && matches!(verdict(0.45), Verdict::Brakes(_)));
    assert_eq!(verdict(0.55), Verdict::Safe);
}

#[test]
fn a_pressed_bumper_stops_the_robot_until_it_has_turned_away() {
    let verdict = |bearing: f64, wanted: Twist| {
        let mut drive = Loop::new(model(1.0, 0.5), 0);
        let radius = drive.model.radius();
        let bumper = Scan {
            angle_min: bearing - 0.5,
            angle_increment: 0.05,
            ranges: vec![radius as f32; 21].into(),
            ..scan(0.0, Pose2::default(), &[], 2, None)
        };
        drive.twist = straight(wanted.v);
        drive.guard.see_further("bumper", &bumper, Pose2::default());
        drive.tick(wanted, &[])
    };
    assert_eq!(verdict(0.0, straight(0.3)), Verdict::Brakes(Twist::default()));
    assert_eq!(verdict(PI, straight(0.3)), Verdict::Safe, "what touches it behind is left");
    let turning = Twist { v: 0.0, omega: 0.5 };
    assert_eq!(verdict(0.0, turning), Verdict::Safe);
}

/// A robot drives along x for so many ticks, with its tail ahead if `sign` is -1. At each: its speed in that direction,
/// where it is, and the room that is left to `thing`.
fn along_x(sign: f64, latency_ticks: u64, thing: Thing, ticks: u64) -> Vec<(f64, f64, f64)> {
    let backs = RobotModel { v_reverse: 0.5, v_max: 0.5, ..RobotModel::default() };
    let mut drive = Loop::new(backs, latency_ticks);
    let facing = if sign < 0.0 { PI } else { 0.0 };
    (drive.pose.heading, drive.laser) = (facing, facing);
    let mut driven = Vec::new();
    for _ in 0..ticks {
        drive.tick(straight(sign * 0.5), &[thing]);
        driven.push((sign * drive.twist.v, drive.pose.x, thing.room(drive.pose, drive.model.radius())));
    }
    driven
}

#[test]
fn backwards_it_stops_before_the_same_things_as_forwards() {
    let wall = Thing::Wall(2.0);
    let body = Thing::Body { at: Point2::new(1.6, 0.2), radius: 0.25 };
    for thing in [wall, body] {
        for latency in 0..=2 {
            let ahead = along_x(1.0, latency, thing, 150);
            let back = along_x(-1.0, latency, thing, 150);
            for ((v, x, _), (v_back, x_back, room)) in ahead.iter().zip(&back) {
                assert!((v - v_back).abs() < 1e-6 && (x - x_back).abs() < 1e-6, "{thing:?}, {latency}");
                assert!(*room > 0.0, "{thing:?}, {latency}: {room} m of room");
            }
            let (v, x, _) = back[149];
            assert!(v < 1e-6 && x > 0.5, "{thing:?}, {latency}: {v} m/s at {x} m");
        }
    }
}

#[test]
fn backwards_is_safe_where_nothing_stands_behind() {
    let mut drive = Loop::new(RobotModel { v_reverse: 0.3, ..RobotModel::default() }, 0);
    drive.laser = PI;
    for _ in 0..20 {
        assert_eq!(drive.tick(straight(-0.3), &[]), Verdict::Safe);
    }
    assert!((drive.twist.v + 0.3).abs() < 1e-12);
    // It still rolls when something stands there at once.
    let near = Thing::Body { at: Point2::new(drive.pose.x - 0.6, 0.0), radius: 0.25 };
    assert!(matches!(drive.tick(straight(-0.3), &[near]), Verdict::Brakes(_)));
    assert!(drive.twist.v > -0.3);
}
