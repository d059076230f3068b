//! The rules of `CONTRIBUTING.md` that a machine can hold.

mod documents;
mod floors;
mod layout;
mod purity;
mod source;
mod tree;
