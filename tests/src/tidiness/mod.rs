//! The rules of `CONTRIBUTING.md` that a machine can hold.

mod circles;
mod documents;
mod extension_module;
mod floors;
mod imports;
mod layout;
mod purity;
mod source;
mod tree;
mod turns;
