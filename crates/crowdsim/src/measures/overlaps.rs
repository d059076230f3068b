//! All overlaps of bodies, also those that count as no collision: by whether the robot moved and where the person was.

use std::collections::BTreeSet;
use std::f64::consts::FRAC_PI_4;

use crate::world::{Overlap, Truth};

/// A robot that is slower stands, m/s.
const STANDING_SPEED: f64 = 0.1;
/// Up to this angle a person is ahead, radians.
const AHEAD: f64 = FRAC_PI_4;
/// From this angle on a person is behind, radians.
const BEHIND: f64 = 3.0 * FRAC_PI_4;

/// Episodes in which the robot's body and a person's overlap, by their first moment. An episode ends when the bodies
/// part.
pub(super) fn overlaps(rows: &[&Truth]) -> [(&'static str, f64); 6] {
    let mut counts = [
        // Of a robot slower than 0.1 m/s, with a person within 45 degrees of straight ahead, ...
        ("overlaps_standing_ahead", 0.0),
        // ... at its side, ...
        ("overlaps_standing_beside", 0.0),
        // ... or more than 135 degrees off straight ahead.
        ("overlaps_standing_behind", 0.0),
        // Of a robot that moves.
        ("overlaps_moving_ahead", 0.0),
        ("overlaps_moving_beside", 0.0),
        ("overlaps_moving_behind", 0.0),
    ];
    let mut before = BTreeSet::new();
    for row in rows {
        let first = if row.twist.v.abs() < STANDING_SPEED { 0 } else { 3 };
        for overlap in row.overlaps.iter().filter(|overlap| !before.contains(&overlap.id)) {
            counts[first + sector(overlap)].1 += 1.0;
        }
        before = row.overlaps.iter().map(|overlap| overlap.id).collect();
    }
    counts
}

/// Ahead, beside or behind, as a place in each half of the counts.
fn sector(overlap: &Overlap) -> usize {
    let off = overlap.bearing.abs();
    usize::from(off > AHEAD) + usize::from(off > BEHIND)
}
