//! The fuzz entries with a small fixed budget: good files with seeded faults; no decoder may panic.
#![allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to

#[path = "../../../fuzz/entries.rs"]
mod entries;

use std::time::Instant;

/// Mutated inputs a decoder: enough to reach every branch of the text readers in a second.
const RUNS: usize = 400;
/// No input of a few hundred bytes may take this long, seconds: the slowest takes milliseconds.
const SLOWEST_S: f64 = 2.0;

/// Numbers from a linear congruence: the same faults in every run.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end.max(1)
    }
}

const G2O: &str = "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0 1\nFIX 0\n\
    VERTEX_TRACKXYZ 7 1 2 3\nEDGE_SE3_TRACKXYZ 0 7 0 1 2 3 1 0 0 1 0 1\n\
    EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
    property float z\nend_header\n1 2 3\n";
const CALIBRATION: &str = "schema = 2\ndepth_scale = 1000.0\n[depth]\nmodel = \"pinhole\"\nwidth = 64\n\
    height = 48\nparameters = { fx = 50.0, fy = 50.0, cx = 31.5, cy = 23.5 }\n";

/// Good files for a decoder, to begin from.
fn seeds(name: &str) -> Vec<Vec<u8>> {
    let texts: &[&str] = match name {
        "tum_lists" => &["1.5 depth/a.png\n1.6 depth/b.png\n"],
        "tum" => &["1.5 0 0 0 0 0 0 1\n1.6 1 2 3 0 0 0 1\n"],
        "kitti" => &["1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 2 0 0 1 3\n"],
        "euroc" => &["1600000000000000000,0,0,0,1,0,0,0\n1600000000005000000,0,0,0,1,0,0,0\n"],
        "imu_csv" => &["ns,wx,wy,wz,ax,ay,az\n5,0,0,0,0,0,9.8\n5000005,0,0,nan,0,0,9.8\n"],
        "g2o" => &[G2O],
        "bundle" => &[
            "1 1 1\n0 0 1.5 2.5\n0 0 0 0 0 0 500 0 0\n0 0 -5\n",
            "# Bundle file v0.3\n1 1\n500 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 0\n0 0 -5\n9 9 9\n1 0 0 1 2\n",
            "V3L4abcd\0\0\0\0\0\0\0\x01",
        ],
        "ply" => &[PLY],
        "calibration" => &[CALIBRATION],
        _ => &[
            "P5\n4 3\n65535\nabcdefghijklmnopqrstuvwx",
            "\u{89}PNG\r\n\x1a\n\0\0\0\rIHDR",
        ],
    };
    texts.iter().map(|text| text.as_bytes().to_vec()).collect()
}

const WORDS: [&str; 12] = [
    "nan",
    "inf",
    "-1",
    "1e300",
    "99999999999999999999",
    "0",
    ",",
    "\n",
    " ",
    "\u{feff}",
    "#",
    "-0",
];

fn mutated(seed: &[u8], numbers: &mut Numbers) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..=numbers.below(4) {
        let at = numbers.below(bytes.len() + 1);
        match numbers.below(5) {
            0 => bytes.truncate(at),
            1 if at < bytes.len() => bytes[at] = numbers.below(256) as u8,
            2 => {
                let word = WORDS[numbers.below(WORDS.len())];
                bytes.splice(at..at, word.bytes());
            }
            3 => {
                let end = (at + numbers.below(16)).min(bytes.len());
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            _ => {
                let end = (at + numbers.below(8)).min(bytes.len());
                bytes.drain(at..end);
            }
        }
    }
    bytes
}

#[test]
fn decoders_of_mutated_files_neither_panic_nor_hang() {
    let folder = tempfile::tempdir().unwrap();
    let mut numbers = Numbers(1);
    for (name, decode) in entries::ENTRIES {
        for seed in seeds(name) {
            for _ in 0..RUNS {
                let bytes = mutated(&seed, &mut numbers);
                let start = Instant::now();
                decode(folder.path(), &bytes);
                let took = start.elapsed().as_secs_f64();
                assert!(took < SLOWEST_S, "{name} took {took:.1} s for {bytes:?}");
            }
        }
    }
    entries::run("no such entry", folder.path(), b"");
}
