//! Which scenarios have a map in common.

use std::collections::BTreeSet;

use curionav_schemas::OccupancyGrid;

/// For each map the number of its place, from 0 on. Two maps are one place if they have more than half of their
/// occupied cells in common: the same walls with other furniture, or with a margin, are not another place.
pub(crate) fn places<'a>(maps: impl Iterator<Item = &'a OccupancyGrid>) -> Vec<usize> {
    let mut known: Vec<BTreeSet<[i64; 2]>> = Vec::new();
    maps.map(|map| {
        let walls = walls(map);
        let place = known.iter().position(|other| is_one_place(other, &walls));
        place.unwrap_or_else(|| {
            known.push(walls);
            known.len() - 1
        })
    })
    .collect()
}

fn is_one_place(a: &BTreeSet<[i64; 2]>, b: &BTreeSet<[i64; 2]>) -> bool {
    let common = a.intersection(b).count();
    2 * common > a.len() + b.len() - common || a == b
}

/// The centres of the occupied cells in the map frame, in cells.
fn walls(map: &OccupancyGrid) -> BTreeSet<[i64; 2]> {
    let width = map.width as usize;
    let (sin, cos) = map.origin.heading.sin_cos();
    let at = |cell: usize| {
        let x = (cell % width) as f64 + 0.5;
        let y = (cell / width) as f64 + 0.5;
        let (x, y) = (cos * x - sin * y, sin * x + cos * y);
        [map.origin.x / map.resolution + x, map.origin.y / map.resolution + y].map(|at| at.floor() as i64)
    };
    map.cells.iter().enumerate().filter(|(_, cell)| **cell > 0).map(|(cell, _)| at(cell)).collect()
}

#[cfg(test)]
mod tests {
    use curionav_schemas::Pose;
    use curionav_testing::golden;

    use super::*;

    /// A map of one row with walls in these columns, its first column at `x`.
    fn row(x: f64, walls: &[usize]) -> OccupancyGrid {
        let mut cells = vec![0_i8; 12];
        walls.iter().for_each(|wall| cells[*wall] = 100);
        let origin = Pose { x, y: 0.0, heading: 0.0 };
        let cells = cells.into();
        OccupancyGrid { width: 12, height: 1, resolution: 0.1, origin, cells, ..golden::occupancy_grid() }
    }

    #[test]
    fn walls_with_other_furniture_or_a_margin_are_one_place() {
        let hall = row(0.0, &[1, 2, 3, 4]);
        // 4 of 6 cells in common; the same walls, drawn from 20 cm farther left; 2 of 6 in common.
        let furnished = row(0.0, &[1, 2, 3, 4, 8, 9]);
        let margin = row(-0.2, &[3, 4, 5, 6]);
        let other = row(0.0, &[3, 4, 5, 6]);
        assert_eq!(places([&hall, &furnished, &other, &margin].into_iter()), [0, 0, 1, 0]);
        let empty = row(0.0, &[]);
        assert_eq!(places([&hall, &empty, &empty].into_iter()), [0, 1, 1]);
    }
}
