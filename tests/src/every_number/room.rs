//! A small room in which nothing takes long.

use std::path::Path;

use curionav_planning::geometry::Pose2;
use curionav_planning::occupancy::{OccupancyGrid, StaticMap};

/// A scenario that leaves out no field but the tables of localiser, tracker and profile.
pub(super) const SCENARIO: &str = r#"
name = "room"
description = "Every field of a scenario."
[map]
file = "room.yaml"
keepout = "unmarked.yaml"
speed = "unmarked.yaml"
speed_base = 100.0
speed_multiplier = -1.0
[robot]
start = [1.0, 2.0, 0.0]
goal = [5.0, 2.0]
goal_heading = 0.0
goal_tolerance = 0.5
initial_sigma = [0.2, 0.2, 0.1]
start_noise = 0.5
[robot.model]
v_max = 1.0
a_max = 0.5
omega_max = 1.0
alpha_max = 1.0
v_reverse = 0.1
footprint = { shape = "disc", radius = 0.3 }
[laser]
robot_from_laser = { x = 0.1, y = 0.0, heading = 0.0 }
fov = 3.0
beams = 91
range_max = 5.0
range_sigma = 0.03
[laser_faults]
silent_share = 0.02
noise_m = 0.01
moved = [0.01, 0.0, 0.0]
late_s = 0.1
[world]
file = "room.yaml"
openings = [{ corners = [[0.0, 0.0], [0.2, 0.0], [0.2, 0.2]] }]
[[world.objects]]
at = [5.4, 0.6, 0.3]
size = [0.4, 0.2]
from_s = 0.1
until_s = 40.0
route = []
speed = 0.5
low = true
glass = 0.0
[[world.objects]]
at = [5.0, 0.6, 0.3]
radius = 0.1
from_s = 0.0
until_s = 40.0
route = [[5.4, 0.6]]
speed = 0.5
low = false
glass = 0.0
[[world.objects]]
at = [5.0, 0.6, 0.0]
corners = [[0.0, 0.0], [0.2, 0.0], [0.0, 0.2]]
from_s = 0.0
until_s = 40.0
route = []
speed = 0.5
low = false
glass = 0.8
[[world.events]]
at_s = 0.3
laser = { silent_share = 0.0, noise_m = 0.0, moved = [0.0, 0.0, 0.0], late_s = 0.0 }
carried_to = [1.0, 1.0, 0.0]
[odometry_noise]
position_per_metre = 0.004
position_per_radian = 0.001
heading_per_metre = 0.004
heading_per_radian = 0.006
[perception]
people = "all"
frame = "map"
source = "truth"
[clock]
tick_s = 0.1
plan_every = 3
time_limit_s = 0.9
[people]
radius = 0.25
shape = "disc"
kind = "scenario"
live_patience_s = 10.0
motion = "hrvo"
[people.hrvo]
neighbor_distance = 5.0
max_neighbors = 10
goal_radius = 0.3
max_speed_factor = 1.3
max_accel = 2.0
uncertainty_offset = 0.0
wall_horizon_s = 0.5
[people.social_force]
relaxation_s = 0.54
strength = 4.5
reach = 0.35
turn_sharpness = 2.0
slow_sharpness = 3.0
foresight = 2.0
side = 0.005
wall_strength = 3.0
wall_reach = 0.1
neighbor_distance = 8.0
goal_radius = 0.3
max_speed_factor = 1.3
[[walkers]]
route = [[4.0, 1.0], [4.0, 3.0]]
speed = 0.6
mode = "back-and-forth"
start_offset = 0.5
pause_s = 1.0
heedless = true
[[recorded]]
file = "people.txt"
format = "text"
fps = 10.0
start_s = 0.0
start_until_s = 1.0
pose = [0.0, 0.0, 0.0]
ids = [1]
loop = true
[[crowds]]
count = 2
behaviour = "walk"
regions = [{ corners = [[2.5, 0.5], [5.5, 0.5], [5.5, 2.5], [2.5, 2.5]] }, { corners = [[2.5, 2.5], [5.5, 2.5], [5.5, 3.5], [2.5, 3.5]] }]
places = 2
stretch_m = [0.5, 3.0]
speed = [0.3, 1.0]
pause_s = [0.0, 1.0]
group = [1, 1]
apart_m = 0.5
heedless = 0.2
[planner]
profile = "curiosity"
"#;

/// A person who walks along the upper wall: frame, id, x, y.
pub(super) const RECORDING: &str = "0 1 2.0 3.5\n10 1 3.0 3.5\n20 1 4.0 3.5\n30 1 5.0 3.5\n";

const YAML: &str = "image: room.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
const WIDTH: usize = 60;
const HEIGHT: usize = 40;

/// The room in a folder of its own, and as a map.
pub(super) struct Room {
    pub(super) folder: tempfile::TempDir,
    pub(super) map: StaticMap,
}

impl Room {
    pub(super) fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let wall = |i: usize| [0, WIDTH - 1].contains(&(i % WIDTH)) || [0, HEIGHT - 1].contains(&(i / WIDTH));
        let pixels: Vec<u8> = (0..WIDTH * HEIGHT).map(|i| if wall(i) { 0 } else { 254 }).collect();
        let pgm = [format!("P5\n{WIDTH} {HEIGHT}\n255\n").into_bytes(), pixels].concat();
        let write = |name: &str, content: &[u8]| std::fs::write(folder.path().join(name), content).unwrap();
        write("room.pgm", &pgm);
        write("room.yaml", YAML.as_bytes());
        write("people.txt", RECORDING.as_bytes());
        // A mask without a mark: whatever its marks mean, it can be run.
        write(
            "unmarked.pgm",
            &[format!("P5\n{WIDTH} {HEIGHT}\n255\n").into_bytes(), vec![254; WIDTH * HEIGHT]].concat(),
        );
        write("unmarked.yaml", YAML.replace("room.pgm", "unmarked.pgm").as_bytes());
        let cells = (0..WIDTH * HEIGHT).map(|i| if wall(i) { 100 } else { 0 }).collect();
        let grid = OccupancyGrid::new(WIDTH, HEIGHT, 0.1, Pose2::default(), cells).unwrap();
        Self { folder, map: StaticMap::new(grid) }
    }

    pub(super) fn path(&self) -> &Path {
        self.folder.path()
    }
}
