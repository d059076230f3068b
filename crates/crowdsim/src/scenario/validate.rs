//! What is wrong with a scenario, without its map, although each of its numbers lies in its range.

use curionav_planning::parameters::FieldError;

use super::{Clock, Scenario, WalkMode, Walker};

/// Most ticks of a run: a day at 0.1 s.
const MAX_TICKS: f64 = 864_000.0;
/// Longest name, bytes: it becomes a file name.
const MAX_NAME_BYTES: usize = 100;

type Check = Result<(), FieldError>;

impl Scenario {
    pub(super) fn has_a_plain_name(&self) -> Check {
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
        require(
            !self.name.is_empty() && self.name.len() <= MAX_NAME_BYTES && self.name.chars().all(plain),
            "name",
            "is not a short plain name",
            "use 1 to 100 letters, digits, '-', '_' and '.'",
        )
    }
}

impl Clock {
    pub(super) fn has_ticks(&self) -> Check {
        let ticks = self.time_limit_s / self.tick_s;
        let mend = format!("give {} to {} s", self.tick_s, MAX_TICKS * self.tick_s);
        require((1.0..=MAX_TICKS).contains(&ticks), "time_limit_s", &format!("makes {ticks} ticks"), &mend)
    }
}

impl Walker {
    pub(super) fn leads_somewhere(&self) -> Check {
        if self.mode == WalkMode::Stand && self.route.len() == 1 {
            return require(self.start_offset == 0.0, "start_offset", "is not on the route", "leave it out");
        }
        let length = self.cycle_length();
        require(
            self.mode == WalkMode::Stand || length > 0.01,
            "route",
            "leads nowhere",
            "give two points apart from each other, or use mode = \"stand\"",
        )?;
        let problem = format!("is {}", self.start_offset);
        let mend = format!("give 0 to {length} m along the route");
        require(self.start_offset <= length, "start_offset", &problem, &mend)
    }
}

fn require(holds: bool, field: &str, problem: &str, mend: &str) -> Check {
    if holds { Ok(()) } else { Err(FieldError::new(field, problem, mend)) }
}
