//! Fuzz target of the decoder `euroc`.
#![no_main]

#[path = "../entries.rs"]
mod entries;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let folder = std::env::temp_dir().join(format!("sphereflow-fuzz-{}", std::process::id()));
    let _ = std::fs::create_dir_all(&folder);
    entries::run("euroc", &folder, bytes);
});
