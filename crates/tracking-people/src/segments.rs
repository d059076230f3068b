//! Neighbouring beams that ended on one thing.

use std::ops::Range;

use curionav_planning::beam::Beam;
use curionav_planning::geometry::Point2;

/// A run of beams that the map does not explain and that ended on one thing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Segment {
    /// Positions in the order of the sweep; those from the number of beams on are of the next turn of a laser that sees
    /// all around.
    pub(crate) beams: Range<usize>,
}

/// Where a segment ends on one side.
pub(crate) struct Side {
    /// Position of its outermost beam.
    edge: usize,
    /// Position of the beam beyond, if the laser looks there.
    beyond: Option<usize>,
}

/// A sweep with what is known of its beams.
pub(crate) struct Sweep<'a> {
    /// Where each beam ended, laser frame.
    pub(crate) ends: &'a [Point2],
    /// Metres.
    pub(crate) ranges: &'a [f32],
    /// Whether each met something.
    pub(crate) met: &'a [bool],
    /// How far from the walls of the map each ended, metres; 0 if on one, and nothing where the map does not know.
    pub(crate) off_walls: &'a [Option<f64>],
    /// Radians between beams.
    pub(crate) gap: f64,
    /// Whether the last beam is next to the first.
    pub(crate) full: bool,
    /// Distance of ends that belong together besides the laser's resolution, metres.
    pub(crate) jump: f64,
}

impl Sweep<'_> {
    fn len(&self) -> usize {
        self.ends.len()
    }

    /// The beam at a position of the sweep.
    pub(crate) fn beam(&self, position: usize) -> usize {
        position % self.len()
    }

    pub(crate) fn end(&self, position: usize) -> Point2 {
        self.ends[self.beam(position)]
    }

    fn range(&self, position: usize) -> f64 {
        f64::from(self.ranges[self.beam(position)])
    }

    /// Both sides of a segment.
    pub(crate) fn sides(&self, segment: &Segment) -> [Side; 2] {
        let Range { start, end } = segment.beams;
        let before = if start > 0 { Some(start - 1) } else { self.full.then(|| self.len() - 1) };
        let after = (self.full || end < self.len()).then_some(end);
        [Side { edge: start, beyond: before }, Side { edge: end - 1, beyond: after }]
    }

    /// Whether a segment may go on unseen on this side: behind something nearer, outside of the view, or where the
    /// next beam says nothing.
    pub(crate) fn goes_unseen(&self, side: &Side) -> bool {
        side.beyond.is_none_or(|at| {
            let is_hidden = self.has_met(at) && self.range(at) + self.jump < self.range(side.edge);
            is_hidden || !self.speaks(at)
        })
    }

    fn speaks(&self, position: usize) -> bool {
        Beam::of(self.ranges[self.beam(position)], 0.0, f64::INFINITY).speaks()
    }

    /// Whether a segment goes on in its neighbour on this side. If the segment `is_no_wall`, it does not go on in a
    /// wall.
    pub(crate) fn goes_on(&self, side: &Side, is_no_wall: bool) -> bool {
        side.beyond.is_some_and(|at| {
            let ends = is_no_wall && self.off_wall(at) == Some(0.0);
            self.has_met(at) && self.joined(at, side.edge) && !ends
        })
    }

    fn has_met(&self, position: usize) -> bool {
        self.met[self.beam(position)]
    }

    /// How far from the walls of the map the beam at a position ended: see [`Self::off_walls`].
    pub(crate) fn off_wall(&self, position: usize) -> Option<f64> {
        self.off_walls[self.beam(position)]
    }

    /// Whether the beam at a position met something that the map does not explain.
    fn unexplained(&self, position: usize) -> bool {
        self.off_wall(position) > Some(0.0)
    }

    /// Whether the ends of two neighbouring beams lie so near to each other that they may be of one thing.
    fn joined(&self, a: usize, b: usize) -> bool {
        let reach = self.jump + 1.5 * self.gap * self.range(a).min(self.range(b));
        self.end(a).distance(self.end(b)) <= reach
    }

    /// All segments in the order of the sweep.
    pub(crate) fn segments(&self) -> Vec<Segment> {
        let count = self.len();
        // Of a full turn none begins in the middle of a thing.
        let first = if self.full { (0..count).find(|i| !self.unexplained(*i)).unwrap_or(0) } else { 0 };
        let mut segments: Vec<Segment> = Vec::new();
        for position in first..first + count {
            if !self.unexplained(position) {
                continue;
            }
            match segments.last_mut() {
                Some(last) if last.beams.end == position && self.joined(position - 1, position) => {
                    last.beams.end = position + 1;
                }
                _ => segments.push(Segment { beams: position..position + 1 }),
            }
        }
        segments
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Segments of beams one degree apart with these ranges; beams of 5 m met a wall.
    fn segments(ranges: &[f32], full: bool) -> Vec<Range<usize>> {
        let gap = if full { std::f64::consts::TAU / ranges.len() as f64 } else { 0.0175 };
        let ends: Vec<Point2> = (0..)
            .zip(ranges)
            .map(|(i, r)| {
                let (s, c) = curionav_planning::numerics::sin_cos(gap * f64::from(i));
                Point2::new(f64::from(*r) * c, f64::from(*r) * s)
            })
            .collect();
        let off_walls: Vec<Option<f64>> = ranges.iter().map(|r| Some(f64::from(5.0 - r))).collect();
        let met = vec![true; ranges.len()];
        let sweep = Sweep { ends: &ends, ranges, met: &met, off_walls: &off_walls, gap, full, jump: 0.12 };
        sweep.segments().into_iter().map(|s| s.beams).collect()
    }

    #[test]
    fn walls_and_jumps_of_the_range_part_things() {
        assert_eq!(segments(&[5.0, 2.0, 2.0, 5.0, 2.0, 3.0, 3.05, 5.0], false), [1..3, 4..5, 5..7]);
    }

    #[test]
    fn a_thing_across_the_seam_of_a_full_turn_is_one() {
        let mut ranges = vec![5.0; 360];
        for i in [358, 359, 0, 1] {
            ranges[i] = 2.0;
        }
        assert_eq!(segments(&ranges, true).as_slice(), std::slice::from_ref(&(358..362)));
        assert_eq!(segments(&ranges, false), [0..2, 358..360]);
    }
}
