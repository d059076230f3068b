//! Round numbers along an edge, the grid they make, and the scale bar.

use super::page::{rectangle, translate};
use super::symbols::{line, text};
use super::viewport::{Viewport, px};
use curionav_planning::numerics::ln;
use svg::node::element::{Group, Rectangle, SVG};

/// Room for the numbers left of and below a map, px.
pub(super) const AXIS: (f64, f64) = (34.0, 22.0);

/// Multiples of 1, 2 or 5 times a power of ten from `low` to `high`, at most `most` steps apart.
pub(super) fn ticks(low: f64, high: f64, most: usize) -> Vec<f64> {
    multiples(step(high - low, most), low, high)
}

fn multiples(step: f64, low: f64, high: f64) -> Vec<f64> {
    let first = (low / step - 1e-9).ceil();
    let last = (high / step + 1e-9).floor();
    let count = (last - first).clamp(-1.0, 100.0) + 1.0;
    (0..count as u32).map(|i| (first + f64::from(i)) * step + 0.0).collect()
}

/// The least of 1, 2, 5, 10, ... (and their tenths) of which at most `most` fit into `range`.
fn step(range: f64, most: usize) -> f64 {
    let rough = range.max(1e-9) / most.max(1) as f64;
    let power = 10_f64.powi(libm::log10(rough).floor() as i32);
    let factor = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * power >= rough * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * power
}

/// A tick's number with as few digits as it needs.
pub(super) fn label(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').replace('-', "\u{2212}")
}

/// What the heights of a plot stand for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    low: f64,
    high: f64,
    is_logarithmic: bool,
}

impl Scale {
    pub(super) fn linear(low: f64, high: f64) -> Self {
        Self { low, high, is_logarithmic: false }
    }

    /// `low` must be above zero.
    pub(super) fn logarithmic(low: f64, high: f64) -> Self {
        Self { low, high, is_logarithmic: true }
    }

    /// Where a value is between the lower edge (0) and the upper one (1).
    pub(super) fn share(&self, value: f64) -> f64 {
        if self.is_logarithmic {
            ln(value / self.low) / ln(self.high / self.low)
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    pub(super) fn ticks(&self) -> Vec<f64> {
        if !self.is_logarithmic {
            return ticks(self.low, self.high, 5);
        }
        let decades = libm::log10(self.low).floor() as i32..=libm::log10(self.high).ceil() as i32;
        let wide = self.high / self.low > 50.0;
        let steps = if wide { &[1.0][..] } else { &[1.0, 2.0, 5.0] };
        let all = decades.flat_map(|power| steps.iter().map(move |step| step * 10_f64.powi(power)));
        all.filter(|value| (self.low..=self.high).contains(value)).collect()
    }
}

/// A grid of squares at least `apart` pixels wide, with metres along the left and lower edge of the viewport, outside
/// of it, and a frame around it.
pub(super) fn axes(viewport: &Viewport, apart: f64) -> Group {
    let Viewport { min_x, max_y, width, height, scale } = *viewport;
    let mut group = Group::new();
    let step = step(apart / scale, 1);
    for x in multiples(step, min_x, min_x + width / scale) {
        let at = viewport.at((x, max_y)).0;
        let number = text((at, height + 15.0), "s", label(x)).set("text-anchor", "middle");
        let tick = line((at, height), (at, height + 4.0), "tick");
        group = group.add(line((at, 0.0), (at, height), "grid")).add(tick).add(number);
    }
    for y in multiples(step, max_y - height / scale, max_y) {
        let at = viewport.at((min_x, y)).1;
        let number = text((-6.0, at + 3.5), "s", label(y)).set("text-anchor", "end");
        let tick = line((-4.0, at), (0.0, at), "tick");
        group = group.add(line((0.0, at), (width, at), "grid")).add(tick).add(number);
    }
    group.add(frame(width, height))
}

/// What stands `inside` a viewport of a map, behind it the axes, whose numbers begin at `origin`, px.
pub(super) fn on_axes(viewport: &Viewport, inside: SVG, origin: (f64, f64)) -> Group {
    let at = translate(origin.0 + AXIS.0, origin.1);
    Group::new().set("transform", at).add(axes(viewport, 70.0)).add(inside)
}

pub(super) fn frame(width: f64, height: f64) -> Rectangle {
    Rectangle::new().set("class", "frame").set("width", px(width)).set("height", px(height))
}

/// A bar of a round number of metres, in the lower left corner of a viewport.
pub(super) fn scale_bar(viewport: &Viewport) -> Group {
    const ABOUT: f64 = 90.0;
    let metres = step(ABOUT / viewport.scale, 1);
    let left = 14.0;
    let bottom = viewport.height - 12.0;
    let length = metres * viewport.scale;
    let board = rectangle(length + 14.0, 26.0, "#fff").set("x", left - 7.0).set("y", px(bottom - 19.0));
    let number = text((left + length / 2.0, bottom - 6.0), "b", format!("{} m", label(metres)));
    let mut group = Group::new().add(board.set("rx", 3).set("fill-opacity", 0.85));
    for (from, to) in [
        ((left, bottom), (left + length, bottom)),
        ((left, bottom - 4.0), (left, bottom + 3.0)),
        ((left + length, bottom - 4.0), (left + length, bottom + 3.0)),
    ] {
        group = group.add(line(from, to, "line").set("stroke", "#1a1a1a").set("stroke-width", 1.6));
    }
    group.add(number.set("text-anchor", "middle"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within() {
        assert_eq!(ticks(-1.0, 11.0, 6), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(ticks(0.0, 1.0, 5).len(), 6);
        assert_eq!(ticks(0.0, 40.0, 4), [0.0, 10.0, 20.0, 30.0, 40.0]);
    }

    #[test]
    fn ticks_of_an_empty_or_odd_range_are_few() {
        for (low, high) in [(1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::INFINITY)] {
            assert!(ticks(low, high, 5).len() <= 101);
        }
    }

    #[test]
    fn labels_are_short() {
        assert_eq!([0.0, 2.5, -3.0, 0.001].map(label), ["0", "2.5", "\u{2212}3", "0.001"]);
    }
}
