//! Writes the golden files anew: run it after a deliberate change of the contract, and review the difference.

use curionav_schemas::{golden, words};
use std::path::Path;

fn main() -> std::io::Result<()> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden");
    let mut index = String::from("# file, CDDL rule\n");
    for golden in golden::all() {
        std::fs::write(directory.join(format!("{}.cbor", golden.file)), &golden.bytes)?;
        index.push_str(&format!("{}.cbor {}\n", golden.file, golden.message));
    }
    std::fs::write(directory.join("index.txt"), index)?;
    std::fs::write(directory.join("sentences.cbor"), golden::sentences::encoded())?;
    // Python carries a copy of the words.
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join("../python/src/curionav/words.toml");
    std::fs::write(python, words::TABLE)
}
