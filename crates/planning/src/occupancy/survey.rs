//! What a map holds as it is read, and what is odd about that.

use std::fmt;

use image::DynamicImage;

use super::map_server::{decode, load_map};
use super::{Cell, MapMode, MapServerError, MapYaml, OccupancyGrid};

/// The grey by which map savers mean unknown.
const UNKNOWN_GREY: u8 = 205;
/// A share that is no accident.
const NOTABLE: f64 = 0.001;

/// The shares of a map's cells, and what is odd about the way it is read.
#[derive(Debug, Clone, PartialEq)]
pub struct MapSurvey {
    /// Share of free cells.
    pub free: f64,
    /// Share of occupied cells.
    pub occupied: f64,
    /// Share of unknown cells.
    pub unknown: f64,
    /// What its author has probably not meant, a sentence each, with what to write instead.
    pub odd: Vec<String>,
}

impl fmt::Display for MapSurvey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [free, occupied, unknown] = [self.free, self.occupied, self.unknown].map(|share| 100.0 * share);
        write!(f, "{free:.1} % free, {occupied:.1} % occupied, {unknown:.1} % unknown")
    }
}

impl MapSurvey {
    /// Looks at an image under its description.
    ///
    /// # Errors
    /// They do not make a map.
    pub fn new(yaml: &MapYaml, image: &[u8]) -> Result<Self, MapServerError> {
        let grid = load_map(yaml, image)?;
        let [free, occupied, unknown] =
            [Cell::Free, Cell::Occupied, Cell::Unknown].map(|kind| share_of(&grid, kind));
        let greys = Greys::of(&decode(image)?);
        let mut survey = Self { free, occupied, unknown, odd: Vec::new() };
        survey.odd.extend(survey.raw_of_trinary(yaml, &greys));
        survey.odd.extend(survey.wrong_negate(yaml, image));
        survey.odd.extend(survey.unknown_as_free(yaml, &greys));
        survey.odd.extend(survey.one_sided());
        Ok(survey)
    }

    fn raw_of_trinary(&self, yaml: &MapYaml, greys: &Greys) -> Option<String> {
        let above = greys.share(101..=255);
        (yaml.mode == MapMode::Raw && above > 0.5).then(|| {
            format!(
                "`mode: raw` reads greys from 0 to 100 and takes the other {:.0} % of the image for unknown; leave \
                 `mode` out for the image of a map saver",
                100.0 * above
            )
        })
    }

    fn wrong_negate(&self, yaml: &MapYaml, image: &[u8]) -> Option<String> {
        if yaml.mode == MapMode::Raw || self.occupied < 0.5 {
            return None;
        }
        let other = MapYaml { negate: !yaml.negate, ..yaml.clone() };
        let free = share_of(&load_map(&other, image).ok()?, Cell::Free);
        (free > 2.0 * self.free).then(|| {
            format!(
                "{:.0} % of the map is occupied; with `negate: {}` {:.0} % would be free",
                100.0 * self.occupied,
                u8::from(other.negate),
                100.0 * free
            )
        })
    }

    fn unknown_as_free(&self, yaml: &MapYaml, greys: &Greys) -> Option<String> {
        let share = greys.share(UNKNOWN_GREY..=UNKNOWN_GREY);
        let occupancy = f64::from(u8::MAX - UNKNOWN_GREY) / f64::from(u8::MAX);
        let is_free = yaml.mode != MapMode::Raw && !yaml.negate && occupancy < yaml.free_thresh;
        (is_free && share > NOTABLE).then(|| {
            format!(
                "{:.1} % of the image has the grey 205, by which map savers mean unknown, and is free under \
                 `free_thresh: {}`; write `free_thresh: 0.196` if it is unknown",
                100.0 * share,
                yaml.free_thresh
            )
        })
    }

    fn one_sided(&self) -> Option<String> {
        match (self.free > 0.0, self.occupied > 0.0) {
            (false, _) => {
                Some("no cell is free, so that no robot can move; look at image and thresholds".into())
            }
            (true, false) => Some("no cell is occupied, so that a laser sees nothing of it".into()),
            (true, true) => None,
        }
    }
}

fn share_of(grid: &OccupancyGrid, kind: Cell) -> f64 {
    let all = grid.cells().len();
    (0..all).filter(|&index| grid.cell(index) == kind).count() as f64 / all as f64
}

/// How many pixels have each grey.
struct Greys {
    counts: [usize; 256],
    all: usize,
}

impl Greys {
    fn of(image: &DynamicImage) -> Self {
        let grey = image.to_luma8();
        let mut counts = [0; 256];
        for pixel in grey.pixels() {
            counts[usize::from(pixel.0[0])] += 1;
        }
        Self { counts, all: grey.pixels().len() }
    }

    fn share(&self, greys: std::ops::RangeInclusive<u8>) -> f64 {
        greys.map(|grey| self.counts[usize::from(grey)]).sum::<usize>() as f64 / self.all.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: &str = "image: m.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\n\
                         free_thresh: 0.196\n";

    /// Of a hundred pixels ten are black, twenty of the grey of the unknown, and the others white.
    fn image() -> Vec<u8> {
        let pixels = (0..100).map(|i| {
            if i < 10 {
                0
            } else if i < 30 {
                UNKNOWN_GREY
            } else {
                254
            }
        });
        [b"P5\n10 10\n255\n".to_vec(), pixels.collect()].concat()
    }

    fn survey(from: &str, to: &str) -> MapSurvey {
        assert!(PLAIN.contains(from));
        MapSurvey::new(&MapYaml::parse(&PLAIN.replace(from, to)).unwrap(), &image()).unwrap()
    }

    #[test]
    fn an_ordinary_map_has_its_shares_and_nothing_odd() {
        let plain = survey("", "");
        assert_eq!(plain.to_string(), "70.0 % free, 10.0 % occupied, 20.0 % unknown");
        assert!(plain.odd.is_empty(), "{plain:?}");
    }

    #[test]
    fn what_its_author_has_not_meant_is_told_with_the_mend() {
        for (from, to, words) in [
            ("negate: 0", "negate: 1", "90 % of the map is occupied; with `negate: 0` 70 % would be free"),
            ("negate: 0", "negate: 0\nmode: raw", "takes the other 90 % of the image for unknown"),
            ("0.196", "0.25", "20.0 % of the image has the grey 205"),
            ("0.65", "1.0", "no cell is occupied"),
            ("0.196", "0.0", "no cell is free"),
        ] {
            let found = survey(from, to);
            assert!(found.odd.iter().any(|odd| odd.contains(words)), "{to}: {found:?}");
        }
    }
}
