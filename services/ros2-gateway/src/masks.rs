//! The masks that the configuration names, put on every map of the robot.

use std::path::Path;

use anyhow::{Context, anyhow};
use curionav_planning::occupancy::{MapYaml, OccupancyGrid, SpeedScale, load_map};
use curionav_planning::text::loose_text;

use crate::config::MissionDefaults;
use crate::fault::Fault;

/// Where the robot must not drive, and where it is slower.
#[derive(Debug, Default)]
pub(crate) struct Masks {
    keepout: Option<OccupancyGrid>,
    speed: Option<(OccupancyGrid, SpeedScale)>,
}

impl Masks {
    /// Reads the files that the configuration names.
    ///
    /// # Errors
    /// Name the field and the file.
    pub(crate) fn read(mission: &MissionDefaults) -> anyhow::Result<Self> {
        let read = |field: &str, path: &Option<_>| path.as_deref().map(|path| mask(field, path)).transpose();
        let scale = SpeedScale { base: mission.speed_base, multiplier: mission.speed_multiplier };
        let keepout = read("keepout", &mission.keepout)?;
        let speed = read("speed", &mission.speed)?;
        if let Some(speed) = &speed {
            // Whether its values are speeds, the map does not change.
            speed.with_speed_limits(speed, scale).map_err(|error| anyhow!("ros2.mission.speed: {error}"))?;
        }
        Ok(Self { keepout, speed: speed.map(|speed| (speed, scale)) })
    }

    /// The map with its zones.
    ///
    /// # Errors
    /// A mask marks nothing of the map. Without what it keeps the robot out of, the map is not used.
    pub(crate) fn on(&self, map: OccupancyGrid) -> Result<OccupancyGrid, Fault> {
        let fault = |field: &str, error| Fault::unusable(format!("the mask of ros2.mission.{field} {error}"));
        let mut map = map;
        if let Some(mask) = &self.keepout {
            map = map.with_keepout(mask).map_err(|error| fault("keepout", error))?;
        }
        if let Some((mask, scale)) = &self.speed {
            map = map.with_speed_limits(mask, *scale).map_err(|error| fault("speed", error))?;
        }
        Ok(map)
    }
}

fn mask(field: &str, path: &Path) -> anyhow::Result<OccupancyGrid> {
    let at = || format!("ros2.mission.{field}: {}", path.display());
    let text = std::fs::read(path).with_context(at)?;
    let text = loose_text(&text).map_err(|error| anyhow!("{}: {error}", at()))?;
    let yaml = MapYaml::parse(&text).with_context(at)?;
    let image = path.parent().unwrap_or(Path::new("")).join(&yaml.image);
    let bytes = std::fs::read(&image).with_context(|| format!("{}: image: {}", at(), image.display()))?;
    load_map(&yaml, &bytes).with_context(|| format!("{}: image: {}", at(), image.display()))
}

#[cfg(test)]
mod tests {
    use curionav_planning::geometry::Pose2;
    use curionav_planning::occupancy::encode_pgm;

    use super::*;

    fn grid(x: f64, cells: Vec<i8>) -> OccupancyGrid {
        OccupancyGrid::new(4, 1, 1.0, Pose2::new(x, 0.0, 0.0), cells).unwrap()
    }

    /// The configuration that names `mask` as keepout, and the folder of the files.
    fn named(mask: &OccupancyGrid) -> (MissionDefaults, tempfile::TempDir) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("mask.yaml");
        std::fs::write(&file, MapYaml::trinary(mask, "mask.pgm").to_text().unwrap()).unwrap();
        std::fs::write(folder.path().join("mask.pgm"), encode_pgm(mask)).unwrap();
        (MissionDefaults { keepout: Some(file), ..MissionDefaults::default() }, folder)
    }

    #[test]
    fn every_map_gets_the_zones_of_the_files() {
        let (mission, _folder) = named(&grid(0.0, vec![0, 100, 0, 0]));
        let masks = Masks::read(&mission).unwrap();
        let zoned = masks.on(grid(0.0, vec![0; 4])).unwrap();
        assert_eq!(zoned.limits(), [100, 0, 100, 100]);
        let fault = masks.on(grid(40.0, vec![0; 4])).unwrap_err().to_string();
        assert!(fault.contains("ros2.mission.keepout lies beside the map"), "{fault}");
    }

    #[test]
    fn a_mask_that_cannot_be_used_is_refused_at_the_start_with_field_and_file() {
        let (mission, folder) = named(&grid(0.0, vec![0, 100, 0, 0]));
        // Black means 100, and so 0 % of the greatest speed.
        let speed = MissionDefaults { speed: mission.keepout.clone(), ..MissionDefaults::default() };
        let said = format!("{:#}", Masks::read(&speed).unwrap_err());
        assert!(said.starts_with("ros2.mission.speed: has a cell of value 100"), "{said}");
        std::fs::remove_file(folder.path().join("mask.pgm")).unwrap();
        let said = format!("{:#}", Masks::read(&mission).unwrap_err());
        assert!(said.starts_with("ros2.mission.keepout: ") && said.contains("mask.pgm"), "{said}");
    }
}
