//! What is derived from a map before a mission starts, field by field.

use curionav_localization::{Localizer, LocalizerParams};
use curionav_planning::evaluation::cpc::{InformationField, InformationParams, RayField};
use curionav_planning::motion::OdometryNoise;
use curionav_planning::occupancy::{GeodesicField, StaticMap};
use curionav_planning::sensor::LaserModel;

use crate::case::Case;
use crate::hall;

/// The grid's two distance fields, the way to the goal, what scans tell, and the localiser with its likelihood field.
pub(crate) fn cases() -> anyhow::Result<Vec<Case>> {
    let grid = hall::grid()?;
    let map = hall::map()?;
    let [for_way, for_information, for_rays, for_localizer] = [0; 4].map(|_| map.clone());
    let laser = LaserModel::default();
    let params = InformationParams::default();
    let information = InformationField::new(&map, &laser, &params);
    let localizer = move |map: StaticMap| {
        let laser = LaserModel::default();
        let noise = OdometryNoise::default();
        Localizer::new(map, laser, noise, LocalizerParams::default(), 1)
    };
    Ok(vec![
        Case::after("prepare/distance-fields", 1, move || grid.clone(), StaticMap::new),
        Case::new("prepare/geodesic", move || GeodesicField::new(&for_way, hall::GOAL, 0.45)),
        Case::new("prepare/information", move || {
            InformationField::new(&for_information, &LaserModel::default(), &InformationParams::default())
        }),
        Case::new("prepare/rays", move || RayField::new(&information, &for_rays, &laser, &params)),
        Case::after("prepare/localizer", 1, move || (*for_localizer).clone(), localizer),
    ])
}
