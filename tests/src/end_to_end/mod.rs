//! The program as a user runs it: `curionav` in its own process, judged by what it prints.

mod admission;
mod bad_input;
mod bench;
mod deployment;
mod program;
mod real_inputs;
mod scale;
mod scenarios;
