//! The golden files are what the types of the contract write.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on stops")]

use curionav_testing::golden;
use std::path::Path;

#[test]
fn the_encoder_writes_the_golden_bytes() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (name, content) in golden::files() {
        let path = root.join("schemas/golden").join(name);
        assert_eq!(std::fs::read(&path).unwrap(), content, "{}", path.display());
    }
}
