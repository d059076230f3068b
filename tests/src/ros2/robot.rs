//! A simulated robot with a laser, odometry, transforms and a map, that obeys `cmd_vel`.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use curionav_crowdsim::{Observation, World};
use curionav_deployment::package::{self, Choice};
use curionav_in_process::prepare;
use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::numerics::sin_cos;
use curionav_ros2::messages as ros;
use curionav_ros2::qos::Qos;
use curionav_runtime::fields::Fields;
use curionav_runtime::locked::locked;
use curionav_schemas::{Clock, OccupancyGrid};
use tokio::task::JoinHandle;
use zenoh_ext::AdvancedPublisher;

use super::peer::{Heard, Peer};
use crate::end_to_end::program::root;

/// Wall time of a tick: the driver compares the robot's clock with its own.
const PACE: Duration = Duration::from_millis(100);
/// The base's own watchdog.
const COMMAND_AGE: Duration = Duration::from_millis(500);
/// When the robot's clock was switched on, s.
const EPOCH: f64 = 1_800_000_000.0;

/// Changes a scan.
pub(super) type Spoils = fn(&mut ros::LaserScan);

/// A laser that is well.
pub(super) const WELL: Spoils = |_| {};

pub(super) struct Robot {
    pub(super) peer: Arc<Peer>,
    pub(super) world: Arc<Mutex<World>>,
    pub(super) map: OccupancyGrid,
    pub(super) commands: Arc<Heard<ros::TwistStamped>>,
    /// Whether scans and odometry are sent.
    pub(super) scans: Arc<AtomicBool>,
    pub(super) odometry: Arc<AtomicBool>,
    /// What becomes of scans before they are sent.
    pub(super) spoils: Arc<Mutex<Spoils>>,
    /// Milliseconds that the clock is set back by.
    pub(super) back_ms: Arc<AtomicU64>,
    /// What it has besides a laser.
    pub(super) further: Arc<Further>,
    _tf: AdvancedPublisher<'static>,
    playing: JoinHandle<()>,
}

/// A camera, a bumper and a costmap.
#[derive(Default)]
pub(super) struct Further {
    /// Where the camera sees a round table on the map, over whose foot the laser looks.
    pub(super) table: Mutex<Option<Point2>>,
    /// Whether the bumper is pressed.
    pub(super) pressed: AtomicBool,
    /// Whether there is a costmap, which begins empty and from then on tells of changes alone.
    pub(super) costmap: AtomicBool,
    has_costmap_begun: AtomicBool,
}

/// Cells along a side of the costmap, and the side of a cell, m. The robot is in its middle.
const COSTMAP: (u32, f64) = (60, 0.1);

/// Radius of the table, m.
pub(super) const TABLE: f64 = 0.3;

impl Further {
    fn say_costmap(&self, peer: &Peer, robot: Pose2, stamp: f64) {
        let (side, cell) = COSTMAP;
        let corner = -0.5 * f64::from(side) * cell;
        if !self.has_costmap_begun.swap(true, Ordering::Relaxed) {
            let info = ros::MapMetaData {
                resolution: cell as f32,
                width: side,
                height: side,
                origin: pose(Pose2::new(corner, corner, 0.0)),
                ..Default::default()
            };
            let data = vec![0; (side * side) as usize];
            peer.put("costmap", &ros::OccupancyGrid { header: header(stamp, "laser"), info, data });
            return;
        }
        let table = locked(&self.table).map(|table| robot.inverse_transform(table));
        let cells = (0..side * side).map(|at| {
            let x = corner + (f64::from(at % side) + 0.5) * cell;
            let y = corner + (f64::from(at / side) + 0.5) * cell;
            match table {
                Some(table) if table.distance(Point2::new(x, y)) <= TABLE => 100,
                _ => 0,
            }
        });
        let changes = ros::OccupancyGridUpdate {
            header: header(stamp, "laser"),
            x: 0,
            y: 0,
            width: side,
            height: side,
            data: cells.collect(),
        };
        peer.put("costmap_updates", &changes);
    }

    fn say(&self, peer: &Peer, robot: Pose2, stamp: f64) {
        peer.put("bumper", &ros::Bool { data: self.pressed.load(Ordering::Relaxed) });
        if self.costmap.load(Ordering::Relaxed) {
            self.say_costmap(peer, robot, stamp);
        }
        let Some(table) = *locked(&self.table) else { return };
        let edge = (0..60).flat_map(|k| {
            let (sin, cos) = sin_cos(0.1 * f64::from(k));
            let edge = Point2::new(table.x + TABLE * cos, table.y + TABLE * sin);
            let Point2 { x, y } = robot.inverse_transform(edge);
            // What is behind the robot no camera sees.
            let place = if x > 0.0 { [x as f32, y as f32, 0.7] } else { [f32::NAN; 3] };
            place.into_iter().flat_map(f32::to_le_bytes)
        });
        let data: Vec<u8> = edge.collect();
        let field = |(name, offset): (&str, u32)| ros::PointField {
            name: name.into(),
            offset,
            datatype: ros::PointField::FLOAT32,
            count: 1,
        };
        let cloud = ros::PointCloud2 {
            header: header(stamp, "laser"),
            height: 1,
            width: 60,
            fields: [("x", 0), ("y", 4), ("z", 8)].map(field).into(),
            point_step: 12,
            row_step: 720,
            data,
            ..Default::default()
        };
        peer.put("camera/points", &cloud);
    }
}

pub(super) fn pose(pose: Pose2) -> ros::Pose {
    let (z, w) = sin_cos(0.5 * pose.heading);
    ros::Pose {
        position: ros::Point { x: pose.x, y: pose.y, z: 0.0 },
        orientation: ros::Quaternion { x: 0.0, y: 0.0, z, w },
    }
}

fn header(stamp: f64, frame: &str) -> ros::Header {
    ros::Header { stamp: ros::Time::from_nanoseconds(((EPOCH + stamp) * 1e9) as i64), frame_id: frame.into() }
}

impl Robot {
    /// The robot of quickstart behind `endpoint`, without a map until it is told.
    pub(super) async fn start(endpoint: &str, namespace: &str) -> Self {
        Self::of(&root().join("scenarios/quickstart.toml"), endpoint, namespace).await
    }

    /// The robot of this scenario file.
    pub(super) async fn of(scenario: &Path, endpoint: &str, namespace: &str) -> Self {
        let package = package::read(scenario, &Choice::default(), Clock::Realtime, 1.0).unwrap();
        let prepared = prepare(&package.request, "robot", &Fields::of_maps([])).ok().unwrap();
        let peer = Arc::new(Peer::new(endpoint, namespace).await);
        let mount = ros::TransformStamped {
            header: header(0.0, "base_link"),
            child_frame_id: "laser".into(),
            transform: ros::Transform { rotation: pose(Pose2::default()).orientation, ..Default::default() },
        };
        let tf = peer.latched("tf_static", &ros::TfMessage { transforms: vec![mount] });
        let commands = Arc::new(peer.hear("cmd_vel", Qos::DEFAULT));
        let world = Arc::new(Mutex::new(prepared.world));
        let [scans, odometry] = [true, true].map(|on| Arc::new(AtomicBool::new(on)));
        let back_ms = Arc::<AtomicU64>::default();
        let spoils = Arc::new(Mutex::new(WELL));
        let further = Arc::<Further>::default();
        let playing = tokio::spawn(play(
            Arc::clone(&peer),
            Arc::clone(&world),
            Arc::clone(&commands),
            [Arc::clone(&scans), Arc::clone(&odometry)],
            Arc::clone(&spoils),
            Arc::clone(&back_ms),
            Arc::clone(&further),
        ));
        let map = prepared.map;
        Self { peer, world, map, commands, scans, odometry, spoils, back_ms, further, _tf: tf, playing }
    }

    /// Publishes the map, which then stays for late subscribers.
    pub(super) fn publish_map(&self) -> AdvancedPublisher<'static> {
        let origin = self.map.origin;
        let map = ros::OccupancyGrid {
            header: header(0.0, "map"),
            info: ros::MapMetaData {
                resolution: self.map.resolution as f32,
                width: self.map.width,
                height: self.map.height,
                origin: pose(Pose2::new(origin.x, origin.y, origin.heading)),
                ..Default::default()
            },
            data: self.map.cells.0.clone(),
        };
        self.peer.latched("map", &map)
    }

    /// Says where the robot is, as rviz does.
    pub(super) fn say_pose(&self) {
        let at = locked(&self.world).truth().pose;
        let mut covariance = [[0.0; 6]; 6];
        (covariance[0][0], covariance[1][1], covariance[5][5]) = (0.25, 0.25, 0.07);
        let pose = ros::PoseWithCovariance { pose: pose(at), covariance };
        self.peer.put("initialpose", &ros::PoseWithCovarianceStamped { header: header(0.0, "map"), pose });
    }

    /// Publishes the map, says where the robot is, and waits until it is localised.
    pub(super) async fn localise(&self) -> AdvancedPublisher<'static> {
        let map = self.publish_map();
        let poses = self.peer.hear::<ros::PoseWithCovarianceStamped>("amcl_pose", Qos::DEFAULT);
        self.say_pose();
        poses.that(|_| true).await;
        map
    }

    pub(super) fn truth(&self) -> Pose2 {
        locked(&self.world).truth().pose
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        self.playing.abort();
    }
}

/// A goal in a frame.
pub(super) fn goal(frame: &str, x: f64, y: f64) -> ros::PoseStamped {
    ros::PoseStamped { header: header(0.0, frame), pose: pose(Pose2::new(x, y, 0.0)) }
}

async fn play(
    peer: Arc<Peer>,
    world: Arc<Mutex<World>>,
    commands: Arc<Heard<ros::TwistStamped>>,
    [scans, odometry]: [Arc<AtomicBool>; 2],
    spoils: Arc<Mutex<Spoils>>,
    back_ms: Arc<AtomicU64>,
    further: Arc<Further>,
) {
    let mut pace = tokio::time::interval(PACE);
    pace.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Burst);
    let (mut heard, mut last) = (0, Instant::now());
    loop {
        pace.tick().await;
        if commands.count() > heard {
            (heard, last) = (commands.count(), Instant::now());
        }
        let newest = commands.newest().filter(|_| last.elapsed() < COMMAND_AGE);
        let told =
            newest.map_or(Twist::default(), |c| Twist { v: c.twist.linear.x, omega: c.twist.angular.z });
        let Observation { stamp, ranges, odometry: at, twist, people, .. } = {
            let mut world = locked(&world);
            world.step(told);
            world.observe()
        };
        let laser = locked(&world).scenario().laser;
        let stamp = stamp - back_ms.load(Ordering::Relaxed) as f64 * 1e-3;
        if scans.load(Ordering::Relaxed) {
            // A beam that hit nothing is infinite in ROS.
            let most = laser.range_max as f32;
            let shown = ranges.iter().map(|range| if *range >= most { f32::INFINITY } else { *range });
            let mut scan = ros::LaserScan {
                header: header(stamp, "laser"),
                angle_min: laser.bearing(0) as f32,
                angle_max: laser.bearing(laser.beams - 1) as f32,
                angle_increment: (laser.bearing(1) - laser.bearing(0)) as f32,
                range_min: 0.02,
                range_max: most,
                ranges: shown.collect(),
                ..Default::default()
            };
            locked(&spoils)(&mut scan);
            peer.put("scan", &scan);
        }
        let persons = (0..people.len()).map(|i| ros::Person {
            name: people.id[i].to_string(),
            position: ros::Point { x: people.x[i], y: people.y[i], z: 1.2 },
            velocity: ros::Point { x: people.vx[i], y: people.vy[i], z: 0.4 },
            ..Default::default()
        });
        peer.put("people", &ros::People { header: header(stamp, "map"), people: persons.collect() });
        let truth = locked(&world).truth().pose;
        further.say(&peer, truth, stamp);
        if odometry.load(Ordering::Relaxed) {
            let mut said = ros::Odometry {
                header: header(stamp, "odom"),
                child_frame_id: "base_link".into(),
                ..Default::default()
            };
            said.pose.pose = pose(at);
            (said.twist.twist.linear.x, said.twist.twist.angular.z) = (twist.v, twist.omega);
            peer.put("odom", &said);
        }
    }
}
