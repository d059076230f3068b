//! Scripted walkers: straight lines at constant speed, blind to everything but the robot in their way, and the heedless
//! to that as well.

use curionav_planning::geometry::Point2;

use crate::scenario::{WalkMode, Walker};

/// A walker stops short of the robot by this much more than the sum of the radii, metres.
pub(crate) const WAITING_MARGIN: f64 = 0.1;

/// A walker on its way. Walkers pass through each other; routes keep clear of walls, which
/// [`crate::Scenario::check`] makes sure of.
#[derive(Debug, Clone)]
pub(crate) struct WalkerState {
    /// Corners of a full cycle; the first again at the end when it repeats.
    pub(crate) corners: Vec<Point2>,
    /// Metres walked when each corner is reached.
    reached_at: Vec<f64>,
    /// Metres walked at which there is a rest, ascending; within (0, length].
    rests: Vec<f64>,
    repeats: bool,
    speed: f64,
    pause_s: f64,
    /// Metres walked in this cycle.
    walked: f64,
    /// Seconds of rest still to come.
    resting: f64,
    waits: bool,
    stands: bool,
    heedless: bool,
}

impl WalkerState {
    pub(crate) fn new(walker: &Walker) -> Self {
        let mut corners = walker.route.clone();
        let way = walker.route.windows(2).map(|w| w[0].distance(w[1])).sum();
        match walker.mode {
            WalkMode::BackAndForth => corners.extend(walker.route.iter().rev().skip(1)),
            WalkMode::Loop => corners.extend(walker.route.first()),
            WalkMode::Once | WalkMode::Stand => {}
        }
        let mut length = 0.0;
        let mut reached_at = vec![0.0];
        for pair in corners.windows(2) {
            length += pair[0].distance(pair[1]);
            reached_at.push(length);
        }
        let offset = walker.start_offset;
        let repeats = matches!(walker.mode, WalkMode::BackAndForth | WalkMode::Loop);
        let rests = if walker.mode == WalkMode::BackAndForth { vec![way, length] } else { vec![length] };
        Self {
            corners,
            reached_at,
            rests,
            repeats,
            speed: walker.speed,
            pause_s: walker.pause_s,
            walked: if repeats && offset >= length { 0.0 } else { offset.min(length) },
            resting: 0.0,
            waits: false,
            stands: walker.mode == WalkMode::Stand || length <= 0.0,
            heedless: walker.heedless,
        }
    }

    pub(crate) fn position(&self) -> Point2 {
        let leg = self.leg();
        let a = self.corners[leg];
        let b = self.corners[(leg + 1).min(self.corners.len() - 1)];
        let length = a.distance(b);
        let s = if length > 0.0 { ((self.walked - self.reached_at[leg]) / length).min(1.0) } else { 0.0 };
        a.toward(b, s)
    }

    /// How the walker moves, m/s: zero while it rests, waits, stands or has arrived.
    pub(crate) fn velocity(&self) -> (f64, f64) {
        if self.stands || self.waits || self.resting > 0.0 || self.has_arrived() {
            return (0.0, 0.0);
        }
        let leg = self.leg();
        let a = self.corners[leg];
        let b = self.corners[leg + 1];
        let length = a.distance(b);
        (self.speed * (b.x - a.x) / length, self.speed * (b.y - a.y) / length)
    }

    /// How much of the last step was lost: all of it while the walker waits for the robot.
    pub(crate) fn lost_share(&self) -> f64 {
        f64::from(u8::from(self.waits))
    }

    /// Walks for `dt` seconds; waits instead when the robot is ahead and the step would end within
    /// `keep_off` metres of it (D11). A robot beside or behind stops no walker; a heedless one walks on until the
    /// bodies touch.
    pub(crate) fn step(&mut self, dt: f64, robot: Point2, keep_off: f64) {
        if self.stands {
            return;
        }
        let here = self.position();
        let before = (self.walked, self.resting);
        self.advance(dt);
        let there = self.position();
        let ahead = (there.x - here.x) * (robot.x - here.x) + (there.y - here.y) * (robot.y - here.y) > 0.0;
        let keep_off = if self.heedless { keep_off - WAITING_MARGIN } else { keep_off };
        self.waits = ahead && there.distance(robot) < keep_off;
        if self.waits {
            (self.walked, self.resting) = before;
        }
    }

    fn advance(&mut self, dt: f64) {
        let mut left = dt;
        // Each round ends a rest, a stretch or the step; two rests a cycle bound the rounds.
        while left > 0.0 && !self.has_arrived() {
            if self.resting > 0.0 {
                let rested = self.resting.min(left);
                self.resting -= rested;
                left -= rested;
                continue;
            }
            let stop = self.rests.iter().copied().find(|&r| r > self.walked).unwrap_or(self.length());
            let stretch = stop - self.walked;
            if stretch > self.speed * left {
                self.walked += self.speed * left;
                return;
            }
            left -= stretch / self.speed;
            self.walked = if self.repeats && stop >= self.length() { 0.0 } else { stop };
            self.resting = self.pause_s;
        }
    }

    fn has_arrived(&self) -> bool {
        !self.repeats && self.walked >= self.length()
    }

    fn length(&self) -> f64 {
        self.reached_at.last().copied().unwrap_or(0.0)
    }

    /// The leg being walked: the last whose first corner is reached.
    pub(crate) fn leg(&self) -> usize {
        let reached = self.reached_at.partition_point(|&at| at <= self.walked);
        reached.saturating_sub(1).min(self.corners.len().saturating_sub(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAR: Point2 = Point2::new(100.0, 100.0);

    fn walker(mode: WalkMode, start_offset: f64, pause_s: f64) -> WalkerState {
        let route = vec![Point2::new(0.0, 0.0), Point2::new(4.0, 0.0), Point2::new(4.0, 3.0)];
        WalkerState::new(&Walker { route, speed: 1.0, mode, start_offset, pause_s, heedless: false })
    }

    fn after(mut w: WalkerState, seconds: f64) -> WalkerState {
        (0..(seconds * 10.0).round() as u32).for_each(|_| w.step(0.1, FAR, 0.65));
        w
    }

    fn assert_at(w: &WalkerState, x: f64, y: f64) {
        assert!(w.position().distance(Point2::new(x, y)) < 1e-9, "{:?}", w.position());
    }

    #[test]
    fn each_mode_walks_its_route() {
        // the route is 7 m long, closed 7 + 5 = 12 m
        assert_at(&after(walker(WalkMode::BackAndForth, 0.0, 0.0), 6.0), 4.0, 2.0);
        assert_at(&after(walker(WalkMode::BackAndForth, 0.0, 0.0), 9.0), 4.0, 1.0);
        assert_at(&after(walker(WalkMode::BackAndForth, 9.0, 0.0), 6.0), 1.0, 0.0);
        assert_at(&after(walker(WalkMode::Once, 0.0, 0.0), 20.0), 4.0, 3.0);
        assert_at(&after(walker(WalkMode::Loop, 0.0, 0.0), 9.5), 2.0, 1.5);
        assert_at(&after(walker(WalkMode::Loop, 0.0, 0.0), 13.0), 1.0, 0.0);
        assert_at(&after(walker(WalkMode::Stand, 5.0, 0.0), 13.0), 4.0, 1.0);
    }

    #[test]
    fn velocity_is_the_truth() {
        let w = walker(WalkMode::Once, 0.0, 0.0);
        assert_eq!(w.velocity(), (1.0, 0.0));
        assert_eq!(after(w.clone(), 5.0).velocity(), (0.0, 1.0));
        assert_eq!(after(w, 20.0).velocity(), (0.0, 0.0));
        let resting = after(walker(WalkMode::BackAndForth, 0.0, 2.0), 8.0);
        assert_at(&resting, 4.0, 3.0);
        assert_eq!(resting.velocity(), (0.0, 0.0));
        // 7 s there, 2 s of rest, 1 s back
        assert_at(&after(resting, 2.0), 4.0, 2.0);
        assert_eq!(walker(WalkMode::Stand, 1.0, 0.0).velocity(), (0.0, 0.0));
    }

    #[test]
    fn it_waits_for_the_robot_and_goes_on_when_the_way_is_free() {
        let mut w = walker(WalkMode::Once, 0.0, 0.0);
        let robot = Point2::new(2.0, 0.0);
        for _ in 0..50 {
            w.step(0.1, robot, 0.65);
            assert!(w.position().distance(robot) >= 0.65);
        }
        assert_eq!(w.velocity(), (0.0, 0.0));
        assert_at(&w, 1.3, 0.0); // the next step, to 1.4, would be 0.6 m away
        w.step(0.1, FAR, 0.65);
        assert_eq!(w.velocity(), (1.0, 0.0));
        assert_at(&w, 1.4, 0.0);
    }

    #[test]
    fn a_heedless_one_walks_until_it_touches_the_robot() {
        let mut w = WalkerState { heedless: true, ..walker(WalkMode::Once, 0.0, 0.0) };
        let robot = Point2::new(2.0, 0.0);
        for _ in 0..50 {
            w.step(0.1, robot, 0.55 + WAITING_MARGIN);
        }
        // The next step, to 1.5, would be 0.5 m away.
        assert_at(&w, 1.4, 0.0);
    }

    #[test]
    fn a_robot_behind_stops_no_walker() {
        let mut w = walker(WalkMode::Once, 1.0, 0.0);
        w.step(0.1, Point2::new(0.7, 0.0), 0.65);
        assert_at(&w, 1.1, 0.0);
    }
}
