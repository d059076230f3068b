//! Every limit of the contract, with its reason. A reader refuses what exceeds one; a writer must not send it.

pub(crate) const KIB: usize = 1024;
pub(crate) const MIB: usize = 1024 * KIB;

/// Milliseconds a question may be worked on: as long as a stage of a cycle in lockstep, which only catches what hangs.
pub const MAX_BUDGET_MS: u32 = 10_000;
/// Candidates in a batch: twice the 2000 of Nav2 MPPI, the largest batch the planner is budgeted for.
pub const MAX_CANDIDATES: usize = 4096;
/// States in a candidate: a profile of ours has 57 (17.1 s); 256 leaves room for long horizons.
pub const MAX_STEPS: usize = 256;
/// People in a message: far more than a laser and a camera can track, few enough for a quadratic step.
pub const MAX_PEOPLE: usize = 1024;
/// Beams in a scan: the densest common lidars send 2000 to 4000 a turn.
pub const MAX_BEAMS: usize = 8192;
/// Further sensors of a robot beside its scanner: cameras to all sides, a ring of bumpers, and some more.
pub const MAX_SENSORS: usize = 8;
/// Cells of a map in a scene on which something stands that is on no map: 200 m of outlines in cells of 0.05 m.
pub const MAX_OBSTACLE_CELLS: usize = 4096;
/// Points of a way that is given: 200 m with one every 0.2 m.
pub const MAX_WAY_POINTS: usize = 1024;
/// Nodes in a search tree: some ten times what a cycle's budget grows.
pub const MAX_TREE_NODES: usize = 16_384;
/// Columns of a search tree: the generator that has most has five.
pub const MAX_TREE_COLUMNS: usize = 8;
/// Numbers in such a column: two per node, as a generator of one's own may have points.
pub const MAX_COLUMN_NUMBERS: usize = 2 * MAX_TREE_NODES;
/// Search trees an arbiter carries on: a profile may ask for eight.
pub const MAX_TREES: usize = 8;
/// Particles in a message: more than a localiser starts with; of more, an even choice shows the same cloud.
pub const MAX_PARTICLES: usize = 8192;
/// Cells in a map: 200 m x 200 m at 0.05 m; sixteen megabytes.
pub const MAX_MAP_CELLS: usize = 16_000_000;
/// Bytes of UTF-8 in a text: a reason fits in a line or two.
pub const MAX_TEXT: usize = 1024;
/// Characters in an identifier (robot, instance, role, term, world): it becomes one chunk of a key.
pub const MAX_ID: usize = 64;
/// Entries in a list of roles or degradations, of what a service is prepared for (of more, the most recent),
/// and of measures of a run.
pub const MAX_LIST: usize = 64;
/// The identity, in scenes and reasons, of what only the driver sees; no tracker gives it.
pub const UNSEEN_PERSON: u32 = u32::MAX;
/// Most contacts of a result that are told one by one.
pub const MAX_CONTACTS: usize = 256;
/// Samples in a service's status: the arbiter, which says most, has under two hundred.
pub const MAX_METRICS: usize = 512;
/// Bytes in the name of such a sample, labels included.
pub const MAX_METRIC_NAME: usize = 255;
/// Terms in a cost: the paper has three.
pub const MAX_TERMS: usize = 32;
/// Vertices of a footprint polygon: robots are described with a dozen at most.
pub const MAX_VERTICES: usize = 64;
/// Files in an injected scenario: its map, its map's description, and what they name.
pub const MAX_FILES: usize = 32;
/// Bytes in the name of an injected file.
pub const MAX_FILE_NAME: usize = 255;
/// Rows of a run's trace: 10 hours at 10 Hz, if they are short enough for the message.
pub const MAX_TRACE_ROWS: usize = 360_000;
/// Columns of a run's trace.
pub const MAX_TRACE_COLUMNS: usize = 64;
/// Data items in a message (numbers inside typed arrays do not count). The fullest honest message, a report that says
/// of each of [`MAX_CANDIDATES`] why it was rejected, has about 46,000; this bounds the memory of free-form parameters.
pub const MAX_ITEMS: usize = 65_536;
/// Nesting of arrays, maps and tags. The deepest message nests 6; free-form parameters may add ten.
pub const MAX_DEPTH: usize = 16;
/// Farthest that a laser may sit from the robot's centre, m: no service robot is larger.
pub const MAX_LASER_DISTANCE: f64 = 5.0;
/// Greatest heading that is asked for, rad: a turn either way, as messages write it. More is probably meant as degrees.
#[expect(clippy::approx_constant, reason = "the end of a range as it is written, to four digits")]
pub const MAX_HEADING: f64 = 6.2832;
/// Largest magnitude of a number with a meaning (metres, seconds, costs): products of a few stay finite.
pub const MAX_MAGNITUDE: f64 = 1e12;
