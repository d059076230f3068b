//! Every limit of what is read and written, with its reason. A length is compared with its limit before anything is
//! allocated for it.

/// Bytes of a text: names of frames and nodes, and the sentences of diagnostics.
pub const TEXT: usize = 1024;
/// Beams of a scan: the densest common lidars send 2000 to 4000 a turn.
pub const BEAMS: usize = 8192;
/// Bytes of all points of a cloud: half a million of 32 bytes, more than a camera of 800 x 600 sends.
pub const CLOUD_BYTES: usize = 16 << 20;
/// Fields of a point: lidars have a dozen.
pub const FIELDS: usize = 64;
/// Cells of a map: 200 m x 200 m at 0.05 m.
pub const CELLS: usize = 16_000_000;
/// Poses of a path: 400 m at 0.1 m.
pub const POSES: usize = 4096;
/// Transforms in one message: robots with arms and hands have a few hundred frames.
pub const TRANSFORMS: usize = 1024;
/// People in one message: far more than a laser and a camera can track.
pub const PEOPLE: usize = 1024;
/// Tags of a person.
pub const TAGS: usize = 64;
/// Markers in one message: one for each candidate of a cycle.
pub const MARKERS: usize = 4096;
/// Points, colours and corners of one marker: all states of many candidates.
pub const POINTS: usize = 65_536;
/// Bytes of a picture or mesh in a marker.
pub const MARKER_BYTES: usize = 1 << 20;
/// Statuses in one message of diagnostics.
pub const STATUSES: usize = 256;
/// Values of one status.
pub const VALUES: usize = 64;
/// Goals of one action: a server forgets them after some minutes.
pub const GOALS: usize = 1024;
/// Waypoints of one goal: more than any tour has.
pub const WAYPOINTS: usize = 256;
/// Parameters of a node, and names in one request: more than all of Nav2 has.
pub const PARAMETERS: usize = 4096;
/// Entries of a parameter that is a list.
pub const PARAMETER_VALUES: usize = 4096;
/// Characters of a liveliness token: nine names of up to 255.
pub const TOKEN: usize = 4096;
