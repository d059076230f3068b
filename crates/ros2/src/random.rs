//! Values that tests invent.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Where random values come from: the same numbers on every machine.
pub struct Rng(Pcg64);

impl Rng {
    /// With this seed.
    pub fn new(seed: u64) -> Self {
        Self(Pcg64::seed_from_u64(seed))
    }

    /// A number below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        self.0.random_range(0..n.max(1))
    }
}

/// What can be invented.
pub trait Random {
    /// Any value, of which sequences are short.
    fn random(rng: &mut Rng) -> Self;
}

macro_rules! integers {
    ($($ty:ty),*) => {$(
        impl Random for $ty {
            fn random(rng: &mut Rng) -> Self {
                rng.0.random()
            }
        }
    )*};
}
integers!(bool, i8, u8, i16, u16, i32, u32, i64, u64);

macro_rules! floats {
    ($($ty:ty),*) => {$(
        impl Random for $ty {
            fn random(rng: &mut Rng) -> Self {
                match rng.below(20) {
                    0 => <$ty>::INFINITY,
                    1 => <$ty>::NAN,
                    2 => -0.0,
                    _ => rng.0.random_range(-1e6..1e6),
                }
            }
        }
    )*};
}
floats!(f32, f64);

impl Random for String {
    fn random(rng: &mut Rng) -> Self {
        let letters: Vec<char> = "abcXYZ019_/ äß→".chars().collect();
        (0..rng.below(20)).map(|_| letters[rng.below(letters.len())]).collect()
    }
}

impl<T: Random> Random for Vec<T> {
    fn random(rng: &mut Rng) -> Self {
        (0..rng.below(6)).map(|_| T::random(rng)).collect()
    }
}

impl<T: Random, const N: usize> Random for [T; N] {
    fn random(rng: &mut Rng) -> Self {
        std::array::from_fn(|_| T::random(rng))
    }
}
