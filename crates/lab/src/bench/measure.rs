//! What a run is judged by: how it ended, the paper's nine measures and four more.

use super::row::Row;

#[derive(Debug, Clone, Copy)]
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

impl Measure {
    /// All; after the first in the order of the run's JSON.
    pub(crate) const ALL: [Self; 16] = [
        Success, Rmse, Tcm, Nm, Tce, Td, TdSeconds, Md, Nt, Vel, Length, Detour, Time, Frozen, Collisions,
        Clearance,
    ];

    /// Its name in files.
    pub(crate) fn key(self) -> &'static str {
        match self {
            Success => "success",
            Rmse => "rmse_m",
            Tcm => "tcm",
            Nm => "nm",
            Tce => "tce_s",
            Td => "td",
            TdSeconds => "td_s",
            Md => "md_m",
            Nt => "nt",
            Vel => "vel_mps",
            Length => "length_m",
            Detour => "detour",
            Time => "time_s",
            Frozen => "frozen_s",
            Collisions => "collisions",
            Clearance => "clearance_min_m",
        }
    }

    /// Its value in one run. Nothing where it has none: no person was ever seen (MD), localisation never converged (NM,
    /// TCE), or the goal was not reached (Length, Detour and Time, which measure a journey that was completed).
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
