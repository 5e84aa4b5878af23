//! The depth filter on the room of section 4.1.1 and away from it.

mod scene;

use scene::{Sequence, error_percent};
use sphereflow_core::{Plane, Stamp};
use sphereflow_flow::{DepthFilter, DepthFilterConfig, DepthStatus};
use sphereflow_sim::{Motion, Scene, SimConfig};
use sphereflow_sphere::Camera;

/// Errors in percent, frame by frame, and normalised deviations of some.
pub struct Run {
    pub error: Vec<f64>,
    pub median: Vec<f64>,
    pub normalised: Vec<f64>,
}

fn run(
    sequence: &Sequence,
    config: DepthFilterConfig,
    frames: usize,
    every: usize,
    light: impl Fn(f64, f64) -> f32,
) -> Run {
    let mut filter = DepthFilter::new(sequence.camera(), config).unwrap();
    let mut out = Run {
        error: vec![],
        median: vec![],
        normalised: vec![],
    };
    for index in 0..frames {
        let mut frame = sequence.frame(index);
        let (w, h) = frame.image.size();
        for y in 0..h {
            let g = light(frame.t_s, y as f64 / h as f64);
            for v in &mut frame.image.data_mut()[y * w..(y + 1) * w] {
                *v *= g;
            }
        }
        let step = filter
            .step(
                &frame.image,
                &frame.pose,
                Stamp::from_ns((frame.t_s * 1e9) as i64),
            )
            .unwrap();
        if index % every == 0 {
            let (range, std) = filter.range();
            let e = error_percent(&range, &frame.range, sequence.camera());
            let rel: Vec<f64> = range
                .data()
                .iter()
                .zip(frame.range.data())
                .map(|(a, b)| f64::from((a - b).abs() / b))
                .collect();
            let norm: Vec<f64> = range
                .data()
                .iter()
                .zip(frame.range.data())
                .zip(std.data())
                .map(|((a, b), s)| f64::from((a - b) / s).powi(2))
                .collect();
            let med = 100.0 * scene::quantile(&rel, 0.5);
            let ne = (norm.iter().sum::<f64>() / norm.len() as f64).sqrt();
            println!(
                "{:.2} s: E {e:.3} med {med:.3} p99 {:.2} nstd {ne:.2} (med {:.2}) sigma {:.2} fit {:.3} {:?}",
                frame.t_s,
                100.0 * scene::quantile(&rel, 0.99),
                scene::quantile(&norm, 0.5).sqrt() / 0.6745,
                step.sigma_grey,
                step.fitting_share,
                step.status.name()
            );
            out.error.push(e);
            out.median.push(med);
            out.normalised.push(ne);
        }
    }
    out
}

#[test]
#[ignore]
fn probe() {
    let var = |n: &str, d: f64| {
        std::env::var(n)
            .ok()
            .and_then(|v| v.parse().ok())
            .unwrap_or(d)
    };
    let name = std::env::var("SCENE").unwrap_or("room".into());
    let camera = if name.starts_with("sphere") {
        Camera::equirectangular(512, 256).unwrap()
    } else {
        SimConfig::thesis_camera(640, 480).unwrap()
    };
    let scene = match name.as_str() {
        "ellipsoid" | "sphere_ell" => Scene::thesis_ellipsoid(),
        "box" => box_scene(),
        "furnished" => Scene::furnished_room(3),
        "fine" => Scene::thesis_room_with(0.1).unwrap(),
        "coarse" => Scene::thesis_room_with(1.0).unwrap(),
        _ => Scene::thesis_room(),
    };
    let motion = match std::env::var("MOTION").unwrap_or_default().as_str() {
        "hand" => Motion::hand_held(1),
        "hand2" => Motion::hand_held(2),
        "hand3" => Motion::hand_held(3),
        "trolley" => Motion::trolley(1),
        "tour" => Motion::room_tour(1),
        _ => Motion::sinusoids_411(),
    };
    let sequence = Sequence::new(scene, &camera, motion, var("SIGMA", 10.0));
    let mut config = DepthFilterConfig {
        roughness_per_m_px: var("TAU", 1e-4),
        binning: var("BIN", 2.0) as usize,
        ..Default::default()
    };
    if var("OCC", 1.0) == 0.0 {
        config.occlusion = false;
    }
    let l = var("LIGHT", 0.0);
    let r = run(
        &sequence,
        config,
        (60.0 * var("T", 4.0)) as usize + 1,
        var("EVERY", 30.0) as usize,
        |t, y| match l {
            1.0 => 1.0 + 0.1 * (2.0 * 3.1415926 * 4.17 * t).sin() as f32,
            2.0 => 1.0 + 0.1 * (2.0 * 3.1415926 * (4.17 * t + 1.5 * y)).sin() as f32,
            _ => 1.0,
        },
    );
    let late: Vec<f64> = r.error[r.error.len() / 2..].to_vec();
    println!(
        "SUMMARY {name} mean {:.3} max {:.3}",
        late.iter().sum::<f64>() / late.len() as f64,
        late.iter().copied().fold(0.0, f64::max)
    );
}

fn box_scene() -> Scene {
    use sphereflow_sim::scene::{Block, Primitive, Texture};
    let mut all = Scene::thesis_room().primitives().to_vec();
    let block = Block::new([0.45, 0.1, 1.1].into(), [0.25, 0.3, 0.2].into(), 0.5);
    all.push(Primitive::new(
        block,
        Texture::SolidSinusoid { period_m: 0.3 },
    ));
    Scene::new(all).unwrap()
}
