//! Maps as ROS map_server keeps them: a yaml that describes and an image that holds the cells.
//!
//! Pure: text and bytes in, grid out, and back. The rules are those of ROS 1 `map_server` and Nav2; the
//! thresholds are taken as written, with their known trap: grey 205, by which map savers mean unknown,
//! is an occupancy of 0.196 and so reads as free under a `free_thresh` of 0.25.

use std::io::{Cursor, ErrorKind};

use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Rgba};

use super::grid::MAX_CELLS;
use super::map_yaml::MapServerError;
use crate::occupancy::{Cell, MapMode, MapYaml, OccupancyGrid};
use crate::text::GZIP;

/// Most memory the image decoder may hold, bytes: the largest map with four 16-bit channels, and as much
/// again for its scratch.
const MAX_DECODER_BYTES: u64 = 16 * MAX_CELLS as u64;
/// Greatest number of decoded bytes for one encoded: a bitmap (P4) packs eight pixels into a byte.
const MAX_PNM_EXPANSION: u64 = 8;
/// The same for PNG: deflate's limit is 1032.
const MAX_PNG_EXPANSION: u64 = 1100;

/// The grid of an image (PGM or another PNM, or PNG; 8 or 16 bit; grey or colour) under its description.
/// The image's first row is the grid's last. PNM values are first scaled to the full 8 or 16 bits.
///
/// Sizes are checked against the limits and the length of `image_bytes` before pixels are allocated.
pub fn load_map(yaml: &MapYaml, image_bytes: &[u8]) -> Result<OccupancyGrid, MapServerError> {
    yaml.check_order()?;
    let image = decode(image_bytes)?;
    let width = image.width() as usize;
    let height = image.height() as usize;
    let mut cells = Vec::with_capacity(width * height);
    if let DynamicImage::ImageLuma8(grey) = image {
        // As nearly every map is: then there are 256 kinds of pixels.
        let kind =
            |value: u8| cell(yaml, Rgba([value, value, value, u8::MAX].map(|v| 257 * u16::from(v))), false);
        let kinds = std::array::from_fn::<i8, 256, _>(|value| kind(value as u8));
        for row in grey.rows().rev() {
            cells.extend(row.map(|pixel| kinds[usize::from(pixel.0[0])]));
        }
    } else {
        let alpha = image.color().has_alpha();
        for row in image.into_rgba16().rows().rev() {
            cells.extend(row.map(|&pixel| cell(yaml, pixel, alpha)));
        }
    }
    Ok(OccupancyGrid::new(width, height, yaml.resolution, yaml.origin, cells)?)
}

/// Value of a pixel, -1 or 0 to 100. `alpha` says whether the image has transparency.
fn cell(yaml: &MapYaml, pixel: Rgba<u16>, alpha: bool) -> i8 {
    const FULL: u32 = u16::MAX as u32;
    let [r, g, b, a] = pixel.0.map(u32::from);
    // map_server averages transparency in with the colours in trinary mode, and only there
    let (sum, channels) =
        if alpha && yaml.mode == MapMode::Trinary { (r + g + b + a, 4) } else { (r + g + b, 3) };
    let whole = FULL * channels;
    let dark = if yaml.negate { sum } else { whole - sum };
    // one division of whole numbers: the same double as (255 - v) / 255 of an 8-bit image
    let occupancy = f64::from(dark) / f64::from(whole);
    match yaml.mode {
        MapMode::Raw => {
            let value = (f64::from(sum) * 255.0 / f64::from(whole)).round();
            if value <= 100.0 { value as i8 } else { -1 }
        }
        MapMode::Scale if a != FULL => -1,
        _ if occupancy > yaml.occupied_thresh => 100,
        _ if occupancy < yaml.free_thresh => 0,
        MapMode::Trinary => -1,
        MapMode::Scale => {
            let share = (occupancy - yaml.free_thresh) / (yaml.occupied_thresh - yaml.free_thresh);
            (share * 100.0).round_ties_even() as i8
        }
    }
}

pub(super) fn decode(bytes: &[u8]) -> Result<DynamicImage, MapServerError> {
    let (format, expansion) = match image::guess_format(bytes) {
        Ok(ImageFormat::Pnm) => (ImageFormat::Pnm, MAX_PNM_EXPANSION),
        Ok(ImageFormat::Png) => (ImageFormat::Png, MAX_PNG_EXPANSION),
        _ if bytes.starts_with(&GZIP) => return Err(MapServerError::Gzip),
        _ => return Err(MapServerError::Format),
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(MAX_DECODER_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder()?;
    let (width, height) = decoder.dimensions();
    if u64::from(width) * u64::from(height) > MAX_CELLS as u64 {
        return Err(MapServerError::TooLarge(width, height));
    }
    if decoder.total_bytes() > expansion * bytes.len() as u64 {
        return Err(MapServerError::Truncated(width, height, bytes.len()));
    }
    DynamicImage::from_decoder(decoder).map_err(|error| match &error {
        ImageError::IoError(io) if io.kind() == ErrorKind::UnexpectedEof => {
            MapServerError::Truncated(width, height, bytes.len())
        }
        _ => error.into(),
    })
}

/// A grid as a binary PGM in map_saver's greys: free 254, occupied 0, unknown 205. With
/// [`MapYaml::trinary`] it is read back as the same grid, if its values are -1, 0 and 100 only.
pub fn encode_pgm(grid: &OccupancyGrid) -> Vec<u8> {
    let mut bytes = format!("P5\n{} {}\n255\n", grid.width(), grid.height()).into_bytes();
    bytes.reserve(grid.cells().len());
    for row in (0..grid.height()).rev() {
        bytes.extend((0..grid.width()).map(|column| match grid.cell(grid.index(column, row)) {
            Cell::Free => 254,
            Cell::Occupied => 0,
            Cell::Unknown => 205,
        }));
    }
    bytes
}

#[cfg(test)]
#[path = "map_server_tests.rs"]
mod tests;
