//! Writes the golden files anew: run it after a deliberate change of the contract, and review the difference.

use curionav_testing::golden;
use std::path::Path;

fn main() -> std::io::Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (path, content) in golden::files() {
        std::fs::write(root.join("schemas/golden").join(path), content)?;
    }
    Ok(())
}
