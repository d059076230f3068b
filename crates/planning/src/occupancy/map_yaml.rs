//! The yaml beside a map_server image.

use serde::{Deserialize, Serialize};
use serde_saphyr::{FlowSeq, NonFiniteFloatPolicy};

use crate::geometry::Pose2;
use crate::occupancy::{MapServerError, OccupancyGrid};

/// Longest description accepted, bytes: real ones have about 150.
pub(super) const MAX_YAML_BYTES: usize = 64 * 1024;

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
#[derive(Debug, Clone, PartialEq)]
pub struct MapYaml {
    /// File name of the image, relative to the yaml.
    pub image: String,
    /// Metres per pixel, positive.
    pub resolution: f64,
    /// Pose of the lower-left pixel's lower-left corner in the map frame.
    pub origin: Pose2,
    /// Whether white is occupied instead of black.
    pub negate: bool,
    /// Occupancy above this is occupied, at most 1.
    pub occupied_thresh: f64,
    /// Occupancy below this is free, at least 0 and below `occupied_thresh`.
    pub free_thresh: f64,
    /// How pixels are read.
    pub mode: MapMode,
}

/// The file as written. Fields are optional and loosely typed so that every complaint can name its field.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Loose {
    image: Option<Scalar>,
    resolution: Option<Scalar>,
    origin: Option<Scalar>,
    negate: Option<Scalar>,
    occupied_thresh: Option<Scalar>,
    free_thresh: Option<Scalar>,
    mode: Option<Scalar>,
}

/// The file as we write it.
#[derive(Serialize)]
struct Written<'a> {
    image: &'a str,
    mode: MapMode,
    resolution: f64,
    origin: FlowSeq<[f64; 3]>,
    negate: u8,
    occupied_thresh: f64,
    free_thresh: f64,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum Scalar {
    Flag(bool),
    Number(f64),
    Text(String),
    List(Vec<Scalar>),
    Other(serde::de::IgnoredAny),
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

/// The field's value as `read` understands it, or an error that names the field.
fn field<T>(
    field: &'static str,
    value: Option<Scalar>,
    example: &'static str,
    mend: &'static str,
    read: impl Fn(&Scalar) -> Option<T>,
) -> Result<T, MapServerError> {
    let value = value.ok_or(MapServerError::Missing { field, example })?;
    read(&value).ok_or_else(|| MapServerError::Field { field, found: value.describe(), mend })
}

const RESOLUTION_MEND: &str = "give the side of a pixel in metres, a number greater than 0";
const THRESHOLD_MEND: &str = "give an occupancy from 0 to 1";
const ORDER_MEND: &str = "it must be less than `occupied_thresh`";
const ORIGIN_MEND: &str = "give three numbers, [x, y, yaw], in metres and radians";

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
        let loose: Loose = serde_saphyr::from_str_with_options(text, options)
            .map_err(|e| MapServerError::Yaml(e.to_string()))?;
        let threshold = |v: &Scalar| v.number().filter(|n| (0.0..=1.0).contains(n));
        let mode = match loose.mode {
            None => MapMode::default(),
            Some(mode) => field("mode", Some(mode), "", "use trinary, scale or raw", read_mode)?,
        };
        let map = Self {
            image: field("image", loose.image, "image: map.pgm", "give the file name of the image", |v| {
                match v {
                    Scalar::Text(t) if !t.is_empty() => Some(t.clone()),
                    _ => None,
                }
            })?,
            resolution: field("resolution", loose.resolution, "resolution: 0.05", RESOLUTION_MEND, |v| {
                v.number().filter(|&n| n > 0.0)
            })?,
            origin: field("origin", loose.origin, "origin: [0.0, 0.0, 0.0]", ORIGIN_MEND, read_origin)?,
            negate: field("negate", loose.negate, "negate: 0", "use 0 or 1", read_flag)?,
            occupied_thresh: field(
                "occupied_thresh",
                loose.occupied_thresh,
                "occupied_thresh: 0.65",
                THRESHOLD_MEND,
                threshold,
            )?,
            free_thresh: field(
                "free_thresh",
                loose.free_thresh,
                "free_thresh: 0.196",
                THRESHOLD_MEND,
                threshold,
            )?,
            mode,
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
        Err(MapServerError::Field { field: "free_thresh", found, mend: ORDER_MEND })
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
        let written = Written {
            image: &self.image,
            mode: self.mode,
            resolution: self.resolution,
            origin: FlowSeq([self.origin.x, self.origin.y, self.origin.heading]),
            negate: u8::from(self.negate),
            occupied_thresh: self.occupied_thresh,
            free_thresh: self.free_thresh,
        };
        serde_saphyr::to_string(&written).map_err(|e| MapServerError::Yaml(e.to_string()))
    }
}

fn read_mode(value: &Scalar) -> Option<MapMode> {
    match value {
        Scalar::Text(t) if t == "trinary" => Some(MapMode::Trinary),
        Scalar::Text(t) if t == "scale" => Some(MapMode::Scale),
        Scalar::Text(t) if t == "raw" => Some(MapMode::Raw),
        _ => None,
    }
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
