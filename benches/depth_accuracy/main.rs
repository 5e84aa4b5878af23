//! What the depth filter is off by, everywhere it is asked: `cargo run --release -p sphereflow-benches
//! --example depth_accuracy -- [beginning of a name]... [--binning N] [--lags N,N,...] [--seconds S]
//! [--seed N] [--constant-light] [--sigma S] [--hand-held SEEDS] [--furniture SEEDS] [--maps FOLDER] [--maps-from S]`.
//!
//! Thesis: section 4.1.1. Every case at 640x480 (or 1024x512 for the whole sphere), 60 Hz, 4 s, the
//! same settings for all. `RAYON_NUM_THREADS=1` for times of one thread. `--hand-held` (a seed,
//! or the first and last of some: `41-64`) lets the camera move otherwise in every case, with
//! noise of the same seed unless
//! one is given, and sums up what several motions gave; `--furniture` (likewise) furnishes the
//! rooms otherwise; `--maps` draws where errors are,
//! and tells what share of them lies how far from the scene's depth edges, from 2 s on or from
//! where `--maps-from` says.

mod cases;
mod figures;
mod maps;

use cases::{Case, Drive, cases};
use figures::{Figures, Judge};
use maps::Maps;
use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use sphereflow_core::{Plane, Pose, Stamp};
use sphereflow_depth::{
    Brightness, DepthFilter, DepthFilterConfig, DepthStep, PoseNoise, VelocityNoise,
};
use sphereflow_sim::{Motion, Renderer};
use std::time::Instant;

const RATE_HZ: f64 = 60.0;

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> Fallible<()> {
    let mut config = DepthFilterConfig::default();
    let mut seconds = 4.0;
    let mut maps_from_s = 2.0;
    let (mut seed, mut folder, mut sigma) = (None, None, None);
    let (mut hands, mut furniture) = (Vec::new(), vec![1, 2, 3]);
    let mut names = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or("a value is missing");
        match argument.as_str() {
            "--binning" => config.binning = value()?.parse()?,
            "--lags" => config.lags = numbers(&value()?)?,
            "--seconds" => seconds = value()?.parse()?,
            "--constant-light" => config.brightness = Brightness::Constant,
            "--seed" => seed = Some(value()?.parse()?),
            "--sigma" => sigma = Some(value()?.parse()?),
            "--hand-held" => hands = seeds("--hand-held", &value()?)?,
            "--furniture" => furniture = seeds("--furniture", &value()?)?,
            "--maps-from" => maps_from_s = value()?.parse()?,
            "--maps" => folder = Some(std::path::PathBuf::from(value()?)),
            _ => names.push(argument),
        }
    }
    let mut all = cases(&furniture)?;
    if let Some(sigma) = sigma {
        for case in &mut all {
            let [was, is] = [case.sigma, sigma].map(|sigma| format!("sigma {sigma}"));
            (case.name, case.sigma) = (case.name.replace(&was, &is), sigma);
        }
    }
    let known = |name: &String| all.iter().any(|case| case.name.starts_with(name.as_str()));
    if let Some(name) = names.iter().find(|name| !known(name)) {
        let known: Vec<&str> = all.iter().map(|case| case.name.as_str()).collect();
        let known = known.join("; ");
        return Err(format!("no case's name begins with {name}; there are: {known}").into());
    }
    println!("{}", Figures::HEADER);
    for mut case in all {
        if !names.is_empty()
            && !names
                .iter()
                .any(|name| case.name.starts_with(name.as_str()))
        {
            continue;
        }
        let motions: Vec<Option<u64>> = match hands.is_empty() {
            true => vec![None],
            false => hands.iter().copied().map(Some).collect(),
        };
        let (name, mut all) = (case.name.clone(), Vec::new());
        for motion in motions {
            if let Some(motion) = motion {
                (case.name, case.motion) = (
                    format!("{name}, motion {motion}"),
                    Motion::hand_held(motion),
                );
            }
            let mut maps = folder
                .as_ref()
                .map(|_| Maps::new(&case.camera, maps_from_s));
            let noise = seed.or(motion).unwrap_or(1);
            let figures = run(&case, &config, (seconds, noise), &mut maps)?;
            println!("{}", figures.row(&case));
            if let (Some(maps), Some(folder)) = (maps, &folder) {
                println!("{}", maps.write(folder, &case.name)?);
            }
            all.push(figures);
        }
        if all.len() > 1 {
            println!("{}", Figures::summary(&all, &name, &case));
        }
    }
    Ok(())
}

/// A seed, or all from one to another: `41-64`.
fn seeds(option: &str, list: &str) -> Fallible<Vec<u64>> {
    let (first, last) = list.split_once('-').unwrap_or((list, list));
    let seeds: Vec<u64> = (first.parse()?..=last.parse()?).collect();
    if seeds.is_empty() {
        return Err(
            format!("{option}: expected the first and last of some seeds, found {list}").into(),
        );
    }
    Ok(seeds)
}

/// Whole numbers with commas between them.
fn numbers(list: &str) -> Fallible<Vec<usize>> {
    list.split(',').map(|number| Ok(number.parse()?)).collect()
}

/// The filter over one sequence.
fn run(
    case: &Case,
    config: &DepthFilterConfig,
    (seconds, seed): (f64, u64),
    maps: &mut Option<Maps>,
) -> Fallible<Figures> {
    let renderer = Renderer::new(&case.scene, &case.camera);
    let mut filter = DepthFilter::new(&case.camera, config.clone())?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut judge = Judge::new(&case.camera);
    let (mut range, mut std) = filter.range();
    let mut errors = PoseErrors::default();
    for index in 0..=(seconds * RATE_HZ).round() as usize {
        let t_s = index as f64 / RATE_HZ;
        let pose = case.pose(t_s);
        let rendered = renderer.render(&pose);
        let mut image = rendered.grey_1_to_256();
        spoil(case, t_s, &mut image, &mut rng);
        let begun = Instant::now();
        match case.drive {
            Drive::Poses => filter.step(&image, &pose, Stamp::from_ns((t_s * 1e9) as i64))?,
            Drive::Velocities(noise) => {
                noisy_step(&mut filter, case, t_s, &image, noise, &mut rng)?
            }
            Drive::NoisyPoses(noise) => {
                errors.advance(noise, &mut rng);
                let stamp = Stamp::from_ns((t_s * 1e9) as i64);
                filter.step_with_noise(&image, &errors.of(&pose), noise, stamp)?
            }
            Drive::Late(late_s) => {
                let stamp = Stamp::from_ns((t_s * 1e9) as i64);
                filter.step_with_noise(&image, &case.pose(t_s - late_s), TOLD, stamp)?
            }
        };
        judge.spent(begun.elapsed());
        if index % 3 == 0 {
            filter.range_into(&mut range, &mut std)?;
            let truth = rendered.range.into_plane();
            judge.judge(t_s, &range, &std, &truth);
            if let Some(maps) = maps {
                maps.add(t_s, &image, &truth, &range, &std)?;
            }
        }
    }
    Ok(judge.figures())
}

/// What the filter is told of poses whose clock is off: the defaults of `sphereflow depth`.
const TOLD: PoseNoise = PoseNoise {
    rotation_rad: 0.002,
    position_m: 0.002,
};

/// Errors of poses that fade within a tenth of a second, as those of trackers do.
#[derive(Default)]
struct PoseErrors {
    rotation: Vector3<f64>,
    place: Vector3<f64>,
    begun: bool,
}

impl PoseErrors {
    fn advance(&mut self, noise: PoseNoise, rng: &mut ChaCha8Rng) {
        /// Within this the errors fade to 1/e.
        const FADES_S: f64 = 0.1;
        let keeps = if self.begun {
            (-1.0 / (RATE_HZ * FADES_S)).exp()
        } else {
            0.0
        };
        let fresh = (1.0 - keeps * keeps).sqrt();
        let mut draw = |was: Vector3<f64>, sigma: f64| {
            was * keeps
                + Vector3::from_fn(|_, _| {
                    let value: f64 = StandardNormal.sample(rng);
                    fresh * sigma * value
                })
        };
        self.rotation = draw(self.rotation, noise.rotation_rad);
        self.place = draw(self.place, noise.position_m);
        self.begun = true;
    }

    fn of(&self, pose: &Pose) -> Pose {
        let mut pose = *pose;
        pose.translation += self.place;
        pose.rotation *= UnitQuaternion::from_scaled_axis(self.rotation);
        pose
    }
}

/// Light, noise and impulses.
fn spoil(case: &Case, t_s: f64, image: &mut Plane<f32>, rng: &mut ChaCha8Rng) {
    let (width, height) = image.size();
    for (y, row) in image.data_mut().chunks_mut(width).enumerate() {
        let gain = (case.light)(t_s, y as f64 / height as f64);
        for value in row {
            let noise: f32 = StandardNormal.sample(rng);
            *value = gain * *value + case.sigma * noise;
            if case.impulses > 0.0 {
                let draw = rand::RngExt::random_range(rng, 0.0..1.0_f32);
                if draw < case.impulses {
                    *value = if draw < 0.5 * case.impulses {
                        1.0
                    } else {
                        256.0
                    };
                }
            }
        }
    }
}

/// A step from velocities with noise, those of the middle between two images.
fn noisy_step(
    filter: &mut DepthFilter,
    case: &Case,
    t_s: f64,
    image: &Plane<f32>,
    noise: VelocityNoise,
    rng: &mut ChaCha8Rng,
) -> Fallible<DepthStep> {
    let mut twist = case.motion.state(t_s - 0.5 / RATE_HZ).twist;
    let mut axes = |sigma: f64| {
        Vector3::from_fn(|_, _| {
            let value: f64 = StandardNormal.sample(rng);
            sigma * value
        })
    };
    twist.linear_m_s += axes(noise.linear_m_s);
    twist.angular_rad_s += axes(noise.angular_rad_s);
    Ok(filter.step_with_velocity(image, &twist, 1.0 / RATE_HZ, noise)?)
}
