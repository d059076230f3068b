use super::*;
use crate::geometry::Pose2;
use crate::occupancy::map_yaml::MAX_YAML_BYTES;
use crate::random::{rng, uniform};
use curionav_testing::reference_data;

const PLAIN: &str = "image: m.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";

/// A map of a dataset: its description and the bytes of its image.
#[track_caller]
fn published(file: &str) -> Option<(MapYaml, Vec<u8>)> {
    let path = reference_data(&format!("{file}.yaml"))?;
    let map = MapYaml::parse(&std::fs::read_to_string(&path).unwrap()).unwrap();
    let image = std::fs::read(path.with_file_name(&map.image)).unwrap();
    Some((map, image))
}

fn count(grid: &OccupancyGrid, kind: Cell) -> usize {
    (0..grid.cells().len()).filter(|&i| grid.cell(i) == kind).count()
}

fn yaml_with(from: &str, to: &str) -> String {
    assert!(PLAIN.contains(from));
    PLAIN.replace(from, to)
}

fn with_mode(mode: MapMode, negate: bool) -> MapYaml {
    MapYaml { mode, negate, ..MapYaml::parse(PLAIN).unwrap() }
}

fn png(image: impl Into<DynamicImage>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.into().write_to(&mut bytes, ImageFormat::Png).unwrap();
    bytes.into_inner()
}

#[test]
fn every_published_map_loads_with_its_known_size() {
    for (file, width, height) in [
        ("maps_nav2_turtlebot/TenByTen", 10, 10),
        ("maps_nav2_turtlebot/depot", 604, 307),
        ("maps_nav2_turtlebot/depot_keepout", 604, 307),
        ("maps_nav2_turtlebot/tb3_sandbox", 384, 384),
        ("maps_nav2_turtlebot/testmap", 10, 10),
        ("maps_nav2_turtlebot/turtlebot3/map", 384, 384),
        ("maps_nav2_turtlebot/warehouse", 1006, 1674),
        ("maps_real_slam/avz3floor_complete", 1800, 580),
        ("maps_real_slam/avz5floor_open_elevatoredit", 897, 481),
    ] {
        let Some((map, image)) = published(file) else { continue };
        let grid = load_map(&map, &image).unwrap();
        assert_eq!((grid.width(), grid.height()), (width, height), "{file}");
    }
}

#[test]
fn free_areas_are_those_measured_elsewhere() {
    for (name, expected) in [("avz3floor_complete", 499.0), ("avz5floor_open_elevatoredit", 347.0)] {
        let Some((map, image)) = published(&format!("maps_real_slam/{name}")) else { continue };
        let grid = load_map(&map, &image).unwrap();
        let area = count(&grid, Cell::Free) as f64 * 0.05 * 0.05;
        assert!((area - expected).abs() < 0.5, "{name}: {area} m2 free, not {expected}");
    }
}

#[test]
fn grey_205_is_free_or_unknown_as_the_threshold_says() {
    let Some((mut map, image)) = published("maps_nav2_turtlebot/depot") else { return };
    let grid = load_map(&map, &image).unwrap();
    let share = count(&grid, Cell::Free) as f64 / grid.cells().len() as f64;
    assert!((share - 0.968).abs() < 5e-4, "as written, 0.25: {share}");
    let pixels = &image[image.len() - 604 * 307..];
    let grey = pixels.iter().filter(|&&v| v == 205).count();
    map.free_thresh = 0.196;
    let strict = load_map(&map, &image).unwrap();
    assert_eq!(grey, 8894);
    assert_eq!(count(&grid, Cell::Free) - count(&strict, Cell::Free), grey);
    assert_eq!(count(&strict, Cell::Unknown) - count(&grid, Cell::Unknown), grey);
}

#[test]
fn a_turned_png_map_has_its_cells_where_the_pgm_has_them() {
    let Some((map, image)) = published("maps_nav2_turtlebot/testmap") else { return };
    let Some(pgm) = reference_data("maps_nav2_turtlebot/testmap.pgm") else { return };
    let grid = load_map(&map, &image).unwrap();
    assert_eq!(grid.origin(), Pose2::new(2.0, 3.0, 1.0));
    // centre of cell (0, 0): origin + R(1 rad) (0.05, 0.05)
    let centre = grid.centre(0, 0);
    let (s, c) = crate::numerics::sin_cos(1.0);
    assert!(
        (centre.x - (2.0 + 0.05 * (c - s))).abs() < 1e-12
            && (centre.y - (3.0 + 0.05 * (s + c))).abs() < 1e-12
    );
    assert_eq!(grid, load_map(&map, &std::fs::read(pgm).unwrap()).unwrap());
    assert!(count(&grid, Cell::Occupied) > 0 && count(&grid, Cell::Free) > 0);
}

#[test]
fn the_first_image_row_is_the_last_grid_row() {
    let grid =
        load_map(&with_mode(MapMode::Trinary, false), b"P5\n2 3\n255\n\x00\xfe\xfe\xfe\xcd\xfe").unwrap();
    assert_eq!(grid.cells(), [-1, 0, 0, 0, 100, 0]);
    let negated =
        load_map(&with_mode(MapMode::Trinary, true), b"P5\n2 3\n255\n\x00\xfe\xfe\xfe\xcd\xfe").unwrap();
    assert_eq!(negated.cells(), [100, 100, 100, 100, 0, 100]);
}

#[test]
fn every_grey_is_read_by_the_published_rule() {
    let greys: Vec<u8> = (0..=255).collect();
    let image = [b"P5 256 1 255\n", greys.as_slice()].concat();
    for negate in [false, true] {
        let cells = |mode| load_map(&with_mode(mode, negate), &image).unwrap().cells().to_vec();
        let trinary = cells(MapMode::Trinary);
        let scale = cells(MapMode::Scale);
        let raw = cells(MapMode::Raw);
        for v in 0..256 {
            let occ = (if negate { v } else { 255 - v }) as f64 / 255.0;
            let linear = ((occ - 0.196) / (0.65 - 0.196) * 100.0).round_ties_even() as i8;
            let pick = |between: i8| {
                if occ > 0.65 {
                    100
                } else if occ < 0.196 {
                    0
                } else {
                    between
                }
            };
            assert_eq!((trinary[v], scale[v]), (pick(-1), pick(linear)), "grey {v}, negate {negate}");
            assert_eq!(raw[v], if v <= 100 { v as i8 } else { -1 }, "grey {v}");
        }
    }
}

#[test]
fn plain_wide_and_commented_pnm_agree() {
    let map = with_mode(MapMode::Trinary, false);
    let plain = load_map(&map, b"P5\n3 1\n255\n\x00\xcd\xfe").unwrap();
    let commented = b"P5\n# CREATOR: gimp\n3 # columns\n1\n# greys\n255\n\x00\xcd\xfe";
    assert_eq!(load_map(&map, commented).unwrap(), plain);
    assert_eq!(load_map(&map, b"P2\n# ascii\n3 1\n255\n0 205\n254\n").unwrap(), plain);
    // 205 * 257 = 52685 = 0xcdcd, 254 * 257 = 0xfefe
    assert_eq!(load_map(&map, b"P5\n3 1\n65535\n\x00\x00\xcd\xcd\xfe\xfe").unwrap(), plain);
    assert_eq!(load_map(&map, b"P6\n3 1\n255\n\x00\x00\x00\xcd\xcd\xcd\xfe\xfe\xfe").unwrap(), plain);
    // bitmap: 1 is black; the last cell cannot be grey
    assert_eq!(load_map(&map, b"P4\n3 1\n\x80").unwrap().cells(), [100, 0, 0]);
}

#[test]
fn transparency_is_averaged_in_trinary_and_unknown_in_scale() {
    // black and opaque; black and clear; white and opaque; white and half clear
    let pixels = vec![0, 0, 0, 255, 0, 0, 0, 0, 255, 255, 255, 255, 255, 255, 255, 128];
    let image = png(image::RgbaImage::from_raw(4, 1, pixels).unwrap());
    // shades (0+0+0+255)/4 = 0.25, 0, 1 and (3*255+128)/4 = 0.875
    assert_eq!(load_map(&with_mode(MapMode::Trinary, false), &image).unwrap().cells(), [100, 100, 0, 0]);
    assert_eq!(load_map(&with_mode(MapMode::Scale, false), &image).unwrap().cells(), [100, -1, 0, -1]);
    // colours count alike: (255 + 0 + 0) / 3 is an occupancy of 2/3, more than 0.65
    let red = png(image::RgbImage::from_raw(1, 1, vec![255, 0, 0]).unwrap());
    assert_eq!(load_map(&with_mode(MapMode::Trinary, false), &red).unwrap().cells(), [100]);
    let deep = png(image::ImageBuffer::<image::Luma<u16>, _>::from_raw(2, 1, vec![0u16, 65535]).unwrap());
    assert_eq!(load_map(&with_mode(MapMode::Trinary, false), &deep).unwrap().cells(), [100, 0]);
}

#[test]
fn a_grid_survives_writing_and_reading() {
    for seed in 0..50 {
        let mut r = rng(seed, 11);
        let w = 1 + (uniform(&mut r) * 40.0) as usize;
        let h = 1 + (uniform(&mut r) * 40.0) as usize;
        let cells: Vec<i8> = (0..w * h).map(|_| [-1, 0, 100][(uniform(&mut r) * 3.0) as usize]).collect();
        let origin = Pose2::new(100.0 * uniform(&mut r) - 50.0, -1e-7 * uniform(&mut r), uniform(&mut r));
        let grid = OccupancyGrid::new(w, h, 0.01 + uniform(&mut r), origin, cells).unwrap();
        let yaml = MapYaml::trinary(&grid, "odd: \"name\" #1.pgm");
        let again = MapYaml::parse(&yaml.to_text().unwrap()).unwrap();
        assert_eq!(again, yaml, "seed {seed}");
        assert_eq!(load_map(&again, &encode_pgm(&grid)).unwrap().hash(), grid.hash(), "seed {seed}");
    }
}

#[test]
fn a_bad_description_is_told_apart_by_field_and_mend() {
    let cases = [
        ("resolution: 0.05\n", "", "`resolution` is missing"),
        ("image: m.pgm\n", "", "`image` is missing"),
        ("origin: [0, 0, 0]\n", "", "`origin` is missing"),
        ("negate: 0\n", "", "`negate` is missing"),
        ("free_thresh: 0.196\n", "", "`free_thresh` is missing"),
        ("occupied_thresh: 0.65\n", "", "`occupied_thresh` is missing"),
        ("0.05", "-0.05", "`resolution` in the map's yaml is -0.05: give the side"),
        ("0.05", ".nan", "`resolution` in the map's yaml is NaN"),
        ("0.05", ".inf", "`resolution` in the map's yaml is inf"),
        ("0.05", "fine", "`resolution` in the map's yaml is \"fine\""),
        ("0.05", "{a: 1}", "`resolution` in the map's yaml is neither"),
        ("[0, 0, 0]", "[0, 0]", "`origin` in the map's yaml is [0, 0]: give three numbers"),
        ("[0, 0, 0]", "[0, .nan, 0]", "`origin`"),
        ("[0, 0, 0]", "3", "`origin`"),
        ("negate: 0", "negate: 2", "`negate` in the map's yaml is 2: use 0 or 1"),
        ("0.65", "1.65", "`occupied_thresh` in the map's yaml is 1.65"),
        ("0.196", "-0.1", "`free_thresh` in the map's yaml is -0.1"),
        (
            "0.196",
            "0.7",
            "`free_thresh` in the map's yaml is 0.7 and `occupied_thresh` is 0.65: it must be less",
        ),
        (
            "negate: 0",
            "negate: 0\nmode: fancy",
            "`mode` in the map's yaml is \"fancy\": use trinary, scale or raw",
        ),
        ("negate: 0", "negate: 0\nfree_tresh: 0.2", "free_tresh"),
        ("negate: 0", "negate: 0\nnegate: 1", "negate"),
        ("negate: 0", "negate: [", "cannot be read"),
        ("image: m.pgm", "image: ''", "`image` in the map's yaml is \"\": give the file name"),
    ];
    for (from, to, expected) in cases {
        let error = MapYaml::parse(&yaml_with(from, to)).unwrap_err().to_string();
        assert!(error.contains(expected), "{from:?} -> {to:?}: {error}");
        assert!(!error.contains('\n'), "one line: {error}");
    }
    assert!(MapYaml::parse("").is_err() && MapYaml::parse("3").is_err());
    assert!(MapYaml::parse(&yaml_with("negate: 0", "negate: false")).is_ok());
    for mode in ["Scale", "SCALE", "scale", "Raw", "TriNary"] {
        assert!(
            MapYaml::parse(&yaml_with("negate: 0", &format!("negate: 0\nmode: {mode}"))).is_ok(),
            "{mode}"
        );
    }
    assert_eq!(MapYaml::parse(&format!("\u{feff}{PLAIN}")).unwrap(), MapYaml::parse(PLAIN).unwrap());
    assert!(MapYaml::parse(&" ".repeat(MAX_YAML_BYTES + 1)).is_err());
}

#[test]
fn absurd_sizes_are_refused_before_anything_is_allocated() {
    let map = with_mode(MapMode::Trinary, false);
    let refuse = |bytes: &[u8]| load_map(&map, bytes).unwrap_err();
    assert!(matches!(refuse(b"P5\n4000000000 4000000000\n255\n\x00"), MapServerError::TooLarge { .. }));
    assert!(matches!(refuse(b"P5\n4000000000 1\n255\n\x00"), MapServerError::TooLarge { .. }));
    assert!(matches!(refuse(b"P5\n4000 4001\n255\n\x00"), MapServerError::TooLarge { .. }));
    assert!(matches!(refuse(b"P5\n4000 4000\n255\n\x00"), MapServerError::Truncated { .. }));
    assert!(matches!(refuse(b"P5\n0 0\n255\n"), MapServerError::Image(_) | MapServerError::Grid(_)));
    assert!(matches!(refuse(b""), MapServerError::Format));
    assert!(matches!(refuse(&[0x1f, 0x8b, 8, 0, 0]), MapServerError::Gzip));
    for cut in [&b"P5\n4 4\n255\n0123456789"[..], b"P5\n4 4\n255\n", b"P6\n4 4\n255\n0123456789"] {
        let said = refuse(cut).to_string();
        assert!(said.contains("should have 4 x 4 pixels but is only"), "{said}");
    }
    assert!(matches!(refuse(b"GIF89a and more bytes"), MapServerError::Format));
    // a PNG header for 100000 x 100000 pixels, with the right checksum missing or not: never a grid
    let mut header = png(image::GrayImage::new(4, 4));
    header[16..24].copy_from_slice(&[0, 1, 0x86, 0xa0, 0, 1, 0x86, 0xa0]);
    refuse(&header);
}

#[test]
fn cut_or_damaged_images_are_errors_and_never_panics() {
    let map = with_mode(MapMode::Trinary, false);
    let mut r = rng(3, 12);
    let noise: Vec<u8> = (0..600).map(|_| (uniform(&mut r) * 256.0) as u8).collect();
    let pgm = [b"P5\n# c\n30 20\n255\n", noise.as_slice()].concat();
    let png = png(image::GrayImage::from_raw(30, 20, noise).unwrap());
    for whole in [&pgm, &png] {
        assert!(load_map(&map, whole).is_ok());
        for length in 0..whole.len() - 20 {
            assert!(load_map(&map, &whole[..length]).is_err(), "cut to {length} of {}", whole.len());
        }
        for _ in 0..3000 {
            let mut bad = whole.clone();
            for _ in 0..1 + (uniform(&mut r) * 4.0) as usize {
                let at = (uniform(&mut r) * bad.len().min(60) as f64) as usize;
                bad[at] = (uniform(&mut r) * 256.0) as u8;
            }
            let _ = load_map(&map, &bad);
        }
    }
}
