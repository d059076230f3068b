//! The commands that the base has been told last, some of which may not have reached it yet.

use std::collections::VecDeque;

use curionav_planning::geometry::Twist;

/// As many as a base of the greatest latency has before it, at the shortest tick: 1 s and 0.01 s.
const KEPT: usize = 128;
/// A base drives on with the last command for so many ticks if one is missing; then it is not known what it does.
const HELD_TICKS: u64 = 3;

/// A command that the base will follow for so many seconds, from when it follows the one before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnItsWay {
    /// The command.
    pub twist: Twist,
    /// For how long.
    pub seconds: f64,
}

/// Commands by their ticks, the newest last.
#[derive(Debug, Default)]
pub struct Told {
    commands: VecDeque<(u64, Twist)>,
}

impl Told {
    /// One more command, of a tick.
    pub fn tell(&mut self, tick: u64, twist: Twist) {
        if self.commands.back().is_some_and(|(newest, _)| *newest >= tick) {
            self.commands.retain(|(at, _)| *at < tick);
        }
        if self.commands.len() == KEPT {
            self.commands.pop_front();
        }
        self.commands.push_back((tick, twist));
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.commands.clear();
    }

    /// What the base does from the odometry of `tick` until it follows the command made from it, `latency` seconds
    /// later; ticks are `period` seconds apart. Nothing for a time of which no command is known.
    pub fn on_its_way(&self, tick: u64, latency: f64, period: f64) -> Vec<OnItsWay> {
        let before = (latency / period - 1e-6).ceil().max(0.0) as u64;
        let first = latency - period * before.saturating_sub(1) as f64;
        let of = |back: u64| {
            let seconds = if back == before { first } else { period };
            Some(OnItsWay { twist: self.in_force(tick.checked_sub(back)?)?, seconds })
        };
        (1..=before).rev().filter_map(of).collect()
    }

    /// The newest command that is not of a later tick.
    fn in_force(&self, tick: u64) -> Option<Twist> {
        let newest = self.commands.iter().rev().find(|(at, _)| *at <= tick);
        newest.filter(|(at, _)| tick - at <= HELD_TICKS).map(|(_, twist)| *twist)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(count: u64) -> Told {
        let mut told = Told::default();
        (0..count).for_each(|tick| told.tell(tick, Twist { v: tick as f64, omega: 0.0 }));
        told
    }

    fn speeds(told: &Told, tick: u64, latency: f64) -> Vec<(f64, f64)> {
        told.on_its_way(tick, latency, 0.1).iter().map(|it| (it.twist.v, it.seconds)).collect()
    }

    #[test]
    fn what_is_on_its_way_fills_the_latency() {
        let told = told(10);
        assert_eq!(speeds(&told, 10, 0.0), []);
        assert_eq!(speeds(&told, 10, 0.1), [(9.0, 0.1)]);
        let late = speeds(&told, 10, 0.25);
        let of: Vec<f64> = late.iter().map(|(v, _)| *v).collect();
        assert_eq!(of, [7.0, 8.0, 9.0]);
        let seconds: f64 = late.iter().map(|(_, seconds)| seconds).sum();
        assert!((seconds - 0.25).abs() < 1e-12 && (late[0].1 - 0.05).abs() < 1e-12);
    }

    #[test]
    fn a_command_holds_for_three_ticks_when_the_next_are_missing() {
        let told = told(10);
        assert_eq!(speeds(&told, 13, 0.1), [(9.0, 0.1)]);
        assert_eq!(speeds(&told, 14, 0.1), []);
        assert_eq!(speeds(&Told::default(), 3, 0.2), []);
    }

    #[test]
    fn a_base_that_has_started_over_is_told_anew() {
        let mut told = told(300);
        assert!(told.commands.len() <= KEPT);
        told.tell(2, Twist { v: 0.5, omega: 0.0 });
        assert_eq!(speeds(&told, 3, 0.1), [(0.5, 0.1)]);
    }
}
