//! The paths that the experiments, the tests and the demo use.

use super::{Curve, Motion, Wave};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

impl Motion {
    /// No motion: at the origin, looking along +z.
    pub fn still() -> Self {
        Self {
            position_m: Default::default(),
            yaw_rad: Curve::default(),
            pitch_rad: Curve::default(),
            roll_rad: Curve::default(),
            duration_s: 10.0,
        }
    }

    /// Thesis: section 4.1.1. "A combination of sinusoids": 0.35, 0.075, 0.15 m at 0.25, 0.5,
    /// 0.25 Hz about the origin and 5, 7, 5 degrees of pitch, yaw, roll at 0.30, 0.23, 0.35 Hz
    /// about a yaw of 25 degrees, where a corner of the thesis's room is in view. The speed is
    /// zero at 1 and 3 s. (The thesis's own numbers are only plotted, in Figures 4.1 and 4.2.)
    pub fn sinusoids_411() -> Self {
        let wave =
            |offset, amplitude, hz, phase| Curve::waves(offset, [Wave::hz(amplitude, hz, phase)]);
        let degree = PI / 180.0;
        Self {
            position_m: [
                wave(0.0, 0.35, 0.25, 0.0),
                wave(0.0, 0.075, 0.5, FRAC_PI_2),
                wave(0.0, 0.15, 0.25, 0.0),
            ],
            pitch_rad: wave(0.0, 5.0 * degree, 0.30, 0.0),
            yaw_rad: wave(25.0 * degree, 7.0 * degree, 0.23, 0.0),
            roll_rad: wave(0.0, 5.0 * degree, 0.35, 0.0),
            duration_s: 4.0,
        }
    }

    /// A camera held in the hand, about the origin: sums of sines of 0.15 to 1.2 Hz with a speed
    /// of 0.28 m/s and a rate of 0.39 rad/s, root mean square over all time.
    pub fn hand_held(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut motion = Self {
            position_m: std::array::from_fn(|_| swaying(&mut rng, [0.15, 1.0])),
            yaw_rad: swaying(&mut rng, [0.15, 1.2]),
            pitch_rad: swaying(&mut rng, [0.2, 1.2]),
            roll_rad: swaying(&mut rng, [0.2, 1.2]),
            duration_s: 20.0,
        };
        motion.scale_to(0.28, 0.39);
        motion
    }

    /// A camera on a trolley, about the origin: slow, in a horizontal plane, turning only about the
    /// vertical; 0.15 m/s and 0.15 rad/s, root mean square.
    pub fn trolley(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut motion = Self {
            position_m: [
                swaying(&mut rng, [0.05, 0.2]),
                Curve::default(),
                swaying(&mut rng, [0.05, 0.2]),
            ],
            yaw_rad: swaying(&mut rng, [0.04, 0.15]),
            duration_s: 30.0,
            ..Self::still()
        };
        motion.scale_to(0.15, 0.15);
        motion
    }

    /// Once around the table of [`crate::Scene::furnished_room`] in 25 s, looking ahead and around, back
    /// to the very pose it started from; the path repeats from there.
    pub fn room_tour(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let duration_s = 25.0;
        // Whole numbers of turns in the duration close the loop.
        let mut harmonic = |amplitude: f64, turns: f64| Wave {
            amplitude: amplitude * rng.random_range(0.8..1.2),
            angular_rate: TAU * turns / duration_s,
            phase: rng.random_range(0.0..TAU),
        };
        let around = TAU / duration_s;
        let circle = |amplitude: f64, phase: f64| Wave {
            amplitude,
            angular_rate: around,
            phase,
        };
        Self {
            position_m: [
                Curve::waves(
                    0.0,
                    [circle(1.55, 0.0), harmonic(0.05, 7.0), harmonic(0.02, 16.0)],
                ),
                Curve::waves(
                    -0.15,
                    [
                        harmonic(0.07, 2.0),
                        harmonic(0.03, 9.0),
                        harmonic(0.015, 21.0),
                    ],
                ),
                Curve::waves(
                    0.0,
                    [
                        circle(1.30, -FRAC_PI_2),
                        harmonic(0.05, 8.0),
                        harmonic(0.02, 17.0),
                    ],
                ),
            ],
            // The path starts at -z towards +x and turns left; the camera looks left of it, over
            // the table to the far walls.
            yaw_rad: Curve {
                offset: FRAC_PI_2 - 0.9,
                rate: -around,
                waves: vec![
                    harmonic(0.30, 3.0),
                    harmonic(0.06, 11.0),
                    harmonic(0.02, 23.0),
                ],
            },
            pitch_rad: Curve::waves(-0.16, [harmonic(0.12, 4.0), harmonic(0.04, 13.0)]),
            roll_rad: Curve::waves(0.0, [harmonic(0.05, 5.0), harmonic(0.02, 14.0)]),
            duration_s,
        }
    }

    /// The same path seen from elsewhere: shifted by metres.
    pub fn shifted(mut self, offset_m: [f64; 3]) -> Self {
        for (curve, offset) in self.position_m.iter_mut().zip(offset_m) {
            curve.offset += offset;
        }
        self
    }

    /// Scale the sines to the speed and the rate (Euler rates, near the body rate for small angles),
    /// root mean square.
    fn scale_to(&mut self, speed_m_s: f64, rate_rad_s: f64) {
        let total = |curves: &[&Curve]| curves.iter().map(|c| c.mean_square_rate()).sum::<f64>();
        let [x, y, z] = &self.position_m;
        let speed = speed_m_s / total(&[x, y, z]).sqrt();
        let rate = rate_rad_s / total(&[&self.yaw_rad, &self.pitch_rad, &self.roll_rad]).sqrt();
        let scale = |curve: &mut Curve, factor: f64| {
            for wave in &mut curve.waves {
                wave.amplitude *= factor;
            }
        };
        for curve in &mut self.position_m {
            scale(curve, speed);
        }
        for curve in [&mut self.yaw_rad, &mut self.pitch_rad, &mut self.roll_rad] {
            scale(curve, rate);
        }
    }
}

/// Three sines of random phase with frequencies spread over `band_hz`, equally fast, starting at 0.
fn swaying(rng: &mut ChaCha8Rng, band_hz: [f64; 2]) -> Curve {
    let step = (band_hz[1] / band_hz[0]).powf(1.0 / 3.0);
    let mut low = band_hz[0];
    let waves: Vec<Wave> = (0..3)
        .map(|_| {
            let hz = low * rng.random_range(1.0..step);
            low *= step;
            Wave::hz(1.0 / hz, hz, rng.random_range(0.0..TAU))
        })
        .collect();
    Curve::waves(0.0, waves)
}
