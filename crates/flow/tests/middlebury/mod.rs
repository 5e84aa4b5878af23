//! The Middlebury pairs of the data folder.

use sphereflow_core::Plane;
use sphereflow_flow::FlowField;
use std::path::{Path, PathBuf};

/// Two grey images and the true flow, NaN where unknown.
pub struct Pair {
    pub name: String,
    pub image0: Plane<f32>,
    pub image1: Plane<f32>,
    pub truth: FlowField,
}

/// All pairs, or `None` where there is no data folder.
pub fn pairs() -> Option<Vec<Pair>> {
    let root = PathBuf::from(std::env::var_os("SPHEREFLOW_DATA")?).join("flow-middlebury");
    let names = ["RubberWhale", "Grove2"];
    let load = |name: &str| Pair {
        name: name.into(),
        image0: grey(&root.join("other-data").join(name).join("frame10.png")),
        image1: grey(&root.join("other-data").join(name).join("frame11.png")),
        truth: flo(&root.join("other-gt-flow").join(name).join("flow10.flo")),
    };
    Some(names.map(load).into())
}

fn grey(path: &Path) -> Plane<f32> {
    let image = image::open(path).unwrap().to_rgb8();
    let luma = |p: &image::Rgb<u8>| {
        0.299 * f32::from(p[0]) + 0.587 * f32::from(p[1]) + 0.114 * f32::from(p[2])
    };
    let data = image.pixels().map(luma).collect();
    Plane::from_vec(image.width() as usize, image.height() as usize, data).unwrap()
}

/// Middlebury's `.flo`: a magic number, the size, then u and v interleaved.
fn flo(path: &Path) -> FlowField {
    let bytes = std::fs::read(path).unwrap();
    let word = |i: usize| <[u8; 4]>::try_from(&bytes[4 * i..4 * i + 4]).unwrap();
    let size = |i| i32::from_le_bytes(word(i)) as usize;
    let (width, height) = (size(1), size(2));
    let value = |i: usize| {
        let value = f32::from_le_bytes(word(3 + i));
        if value.abs() > 1e9 { f32::NAN } else { value }
    };
    FlowField {
        u: Plane::from_fn(width, height, |x, y| value(2 * (y * width + x))),
        v: Plane::from_fn(width, height, |x, y| value(2 * (y * width + x) + 1)),
    }
}
