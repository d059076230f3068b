//! Work in pieces that do not depend on each other, done by as many threads as the caller has.
//!
//! This crate starts no thread. What takes long is cut into pieces, always the same ones, and each piece has its own
//! place for its result, so results are the same bits for any number of workers.

/// One piece of work.
pub type Piece<'a> = Box<dyn FnOnce() + Send + 'a>;

/// Does pieces of work.
pub trait Workers {
    /// Does each piece once, in any order, also several at a time, and returns when all are done.
    fn run(&self, pieces: Vec<Piece<'_>>);
}

/// Does one piece after the other.
#[derive(Debug, Clone, Copy)]
pub struct Alone;

impl Workers for Alone {
    fn run(&self, pieces: Vec<Piece<'_>>) {
        pieces.into_iter().for_each(|piece| piece());
    }
}
