//! What a run is judged by: how it ended, the paper's nine measures and four more.

use super::row::Row;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Measure {
    Success,
    Rmse,
    Tcm,
    Nm,
    Tce,
    Td,
    TdSeconds,
    Md,
    Nt,
    Vel,
    Length,
    Detour,
    Time,
    Frozen,
    Collisions,
    Clearance,
}

use Measure::{
    Clearance, Collisions, Detour, Frozen, Length, Md, Nm, Nt, Rmse, Success, Tce, Tcm, Td, TdSeconds, Time,
    Vel,
};

/// Keys and labels, in the order of [`Measure::ALL`].
const NAMES: [(&str, &str); 16] = [
    ("success", "success (%)"),
    ("rmse_m", "RMSE (m)"),
    ("tcm", "TCM (%)"),
    ("nm", "NM"),
    ("tce_s", "TCE (s)"),
    ("td", "TD (%)"),
    ("td_s", "TD (s)"),
    ("md_m", "MD (m)"),
    ("nt", "NT"),
    ("vel_mps", "Vel (m/s)"),
    ("length_m", "Length (m)"),
    ("detour", "Length / shortest"),
    ("time_s", "Time (s)"),
    ("frozen_s", "frozen (s)"),
    ("collisions", "collisions"),
    ("clearance_min_m", "clearance (m)"),
];

impl Measure {
    /// All; after the first in the order of the run's JSON.
    pub(crate) const ALL: [Self; 16] = [
        Success, Rmse, Tcm, Nm, Tce, Td, TdSeconds, Md, Nt, Vel, Length, Detour, Time, Frozen, Collisions,
        Clearance,
    ];
    /// Those of Tables III, IV and V, three a table.
    pub(crate) const PAPER: [Self; 9] = [Rmse, Tcm, Nm, Td, Md, Nt, Vel, Length, Time];

    pub(crate) fn key(self) -> &'static str {
        NAMES[self as usize].0
    }

    /// Its name for people, with the unit it is shown in.
    pub(crate) fn label(self) -> &'static str {
        NAMES[self as usize].1
    }

    /// A stored value as it is shown, with its unit.
    pub(crate) fn show_with_unit(self, value: f64) -> String {
        let unit = self.label().split_once('(').map_or("", |(_, unit)| unit.trim_end_matches(')'));
        format!("{} {unit}", self.show(value)).trim_end().to_owned()
    }

    /// Whether `a` is better than `b`.
    pub(crate) fn prefers(self, a: f64, b: f64) -> bool {
        if matches!(self, Success | Md | Vel | Clearance) { a > b } else { a < b }
    }

    /// Shown value per stored value: fractions are shown in per cent, as the paper does.
    pub(crate) fn shown_per_unit(self) -> f64 {
        if matches!(self, Success | Tcm | Td) { 100.0 } else { 1.0 }
    }

    /// A stored value as it is shown, without its unit.
    pub(crate) fn show(self, value: f64) -> String {
        let decimals = if matches!(self, Nm | Nt) { 1 } else { 2 };
        let text = format!("{:.*}", decimals, value * self.shown_per_unit());
        // No "-0.00".
        let is_zero = text.bytes().all(|b| matches!(b, b'-' | b'0' | b'.'));
        if is_zero { text.trim_start_matches('-').to_owned() } else { text.replace('-', "\u{2212}") }
    }

    /// Its value in one run. Nothing where it has none: no person was ever seen (MD), localisation never converged (NM, TCE), or the goal was
    /// not reached (Length, Detour and Time, which measure a journey that was completed).
    pub(crate) fn of(self, row: &Row) -> Option<f64> {
        let m = &row.measures;
        match self {
            Success => Some(f64::from(u8::from(row.is_success()))),
            Rmse => Some(m.rmse_m),
            Tcm => Some(m.tcm),
            Nm => m.nm.map(f64::from),
            Tce => m.tce_s,
            Td => Some(m.td),
            TdSeconds => Some(m.td * m.time_s),
            Md => m.md_m,
            Nt => Some(f64::from(m.nt)),
            Vel => Some(m.vel_mps),
            Length => row.is_reached().then_some(m.length_m),
            Detour => {
                let shortest = row.social.get("shortest_m").filter(|shortest| **shortest > 0.0)?;
                row.is_reached().then_some(m.length_m / shortest)
            }
            Frozen => row.social.get("frozen_s").copied(),
            Time => row.is_reached().then_some(m.time_s),
            Collisions => Some(f64::from(m.collisions)),
            Clearance => Some(m.clearance_min_m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_are_shown_in_per_cent_and_zero_has_no_sign() {
        assert_eq!(Td.show(0.0412), "4.12");
        assert_eq!(Length.show(40.0), "40.00");
        assert_eq!([Td.show_with_unit(0.05), Nt.show_with_unit(1.0)], ["5.00 %", "1.0"]);
        assert_eq!([Td.show(-1e-9), Clearance.show(-0.25)], ["0.00", "\u{2212}0.25"]);
    }

    #[test]
    fn farther_from_people_and_faster_is_better() {
        assert!(
            Md.prefers(2.0, 1.0) && Vel.prefers(0.9, 0.8) && !Rmse.prefers(0.3, 0.2) && !Td.prefers(0.1, 0.1)
        );
    }
}
