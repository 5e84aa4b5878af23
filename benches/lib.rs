//! Criterion benches, one file per crate beside this one. Run them with `cargo bench`.
