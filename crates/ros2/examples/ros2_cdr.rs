//! Reads messages of ROS 2 for comparison with other implementations.
//!
//! `ros2_cdr` reads lines `TYPE HEX` and prints for each a line of JSON: the value and its bytes, encoded again.
//! `ros2_cdr --types [DISTRIBUTION]` prints name, DDS name and hash of every type; `ros2_cdr --random TYPE SEED`
//! prints a random value as above.

use std::io::{BufRead, Write};
use std::process::ExitCode;

use curionav_ros2::interface::Distribution;
use curionav_ros2::testing::{Rng, TYPES, Type, type_of};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let said = match arguments.as_slice() {
        [] => recode(),
        ["--types"] => types("kilted"),
        ["--types", distribution] => types(distribution),
        ["--random", name, seed] => random(name, seed),
        _ => Err("give nothing, --types [DISTRIBUTION], or --random TYPE SEED".into()),
    };
    match said {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "error: {error}");
            ExitCode::from(2)
        }
    }
}

type Said = Result<(), Box<dyn std::error::Error>>;

fn recode() -> Said {
    let mut out = std::io::stdout().lock();
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let (name, hex) = line.split_once(' ').ok_or("a line is TYPE HEX")?;
        let said = match (type_of(name), bytes(hex)) {
            (Some(of), Some(bytes)) => shown(of, &bytes),
            (None, _) => serde_json::json!({ "type": name, "error": "no such type; see --types" }),
            (_, None) => serde_json::json!({ "type": name, "error": "no hexadecimal digits" }),
        };
        writeln!(out, "{said}")?;
    }
    Ok(())
}

fn shown(of: &Type, payload: &[u8]) -> serde_json::Value {
    match (of.show)(payload) {
        Ok((again, value)) => serde_json::json!({ "type": of.name, "hex": hex(&again), "value": value }),
        Err(error) => serde_json::json!({ "type": of.name, "error": error.to_string() }),
    }
}

fn types(distribution: &str) -> Said {
    let known = Distribution::ALL.into_iter().find(|known| known.name() == distribution);
    let known = known.ok_or("a distribution is humble, jazzy, kilted or lyrical")?;
    let mut out = std::io::stdout().lock();
    for Type { name, interface, .. } in TYPES {
        writeln!(out, "{name} {} {}", interface.dds(), interface.hash(known))?;
    }
    Ok(())
}

fn random(name: &str, seed: &str) -> Said {
    let of = type_of(name).ok_or("no such type; see --types")?;
    let payload = (of.random)(&mut Rng::new(seed.parse()?))?;
    writeln!(std::io::stdout().lock(), "{}", shown(of, &payload))?;
    Ok(())
}

fn bytes(hex: &str) -> Option<Vec<u8>> {
    let hex = hex.trim();
    let pair = |at| u8::from_str_radix(hex.get(at..at + 2)?, 16).ok();
    hex.len().is_multiple_of(2).then(|| (0..hex.len()).step_by(2).map(pair).collect())?
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
