//! The numbers the paper prints about its thirteen scenarios (Tables II and V).

/// Side of a map cell, metres: Table II's areas are those of the pictures in cm2 at 72 dpi, and its cell
/// counts and laser rates give round ranges only at this resolution (methods 2.1).
pub(super) const CELL_M: f64 = 0.054;

/// One column of Table II, with the shortest length Table V reports for it.
#[derive(Debug, serde::Serialize)]
pub(crate) struct Published {
    /// Environment and scenario, as in `env1-s1`; `env3-sx` is Env3's S*.
    pub(crate) name: &'static str,
    pub(crate) people: usize,
    /// Laser observation rate: area of the half disc the laser sees over area of the map.
    pub(crate) laser_rate: f64,
    pub(crate) landmark_cells: usize,
    /// Free and occupied cells (D17).
    pub(crate) known_cells: usize,
    /// Least mean length over all planners, metres (Table V).
    pub(crate) shortest_m: f64,
    /// People walk by HRVO instead of scripts (S* only).
    #[serde(skip)]
    pub(super) hrvo: bool,
}

impl Published {
    /// Laser range that gives the published observation rate, metres (methods 2.2).
    pub(super) fn laser_range(&self) -> f64 {
        let cells = self.known_cells as f64;
        (2.0 * self.laser_rate * cells / std::f64::consts::PI).sqrt() * CELL_M
    }
}

/// All thirteen scenarios. Env2 S3 is printed with 218737 cells; that slip is mended.
pub(crate) static PUBLISHED: [Published; 13] = [
    column("env1-s1", 25, 0.0435, (28_946, 303_983), 35.38),
    column("env1-s2", 31, 0.0452, (31_397, 292_351), 35.23),
    column("env1-s3", 37, 0.0452, (31_397, 292_351), 34.52),
    column("env2-s1", 28, 0.0887, (16_274, 218_736), 27.97),
    column("env2-s2", 34, 0.0394, (16_274, 218_736), 27.61),
    column("env2-s3", 40, 0.0394, (20_254, 218_736), 27.30),
    column("env3-s1", 25, 0.0743, (17_970, 348_668), 36.10),
    Published { hrvo: true, ..column("env3-sx", 25, 0.0743, (17_970, 348_668), 39.59) },
    column("env3-s2", 30, 0.0379, (17_970, 348_668), 37.93),
    column("env3-s3", 40, 0.0379, (19_401, 348_668), 38.11),
    column("env4-s1", 27, 0.0767, (26_121, 337_606), 40.13),
    column("env4-s2", 27, 0.0391, (30_645, 337_606), 40.93),
    column("env4-s3", 40, 0.0391, (26_121, 337_606), 40.18),
];

const fn column(
    name: &'static str,
    people: usize,
    laser_rate: f64,
    (landmark_cells, known_cells): (usize, usize),
    shortest_m: f64,
) -> Published {
    Published { name, people, laser_rate, landmark_cells, known_cells, shortest_m, hrvo: false }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_give_the_ranges_of_a_sick_laser_at_whole_metres_within_one_percent() {
        let nominal = [5.0, 5.0, 5.0, 6.0, 4.0, 4.0, 7.0, 7.0, 5.0, 5.0, 7.0, 5.0, 5.0];
        for (p, metres) in PUBLISHED.iter().zip(nominal) {
            let range = p.laser_range();
            assert!((range / metres - 1.0).abs() < 0.0105, "{}: {range}", p.name);
        }
        // sqrt(2 * 0.0391 * 337606 / pi) = 91.67 cells
        let env4_s2 = &PUBLISHED[11];
        assert!((env4_s2.laser_range() - 4.950).abs() < 1e-3, "{}", env4_s2.name);
    }

    #[test]
    fn the_shortest_lengths_are_the_least_of_table_v() {
        let tables = include_str!("../../../../python/src/curionav/report/published.csv");
        for p in &PUBLISHED {
            let own = tables.lines().filter_map(|line| line.strip_prefix(p.name)?.strip_prefix(','));
            // The planner, six measures, speed, and then the length, with its deviation and perhaps a mark.
            let lengths = own.filter_map(|line| line.split(',').nth(8)?.split('\u{b1}').next()?.parse().ok());
            assert_eq!(lengths.fold(f64::INFINITY, f64::min), p.shortest_m, "{}", p.name);
        }
    }

    #[test]
    fn landmark_share_is_between_five_and_eleven_percent() {
        for p in &PUBLISHED {
            let share = p.landmark_cells as f64 / p.known_cells as f64;
            assert!((0.05..0.11).contains(&share), "{}: {share}", p.name);
        }
    }
}
