//! A part of the map frame on the page: metres to pixels, y upwards to y downwards.

/// A rectangle of the map frame drawn from the local origin of an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Viewport {
    /// Left edge, map frame, m.
    pub(super) min_x: f64,
    /// Top edge, map frame, m.
    pub(super) max_y: f64,
    pub(super) width: f64,
    pub(super) height: f64,
    /// Pixels per metre.
    pub(super) scale: f64,
}

impl Viewport {
    /// All of `bounds` at the largest scale that keeps within `width` and `height` pixels.
    pub(super) fn fit(bounds: Bounds, width: f64, height: f64) -> Self {
        let scale = (width / bounds.width()).min(height / bounds.height());
        Self {
            min_x: bounds.min.0,
            max_y: bounds.max.1,
            width: scale * bounds.width(),
            height: scale * bounds.height(),
            scale,
        }
    }

    /// The square of `reach` metres around `centre`, `side` pixels wide.
    pub(super) fn around(centre: (f64, f64), reach: f64, side: f64) -> Self {
        Self::fit(Bounds::of([centre]).grown(reach), side, side)
    }

    pub(super) fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (self.scale * (x - self.min_x), self.scale * (self.max_y - y))
    }

    /// Whether a point is within, or at most `margin` metres outside.
    pub(super) fn holds(&self, (x, y): (f64, f64), margin: f64) -> bool {
        let right = self.min_x + self.width / self.scale;
        let bottom = self.max_y - self.height / self.scale;
        x >= self.min_x - margin && x <= right + margin && y <= self.max_y + margin && y >= bottom - margin
    }

    /// The points as the attribute of a polyline; those nearer than a third of a pixel to the one before are left out.
    pub(super) fn points(&self, path: impl IntoIterator<Item = (f64, f64)>) -> String {
        let mut text = String::new();
        let mut last = (f64::INFINITY, f64::INFINITY);
        let mut pending = None;
        for point in path {
            let (x, y) = self.at(point);
            if (x - last.0).abs() + (y - last.1).abs() < 1.0 / 3.0 {
                pending = Some((x, y));
                continue;
            }
            push(&mut text, (x, y));
            last = (x, y);
            pending = None;
        }
        if let Some(end) = pending {
            push(&mut text, end);
        }
        text
    }
}

fn push(text: &mut String, (x, y): (f64, f64)) {
    if !text.is_empty() {
        text.push(' ');
    }
    text.push_str(&format!("{},{}", px(x), px(y)));
}

/// A length in pixels, to a tenth.
pub(super) fn px(length: f64) -> f64 {
    (length * 10.0).round() / 10.0
}

/// The least upright rectangle around some points, map frame, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub(super) min: (f64, f64),
    pub(super) max: (f64, f64),
}

impl Bounds {
    /// Around all of `points`; the unit square if there are none.
    pub(super) fn of(points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let none = Self { min: (f64::INFINITY, f64::INFINITY), max: (f64::NEG_INFINITY, f64::NEG_INFINITY) };
        let all = points.into_iter().fold(none, |b, (x, y)| Self {
            min: (b.min.0.min(x), b.min.1.min(y)),
            max: (b.max.0.max(x), b.max.1.max(y)),
        });
        if all.min.0 <= all.max.0 && all.min.1 <= all.max.1 {
            all
        } else {
            Self { min: (0.0, 0.0), max: (1.0, 1.0) }
        }
    }

    /// Wider by `margin` on every side.
    pub(super) fn grown(self, margin: f64) -> Self {
        Self {
            min: (self.min.0 - margin, self.min.1 - margin),
            max: (self.max.0 + margin, self.max.1 + margin),
        }
    }

    /// The part of it that `matters`; all of it while that is at most `times` the area.
    pub(super) fn part(self, matters: Self, times: f64) -> Self {
        if self.width() * self.height() <= times * (matters.width() * matters.height()) {
            return self;
        }
        let min = (self.min.0.max(matters.min.0), self.min.1.max(matters.min.1));
        let max = (self.max.0.min(matters.max.0), self.max.1.min(matters.max.1));
        if min.0 < max.0 && min.1 < max.1 { Self { min, max } } else { matters }
    }

    /// Metres across, never 0.
    pub(super) fn width(self) -> f64 {
        (self.max.0 - self.min.0).max(1e-3)
    }

    /// Metres up, never 0.
    pub(super) fn height(self) -> f64 {
        (self.max.1 - self.min.1).max(1e-3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn north_is_up_and_the_corners_are_the_corners() {
        let bounds = Bounds { min: (-2.0, 1.0), max: (8.0, 6.0) };
        let viewport = Viewport::fit(bounds, 200.0, 200.0);
        assert_eq!((viewport.width, viewport.height, viewport.scale), (200.0, 100.0, 20.0));
        assert_eq!(viewport.at((-2.0, 6.0)), (0.0, 0.0));
        assert_eq!(viewport.at((8.0, 1.0)), (200.0, 100.0));
        assert!(viewport.holds((8.0, 1.0), 0.0) && !viewport.holds((8.1, 1.0), 0.0));
    }

    #[test]
    fn a_robot_that_stands_adds_no_points_and_the_end_is_kept() {
        let viewport = Viewport::around((0.0, 0.0), 1.0, 20.0);
        let path = [(0.0, 0.0), (0.001, 0.0), (0.002, 0.0), (0.5, 0.0), (0.505, 0.0)];
        assert_eq!(viewport.points(path), "10,10 15,10 15.1,10");
    }

    #[test]
    fn bounds_of_nothing_and_of_one_point_can_be_drawn() {
        for bounds in [Bounds::of([]), Bounds::of([(3.0, 3.0)])] {
            assert!(Viewport::fit(bounds, 100.0, 100.0).scale.is_finite());
        }
    }
}
