//! What a run is judged by: how it ended, the paper's nine measures and six more.

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
    TdInView,
    MdInView,
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
    Clearance, Collisions, Detour, Frozen, Length, Md, MdInView, Nm, Nt, Rmse, Success, Tce, Tcm, Td,
    TdInView, TdSeconds, Time, Vel,
};

impl Measure {
    /// All; after the first in the order of the run's JSON.
    pub(crate) const ALL: [Self; 18] = [
        Success, Rmse, Tcm, Nm, Tce, Td, TdSeconds, Md, TdInView, MdInView, Nt, Vel, Length, Detour, Time,
        Frozen, Collisions, Clearance,
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
            TdInView => "td_in_view",
            MdInView => "md_in_view_m",
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
            TdInView => m.td_in_view,
            MdInView => m.md_in_view_m,
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
