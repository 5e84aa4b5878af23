//! The thesis's observers at the thesis's size: `cargo run --release -p sphereflow-benches --example
//! depth_faithful -- [--sigma S]... [--prefilter PX]
//! [--flow-weight W] [--depth-weight W] [--csv FILE]`.
//!
//! Thesis: section 4.1.1, section 4.1.2, section 4.1.3. The room at 640x480, 60 Hz, 4 s.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use sphereflow_core::{Plane, Twist};
use sphereflow_depth::{
    DataTerm, DepthObserver, FlowObserver, ObserverConfig, PixelRays, SobolevConfig, SobolevDepth,
    TvDepth, TvDepthConfig,
};
use sphereflow_flow::{FlowField, TvL1Config, TvL1Flow, tv_l1};
use sphereflow_sim::{Motion, Renderer, Scene, SimConfig};
use std::fmt::Write as _;

const RATE_HZ: f64 = 60.0;
const SECONDS: f64 = 4.0;

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

/// Names of the methods, in the order of the errors.
const METHODS: [&str; 5] = [
    "TV-L1 flow + (3.3), k 500 s/m",
    "Sobolev depth (2.16), converged",
    "Sobolev depth + (3.7), k 30 m/s",
    "TV-L1 depth (2.17)",
    "TV-L1 depth + (3.7), k 30 m/s",
];

fn main() -> Fallible<()> {
    let (mut sigmas, mut prefilter_px, mut csv) = (Vec::new(), None, None);
    let (mut flow_weight, mut depth_weight) = (None, None);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let value = arguments.next().ok_or("a value is missing")?;
        match argument.as_str() {
            "--sigma" => sigmas.push(value.parse::<f32>()?),
            "--prefilter" => prefilter_px = Some(value.parse::<f32>()?),
            "--flow-weight" => flow_weight = Some(value.parse::<f32>()?),
            "--depth-weight" => depth_weight = Some(value.parse::<f64>()?),
            "--csv" => csv = Some(value),
            _ => return Err(format!("{argument} is unknown").into()),
        }
    }
    if sigmas.is_empty() {
        sigmas = vec![0.0, 1.0, 10.0];
    }
    let mut table = String::from("sigma,prefilter_px,t_s,speed_m_s,method,error_percent\n");
    for sigma in sigmas {
        // Noise of ten grey levels needs a prefilter; the thesis does not say which.
        let prefilter_px = prefilter_px.unwrap_or(if sigma > 5.0 { 1.5 } else { 0.0 });
        // The weight of the data falls with the noise, as in the thesis's own choice of alpha.
        let noisy = sigma > 5.0;
        // Smoothed noise is no longer seen by the flow's own measure: the weight that it would take is given.
        let smoothed = noisy && prefilter_px > 0.0;
        let flow_weight = flow_weight.or(smoothed.then_some(0.05));
        let depth_weight = depth_weight.unwrap_or(if noisy { 0.02 } else { 0.5 });
        let curve = run(sigma, prefilter_px, (flow_weight, depth_weight))?;
        for (index, method) in METHODS.iter().enumerate() {
            report(sigma, prefilter_px, method, index, &curve);
            for point in &curve {
                let (t_s, speed, error) = (point.t_s, point.speed, point.errors[index]);
                writeln!(
                    table,
                    "{sigma},{prefilter_px},{t_s:.4},{speed:.4},{method},{error:.4}"
                )?;
            }
        }
    }
    if let Some(csv) = csv {
        std::fs::write(csv, table)?;
    }
    Ok(())
}

/// Errors at a time, percent.
struct Point {
    t_s: f64,
    speed: f64,
    errors: [f64; METHODS.len()],
}

fn report(sigma: f32, prefilter_px: f32, method: &str, index: usize, curve: &[Point]) {
    let late = |least: f64| {
        let chosen = curve.iter().filter(|p| p.t_s >= 2.0 && p.speed >= least);
        let mut errors: Vec<f64> = chosen.map(|p| p.errors[index]).collect();
        errors.sort_by(f64::total_cmp);
        errors
    };
    let (all, moving) = (late(0.0), late(0.2));
    println!(
        "sigma {sigma}, prefilter {prefilter_px} px, {method}: 2 to 4 s median {:.2} %, min {:.2} %, max \
         {:.2} %; where |v| > 0.2 m/s median {:.2} %, max {:.2} %",
        all[all.len() / 2],
        all[0],
        all[all.len() - 1],
        moving[moving.len() / 2],
        moving[moving.len() - 1],
    );
}

/// All methods over the sequence.
fn run(sigma: f32, prefilter_px: f32, weights: (Option<f32>, f64)) -> Fallible<Vec<Point>> {
    let camera = SimConfig::thesis_camera(640, 480)?;
    let (renderer, motion) = (
        Renderer::new(&Scene::thesis_room(), &camera),
        Motion::sinusoids_411(),
    );
    let mut methods = Methods::new(PixelRays::new(&camera)?, weights)?;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut last: Option<Plane<f32>> = None;
    let mut curve = Vec::new();
    for index in 0..=(SECONDS * RATE_HZ) as usize {
        let t_s = index as f64 / RATE_HZ;
        let rendered = renderer.render(&motion.pose(t_s));
        let mut image = rendered.grey_1_to_256();
        for value in image.data_mut() {
            let noise: f32 = StandardNormal.sample(&mut rng);
            *value += sigma * noise;
        }
        let image = smoothed(&image, prefilter_px);
        if let Some(last) = &last {
            let twist = motion.state(t_s - 0.5 / RATE_HZ).twist;
            let ranges = methods.step(last, &image, &twist)?;
            let truth = rendered.range.into_plane();
            curve.push(Point {
                t_s,
                speed: twist.linear_m_s.norm(),
                errors: ranges.map(|range| error_percent(&range, &truth)),
            });
        }
        last = Some(image);
    }
    Ok(curve)
}

/// The methods and what they keep from frame to frame.
struct Methods {
    rays: PixelRays,
    flow: TvL1Flow,
    last_flow: Option<FlowField>,
    by_flow: FlowObserver,
    sobolev: SobolevDepth,
    smooth: Option<Plane<f32>>,
    by_sobolev: DepthObserver,
    tv: TvDepth,
    edged: Option<Plane<f32>>,
    by_tv: DepthObserver,
}

impl Methods {
    fn new(rays: PixelRays, (flow, depth): (Option<f32>, f64)) -> Fallible<Self> {
        let flow = TvL1Config {
            lambda: flow,
            ..TvL1Config::warm()
        };
        let tv = TvDepthConfig {
            lambda: depth,
            ..TvDepthConfig::default()
        };
        Ok(Self {
            flow: TvL1Flow::new(flow)?,
            last_flow: None,
            by_flow: FlowObserver::new(&rays, ObserverConfig::flow())?,
            sobolev: SobolevDepth::new(&rays, SobolevConfig::default())?,
            smooth: None,
            by_sobolev: DepthObserver::new(&rays, ObserverConfig::depth())?,
            tv: TvDepth::new(&rays, tv)?,
            edged: None,
            by_tv: DepthObserver::new(&rays, ObserverConfig::depth())?,
            rays,
        })
    }

    fn step(
        &mut self,
        last: &Plane<f32>,
        image: &Plane<f32>,
        twist: &Twist,
    ) -> Fallible<[Plane<f32>; METHODS.len()]> {
        let dt_s = 1.0 / RATE_HZ;
        let start = match self.last_flow.take() {
            Some(flow) => flow,
            None => tv_l1(last, image, &TvL1Config::default(), None)?,
        };
        let flow = self.flow.flow(last, image, Some(&start))?;
        self.by_flow.step(&flow, twist, dt_s)?;
        self.last_flow = Some(flow);
        let data = DataTerm::of_pair(&self.rays, last, image, twist, dt_s)?;
        let smooth = self.sobolev.solve(&data, self.smooth.as_ref())?.inv_range;
        self.by_sobolev.step(&smooth, twist, dt_s)?;
        let edged = self.tv.solve(&data, self.edged.as_ref())?.inv_range;
        self.by_tv.step(&edged, twist, dt_s)?;
        let ranges = [
            self.by_flow.range().clone(),
            inverted(&smooth),
            self.by_sobolev.range().clone(),
            inverted(&edged),
            self.by_tv.range().clone(),
        ];
        self.smooth = Some(smooth);
        self.edged = Some(edged);
        Ok(ranges)
    }
}

fn inverted(inverse: &Plane<f32>) -> Plane<f32> {
    /// A range beyond this is as good as none.
    const FARTHEST_M: f32 = 20.0;
    let (width, height) = inverse.size();
    Plane::from_fn(width, height, |x, y| {
        1.0 / inverse[(x, y)].max(1.0 / FARTHEST_M)
    })
}

/// Thesis: section 4.1.1. The mean relative error, percent.
fn error_percent(range: &Plane<f32>, truth: &Plane<f32>) -> f64 {
    let pairs = range.data().iter().zip(truth.data());
    let sum: f64 = pairs.map(|(d, t)| f64::from((d - t).abs() / t)).sum();
    100.0 * sum / truth.data().len() as f64
}

/// A Gaussian over both directions, borders continued.
fn smoothed(image: &Plane<f32>, sigma_px: f32) -> Plane<f32> {
    if sigma_px == 0.0 {
        return image.clone();
    }
    let radius = (3.0 * sigma_px).ceil() as i64;
    let kernel: Vec<f32> = (-radius..=radius)
        .map(|i| (-0.5 * (i as f32 / sigma_px).powi(2)).exp())
        .collect();
    let sum: f32 = kernel.iter().sum();
    let (width, height) = image.size();
    let at = |i: usize, k: usize, size: usize| {
        (i as i64 + k as i64 - radius).clamp(0, size as i64 - 1) as usize
    };
    let pass = |image: &Plane<f32>, across: bool| {
        Plane::from_fn(width, height, |x, y| {
            let terms = kernel.iter().enumerate().map(|(k, weight)| {
                let place = if across {
                    (at(x, k, width), y)
                } else {
                    (x, at(y, k, height))
                };
                weight * image[place]
            });
            terms.sum::<f32>() / sum
        })
    };
    pass(&pass(image, true), false)
}
