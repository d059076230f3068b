//! Maps, named by the hash of their content.

use crate::check::{checks, count, each, optional, part, positive, shape, size, within};
use crate::limits::MAX_MAP_CELLS;
use crate::{I8Array, Pose, U8Array};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// SHA-256 of a map's content; a byte string of 32 on the wire, 64 lower-case hexadecimal digits as text. The content
/// is width and height (u64), resolution and origin x, y, heading (f64), then the cells and, if there are any, the
/// limits, all little-endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct MapId(#[serde(with = "serde_bytes")] pub [u8; 32]);

impl fmt::Display for MapId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&hex(&self.0))
    }
}

/// The bytes of a digest as text: two lower-case hexadecimal digits each.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A text that names no map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a map's name is 64 lower-case hexadecimal digits")]
pub struct MapIdError;

impl FromStr for MapId {
    type Err = MapIdError;

    fn from_str(text: &str) -> Result<Self, MapIdError> {
        let mut id = Self([0; 32]);
        for (index, byte) in id.0.iter_mut().enumerate() {
            let digits = text.get(2 * index..2 * index + 2).ok_or(MapIdError)?;
            *byte = u8::from_str_radix(digits, 16).map_err(|_| MapIdError)?;
        }
        // No sign, no capital, nothing after them.
        if id.to_string() == text { Ok(id) } else { Err(MapIdError) }
    }
}

/// A map of cells: 0 free, 100 occupied, -1 unknown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OccupancyGrid {
    /// Cells along x.
    pub width: u32,
    /// Cells along y.
    pub height: u32,
    /// Side of a cell, m.
    pub resolution: f64,
    /// Pose of the outer corner of cell (0, 0) in the map frame.
    pub origin: Pose,
    /// `[height, width]`, the row of least y first: -1 unknown, else per cent occupied, 0 to 100.
    pub cells: I8Array,
    /// `[height, width]`, zones: per cent of a robot's greatest speed that it may drive with, 0 to 100. At 0 it must
    /// not drive there (keepout). None if the map has no zones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<U8Array>,
    /// Hash of the rest. A reader that keeps maps by it compares the two first.
    pub map: MapId,
}

checks! { grid: OccupancyGrid {
    resolution: positive;
    origin: part;
    width, height: count(1, MAX_MAP_CELLS);
    cells: |field: &str, cells: &I8Array| {
        // Two factors of 16 million each fit in 64 bits.
        let expected = u64::from(grid.width) * u64::from(grid.height);
        let expected = usize::try_from(expected).unwrap_or(usize::MAX);
        size(field, expected, 0, MAX_MAP_CELLS)?;
        shape(field, cells.len(), expected)
    };
    cells: each(within(-1.0, 100.0));
    limits: optional(|field: &str, limits: &U8Array| shape(field, limits.len(), grid.cells.len()));
    limits: optional(each(within(0.0, 100.0)));
}}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_id_survives_text() {
        let id = MapId(std::array::from_fn(|i| (i * 7) as u8));
        assert_eq!(id.to_string().parse(), Ok(id));
        for text in
            ["", "00", &"0".repeat(63), &"0".repeat(65), &"g".repeat(64), &"A".repeat(64), &"é".repeat(32)]
        {
            assert_eq!(text.parse::<MapId>(), Err(MapIdError), "{text}");
        }
    }
}
