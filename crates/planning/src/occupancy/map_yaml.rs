//! The yaml beside a map_server image.

use serde::de::{IgnoredAny, IntoDeserializer, value::StrDeserializer};
use serde::{Deserialize, Serialize, Serializer};
use serde_saphyr::{FlowSeq, NonFiniteFloatPolicy};

use crate::geometry::Pose2;
use crate::occupancy::OccupancyGrid;
use crate::occupancy::grid::{GridError, MAX_CELLS};
use crate::text::without_mark;

/// Longest description accepted, bytes: real ones have about 150.
pub(super) const MAX_YAML_BYTES: usize = 64 * 1024;

/// What is wrong with a map's yaml or image, and how to mend it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MapServerError {
    /// Not yaml, an unknown or repeated field, or longer than a description can be.
    #[error("the map's yaml cannot be read: {0}")]
    Yaml(String),
    /// A required field is absent, and a value that would do.
    #[error("`{0}` is missing from the map's yaml: add a line such as `{0}: {1}`")]
    Missing(&'static str, &'static str),
    /// A field's value, found as it says, cannot be used, and what it has to be.
    #[error("`{0}` in the map's yaml is {1}: {2}")]
    Field(&'static str, String, &'static str),
    /// The image is neither PNM nor PNG.
    #[error("the map's image is neither PGM/PNM nor PNG: convert it to one of these")]
    Format,
    /// The image is compressed as a whole.
    #[error("the map's image is compressed with gzip: unpack it (gunzip)")]
    Gzip,
    /// The image is damaged, or too large for the decoder.
    #[error("the map's image cannot be decoded: {0}")]
    Image(#[from] image::ImageError),
    /// More pixels, in columns and rows, than a map may have.
    #[error(
        "the map's image has {0} x {1} pixels, a map has at most {MAX_CELLS} cells: crop it or lower its resolution"
    )]
    TooLarge(u32, u32),
    /// The header promises more pixels, in columns and rows, than a file of so many bytes can hold.
    #[error(
        "the map's image should have {0} x {1} pixels but is only {2} bytes long: copy it again, it is cut off"
    )]
    Truncated(u32, u32, usize),
    /// The cells do not form a grid.
    #[error(transparent)]
    Grid(#[from] GridError),
}

/// How a pixel becomes an occupancy value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum MapMode {
    /// Occupied, free or unknown: 100, 0 or -1.
    #[default]
    Trinary,
    /// Linear between the thresholds; transparent pixels are unknown.
    Scale,
    /// The grey value itself, 0 to 100; anything above is unknown.
    Raw,
}

/// The description of a map. From [`MapYaml::parse`] every field is in range.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MapYaml {
    /// File name of the image, relative to the yaml.
    pub image: String,
    /// How pixels are read.
    pub mode: MapMode,
    /// Metres per pixel, positive.
    pub resolution: f64,
    /// Pose of the lower-left pixel's lower-left corner in the map frame.
    #[serde(serialize_with = "write_origin")]
    pub origin: Pose2,
    /// Whether white is occupied instead of black.
    #[serde(serialize_with = "write_flag")]
    pub negate: bool,
    /// Occupancy above this is occupied, at most 1.
    pub occupied_thresh: f64,
    /// Occupancy below this is free, at least 0 and below `occupied_thresh`.
    pub free_thresh: f64,
}

/// A value as written: loosely typed, so that every complaint can name its field.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum Scalar {
    Flag(bool),
    Number(f64),
    Text(String),
    List(Vec<Scalar>),
    Other(IgnoredAny),
}

impl Scalar {
    fn describe(&self) -> String {
        match self {
            Self::Flag(b) => b.to_string(),
            Self::Number(n) => n.to_string(),
            Self::Text(t) => format!("{t:?}"),
            Self::List(l) => format!("[{}]", l.iter().map(Self::describe).collect::<Vec<_>>().join(", ")),
            Self::Other(_) => "neither a number nor a text".to_owned(),
        }
    }

    fn number(&self) -> Option<f64> {
        match self {
            Self::Number(n) if n.is_finite() => Some(*n),
            _ => None,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    image: Option<Scalar>,
    resolution: Option<Scalar>,
    origin: Option<Scalar>,
    negate: Option<Scalar>,
    occupied_thresh: Option<Scalar>,
    free_thresh: Option<Scalar>,
    mode: Option<Scalar>,
}

/// The field's value as `read` understands it, or an error that says what to write instead.
fn field<T>(
    field: &'static str,
    value: Option<Scalar>,
    example: &'static str,
    mend: &'static str,
    read: impl Fn(&Scalar) -> Option<T>,
) -> Result<T, MapServerError> {
    let value = value.ok_or(MapServerError::Missing(field, example))?;
    read(&value).ok_or_else(|| MapServerError::Field(field, value.describe(), mend))
}

impl MapYaml {
    /// Reads a description. Unknown fields are refused, because a misspelt one would go unnoticed.
    pub fn parse(text: &str) -> Result<Self, MapServerError> {
        if text.len() > MAX_YAML_BYTES {
            return Err(MapServerError::Yaml(format!("it is longer than {MAX_YAML_BYTES} bytes")));
        }
        let options = serde_saphyr::options! {
            with_snippet: false,
            non_finite_float_policy: NonFiniteFloatPolicy::PassThrough,
        };
        let written: Written = serde_saphyr::from_str_with_options(without_mark(text), options)
            .map_err(|e| MapServerError::Yaml(e.to_string()))?;
        let Written { image, resolution, origin, negate, occupied_thresh, free_thresh, mode } = written;
        let side = |v: &Scalar| v.number().filter(|n| *n > 0.0);
        let threshold = |v: &Scalar| v.number().filter(|n| (0.0..=1.0).contains(n));
        let pixel = "give the side of a pixel in metres, a number greater than 0";
        let place = "give three numbers, [x, y, yaw], in metres and radians";
        let name = "give the file name of the image";
        let share = "give an occupancy from 0 to 1";
        let mode = Some(mode.unwrap_or(Scalar::Text("trinary".to_owned())));
        let map = Self {
            image: field("image", image, "map.pgm", name, read_name)?,
            mode: field("mode", mode, "", "use trinary, scale or raw", read_mode)?,
            resolution: field("resolution", resolution, "0.05", pixel, side)?,
            origin: field("origin", origin, "[0.0, 0.0, 0.0]", place, read_origin)?,
            negate: field("negate", negate, "0", "use 0 or 1", read_flag)?,
            occupied_thresh: field("occupied_thresh", occupied_thresh, "0.65", share, threshold)?,
            free_thresh: field("free_thresh", free_thresh, "0.196", share, threshold)?,
        };
        map.check_order()?;
        Ok(map)
    }

    /// Whether the thresholds leave room between them.
    pub(super) fn check_order(&self) -> Result<(), MapServerError> {
        if self.free_thresh < self.occupied_thresh {
            return Ok(());
        }
        let found = format!("{} and `occupied_thresh` is {}", self.free_thresh, self.occupied_thresh);
        let mend = "it must be less than `occupied_thresh`";
        Err(MapServerError::Field("free_thresh", found, mend))
    }

    /// The description that belongs to [`encode_pgm`](super::encode_pgm) of `grid`, stored under the name `image`.
    pub fn trinary(grid: &OccupancyGrid, image: &str) -> Self {
        Self {
            image: image.to_owned(),
            resolution: grid.resolution(),
            origin: grid.origin(),
            negate: false,
            occupied_thresh: 0.65,
            free_thresh: 0.196,
            mode: MapMode::Trinary,
        }
    }

    /// The yaml text; [`MapYaml::parse`] gives back the same numbers.
    pub fn to_text(&self) -> Result<String, MapServerError> {
        serde_saphyr::to_string(self).map_err(|e| MapServerError::Yaml(e.to_string()))
    }
}

fn read_name(value: &Scalar) -> Option<String> {
    match value {
        Scalar::Text(name) if !name.is_empty() => Some(name.clone()),
        _ => None,
    }
}

fn read_mode(value: &Scalar) -> Option<MapMode> {
    let Scalar::Text(mode) = value else { return None };
    let mode = mode.to_lowercase();
    let mode: StrDeserializer<'_, serde::de::value::Error> = mode.as_str().into_deserializer();
    MapMode::deserialize(mode).ok()
}

fn read_origin(value: &Scalar) -> Option<Pose2> {
    let Scalar::List(list) = value else { return None };
    let [x, y, yaw] = list.as_slice() else { return None };
    Some(Pose2::new(x.number()?, y.number()?, yaw.number()?))
}

fn read_flag(value: &Scalar) -> Option<bool> {
    match value {
        Scalar::Flag(flag) => Some(*flag),
        Scalar::Number(n) if *n == 0.0 => Some(false),
        Scalar::Number(n) if *n == 1.0 => Some(true),
        _ => None,
    }
}

fn write_origin<S: Serializer>(origin: &Pose2, serializer: S) -> Result<S::Ok, S::Error> {
    FlowSeq([origin.x, origin.y, origin.heading]).serialize(serializer)
}

fn write_flag<S: Serializer>(flag: &bool, serializer: S) -> Result<S::Ok, S::Error> {
    u8::from(*flag).serialize(serializer)
}
