//! The map's cells as a few thousand rectangles in one path, sharp at any size.

use super::palette::{KEEPOUT, SLOW};
use super::viewport::{Bounds, Viewport};
use curionav_planning::numerics::sin_cos;
use curionav_schemas::OccupancyGrid;
use std::collections::BTreeMap;
use svg::node::element::{Group, Path, Use};

/// Rectangles a map may take; a map that needs more is drawn in larger cells. About 15 bytes each.
const MAX_RECTANGLES: usize = 40_000;
/// From this share on a cell is drawn as occupied, per cent.
const OCCUPIED: i8 = 50;
/// Rows and columns from and to (exclusive).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Block {
    left: usize,
    right: usize,
    bottom: usize,
    top: usize,
}

/// The map in units of cells, to be shown any number of times by [`map_layer`]; `id` is its name in the document.
pub(super) fn definition(map: &OccupancyGrid, id: &str) -> Group {
    let (walls, unknown, size) = drawable(map);
    Group::new()
        .set("id", id)
        .set("shape-rendering", "crispEdges")
        .add(Path::new().set("fill", "#e9e9e9").set("d", outline(&unknown, size)))
        .add(Path::new().set("fill", "#3c3c3c").set("d", outline(&walls, size)))
}

/// The name of the zones in the document.
const ZONES_ID: &str = "zones";
/// Shares of the greatest speed, per cent, up to which floor has these colours: keepout, and the slower the darker.
const ZONES: [(u8, &str); 4] = [(0, KEEPOUT), (33, SLOW), (66, "#f8e5c4"), (99, "#fcf3e2")];

/// The zones of the map, if it has any, in units of cells; to be shown by [`zones_and_walls`].
pub(super) fn zones(map: &OccupancyGrid) -> Option<Group> {
    let limits = map.limits.as_ref()?;
    let mut least = 0;
    let zones = ZONES.into_iter().fold(Group::new().set("id", ZONES_ID), |group, (most, colour)| {
        let is_part: Vec<bool> = limits.iter().map(|limit| (least..=most).contains(limit)).collect();
        least = most + 1;
        group.add(area(map, &is_part, &format!("{ZONES_ID}-{most}"), colour))
    });
    Some(zones)
}

/// The zones of `map`, and on them `walls`, which have been defined as `id`.
pub(super) fn zones_and_walls(
    map: &OccupancyGrid,
    (walls, id): (&OccupancyGrid, &str),
    viewport: &Viewport,
) -> impl Iterator<Item = Use> {
    let zones = map.limits.as_ref().map(|_| map_layer(map, ZONES_ID, viewport));
    zones.into_iter().chain([map_layer(walls, id, viewport)])
}

/// The cells of `map` that `is_part` picks, in one colour; to be shown by [`map_layer`] as well.
pub(super) fn area(map: &OccupancyGrid, is_part: &[bool], id: &str, fill: &str) -> Group {
    // A map that is unknown exactly there.
    let cells: Vec<i8> = is_part.iter().map(|is_part| if *is_part { -1 } else { 0 }).collect();
    let (_, cells, size) = drawable(&OccupancyGrid { cells: cells.into(), ..map.clone() });
    let path = Path::new().set("fill", fill).set("d", outline(&cells, size));
    Group::new().set("id", id).set("shape-rendering", "crispEdges").add(path)
}

/// Walls and unknown space in the smallest blocks that are not too many, and the side of a block in cells.
fn drawable(map: &OccupancyGrid) -> (Vec<Block>, Vec<Block>, usize) {
    let mut size = 1;
    loop {
        let (walls, unknown) = blocks(map, size);
        if walls.len() + unknown.len() <= MAX_RECTANGLES {
            return (walls, unknown, size);
        }
        size *= 2;
    }
}

pub(super) fn map_layer(map: &OccupancyGrid, id: &str, viewport: &Viewport) -> Use {
    let (sin, cos) = sin_cos(map.origin.heading);
    let side = viewport.scale * map.resolution;
    let (left, top) = viewport.at((map.origin.x, map.origin.y));
    let matrix = [side * cos, -side * sin, -side * sin, -side * cos, left, top];
    let numbers: Vec<String> = matrix.iter().map(|number| format!("{:.5}", number + 0.0)).collect();
    Use::new().set("href", format!("#{id}")).set("transform", format!("matrix({})", numbers.join(" ")))
}

/// The bounds of the cells that are known; of all cells if none is.
pub(super) fn known(map: &OccupancyGrid) -> Bounds {
    let width = map.width as usize;
    let height = map.height as usize;
    let known = map.cells.iter().enumerate().filter(|(_, cell)| **cell >= 0);
    let none = [width, 0, height, 0];
    let [left, right, bottom, top] = known.fold(none, |[left, right, bottom, top], (index, _)| {
        let column = index % width;
        let row = index / width;
        [left.min(column), right.max(column + 1), bottom.min(row), top.max(row + 1)]
    });
    let [left, right, bottom, top] =
        if right == 0 { [0, width, 0, height] } else { [left, right, bottom, top] };
    let (sin, cos) = sin_cos(map.origin.heading);
    let corners = [(left, bottom), (right, bottom), (left, top), (right, top)];
    Bounds::of(corners.map(|(column, row)| {
        let u = map.resolution * column as f64;
        let v = map.resolution * row as f64;
        (map.origin.x + cos * u - sin * v, map.origin.y + sin * u + cos * v)
    }))
}

/// Walls and unknown space in blocks of `size` x `size` cells; a block with a wall in it is a wall.
fn blocks(map: &OccupancyGrid, size: usize) -> (Vec<Block>, Vec<Block>) {
    let width = map.width as usize;
    let height = map.height as usize;
    let columns = width.div_ceil(size);
    let rows = height.div_ceil(size);
    let mut coarse = vec![i8::MIN; columns * rows];
    for (index, cell) in map.cells.iter().enumerate() {
        let block = &mut coarse[(index / width / size) * columns + index % width / size];
        *block = (*block).max(*cell);
    }
    (merged(&coarse, columns, |cell| cell >= OCCUPIED), merged(&coarse, columns, |cell| cell < 0))
}

/// Rectangles that cover exactly the cells that `belongs` picks: runs along a row, joined with equal runs below.
fn merged(cells: &[i8], columns: usize, belongs: impl Fn(i8) -> bool) -> Vec<Block> {
    let mut done = Vec::new();
    let mut open: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    let rows = cells.len() / columns.max(1);
    for row in 0..=rows {
        let line = cells.get(row * columns..(row + 1) * columns).unwrap_or_default();
        let mut next = BTreeMap::new();
        for (left, right) in runs(line, &belongs) {
            next.insert((left, right), open.remove(&(left, right)).unwrap_or(row));
        }
        done.extend(open.iter().map(|(&(left, right), &bottom)| Block { left, right, bottom, top: row }));
        open = next;
    }
    done
}

fn runs(line: &[i8], belongs: impl Fn(i8) -> bool) -> Vec<(usize, usize)> {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for column in (0..line.len()).filter(|column| belongs(line[*column])) {
        match runs.last_mut() {
            Some((_, right)) if *right == column => *right += 1,
            _ => runs.push((column, column + 1)),
        }
    }
    runs
}

fn outline(blocks: &[Block], size: usize) -> String {
    let mut path = String::with_capacity(16 * blocks.len());
    for b in blocks {
        let width = size * (b.right - b.left);
        let height = size * (b.top - b.bottom);
        path += &format!("M{} {}h{width}v{height}h-{width}z", size * b.left, size * b.bottom);
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    fn grid(width: u32, height: u32, cells: Vec<i8>) -> OccupancyGrid {
        OccupancyGrid { width, height, cells: cells.into(), ..golden::occupancy_grid() }
    }

    #[test]
    fn the_rectangles_cover_every_wall_once_and_nothing_else() {
        let (width, height) = (17_usize, 11_usize);
        let cells: Vec<i8> =
            (0..width * height).map(|i| if (i * i / 3 + i) % 5 < 2 { 100 } else { 0 }).collect();
        let mut covered = vec![0_i8; cells.len()];
        for block in merged(&cells, width, |cell| cell >= OCCUPIED) {
            for row in block.bottom..block.top {
                for column in block.left..block.right {
                    covered[row * width + column] += 100;
                }
            }
        }
        assert_eq!(covered, cells);
    }

    #[test]
    fn a_solid_wall_is_one_rectangle() {
        let map = grid(40, 30, vec![100; 1200]);
        assert_eq!(blocks(&map, 1).0, [Block { left: 0, right: 40, bottom: 0, top: 30 }]);
    }

    #[test]
    fn a_noisy_map_is_coarsened_until_it_is_small() {
        let side = 700;
        let cells = (0..side * side).map(|i| if (i % side + i / side) % 2 == 0 { 100 } else { 0 }).collect();
        let text = definition(&grid(side, side, cells), "map").to_string();
        assert!(text.len() < 16 * MAX_RECTANGLES, "{} bytes", text.len());
        assert!(text.contains("h700v700"), "in larger cells all of it is wall");
    }

    #[test]
    fn each_zone_is_drawn_in_the_colour_of_its_limit() {
        let text = zones(&golden::zoned_occupancy_grid()).unwrap().to_string();
        let path = |colour: &str| {
            let at = text.find(colour).unwrap_or_else(|| panic!("no {colour} in {text}"));
            let begin = text[..at].rfind("<path").unwrap();
            text[begin..at + text[at..].find("/>").unwrap()].to_owned()
        };
        // Keepout is cells 0 and 1 of row 1; 30 per cent are cells 2 and 3 there, and cell 2 of row 2.
        assert!(path(KEEPOUT).contains("M0 1h2v1h-2z"), "{text}");
        assert!(path(SLOW).contains("M2 1h2v1h-2z") && path(SLOW).contains("M2 2h1v1h-1z"), "{text}");
        assert!(zones(&golden::occupancy_grid()).is_none());
    }

    #[test]
    fn the_known_part_leaves_out_an_unknown_rim() {
        let mut cells = vec![-1; 100];
        cells[34] = 0;
        cells[56] = 100;
        let bounds = known(&OccupancyGrid {
            resolution: 0.5,
            origin: curionav_schemas::Pose { x: 10.0, y: -1.0, heading: 0.0 },
            ..grid(10, 10, cells)
        });
        // Columns 4 to 6 and rows 3 to 5, half a metre each.
        assert_eq!(bounds, Bounds { min: (12.0, 0.5), max: (13.5, 2.0) });
    }
}
