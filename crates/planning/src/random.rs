//! Seeded randomness: the only kind there is.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

/// The project's generator: small, fast, the same on every platform.
pub type Rng = rand_pcg::Pcg64Mcg;

/// An independent generator for each (seed, stream).
pub fn rng(seed: u64, stream: u64) -> Rng {
    // SplitMix64 finaliser, so that neighbouring seeds and streams share nothing.
    let mut z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(stream.wrapping_add(1)));
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    Rng::seed_from_u64(z ^ (z >> 31))
}

/// One draw from N(0, 1).
pub fn standard_normal(rng: &mut Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// One draw from U[0, 1).
pub fn uniform(rng: &mut Rng) -> f64 {
    rand::RngExt::random::<f64>(rng)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_differ_and_repeat() {
        assert_eq!(uniform(&mut rng(7, 1)), uniform(&mut rng(7, 1)));
        assert_ne!(uniform(&mut rng(7, 1)), uniform(&mut rng(7, 2)));
        assert_ne!(uniform(&mut rng(7, 1)), uniform(&mut rng(8, 1)));
    }
}
