//! A whole simulation: its frames, its truth, its errors, and the recording it writes.
#![allow(clippy::unwrap_used)] // helpers of tests fail as tests do

use sphereflow_core::Stamp;
use sphereflow_sim::noise::KinectParameters;
use sphereflow_sim::sensors::{ImuParameters, MagneticFieldParameters, MagnetometerParameters};
use sphereflow_sim::{DepthNoiseParameters, MagConfig, Motion, Scene, SimConfig, Simulator};
use sphereflow_sphere::Camera;

/// The demonstration on a small camera for a third of a second, with every fault.
fn small_demo(seed: u64) -> SimConfig {
    SimConfig {
        camera: Camera::pinhole(131.25, 131.25, 79.5, 59.5, 160, 120).unwrap(),
        duration_s: 0.34,
        readout_s: 0.02,
        start: Stamp::from_ns(1_700_000_000_000_000_000),
        mag: Some(MagConfig {
            field: MagneticFieldParameters::default(),
            sensor: MagnetometerParameters::default(),
            rate_hz: 50.0,
        }),
        ..SimConfig::demo(seed).unwrap()
    }
}

#[test]
fn simulator_of_one_seed_is_bit_identical_with_one_and_two_threads() {
    let simulator = Simulator::new(small_demo(7)).unwrap();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| simulator.frames().map(|f| f.unwrap()).collect::<Vec<_>>())
    };
    let (one, two) = (with(1), with(2));
    assert_eq!(one.len(), 10);
    for (a, b) in one.iter().zip(&two) {
        // NaN is not equal to itself: compare bits.
        let bits = |f: &sphereflow_sim::SimulatedFrame| -> Vec<u32> {
            let depth = f.frame.depth.as_ref().unwrap().metres();
            depth.data().iter().map(|d| d.to_bits()).collect()
        };
        assert_eq!(bits(a), bits(b));
        assert_eq!(a.frame.colour, b.frame.colour);
        assert_eq!((&a.frame.imu, &a.frame.mag), (&b.frame.imu, &b.frame.mag));
    }
    let other = Simulator::new(small_demo(8)).unwrap();
    let other = other.frames().next().unwrap().unwrap();
    assert_ne!(other.frame.colour, one[0].frame.colour);
}

#[test]
fn simulator_frames_carry_every_inertial_sample_once_and_in_order() {
    let simulator = Simulator::new(small_demo(1)).unwrap();
    let mut last = None;
    let (mut imu, mut mag) = (0, 0);
    for (index, simulated) in simulator.frames().enumerate() {
        let simulated = simulated.unwrap();
        assert_eq!(simulated.frame.stamp, simulator.stamp(index));
        for sample in &simulated.frame.imu {
            assert!(Some(sample.stamp) > last && sample.stamp <= simulated.frame.stamp);
            last = Some(sample.stamp);
        }
        imu += simulated.frame.imu.len();
        mag += simulated.frame.mag.len();
    }
    // 9/30 s after the first: 60 intervals of 5 ms and 15 of 20 ms.
    assert_eq!((imu, mag), (61, 16));
}

#[test]
fn simulator_without_faults_gives_the_exact_images_and_readings() {
    let camera = Camera::pinhole(131.25, 131.25, 79.5, 59.5, 160, 120).unwrap();
    let config = SimConfig {
        duration_s: 0.1,
        imu: Some(ImuParameters::default()),
        ..SimConfig::perfect(Scene::furnished_room(1), camera, Motion::hand_held(1))
    };
    let simulator = Simulator::new(config).unwrap();
    assert_eq!(simulator.len(), 3);
    let truth = simulator.truth().unwrap();
    for (index, simulated) in simulator.frames().enumerate() {
        let simulated = simulated.unwrap();
        assert_eq!(simulated.frame.depth.as_ref(), Some(&simulated.exact.depth));
        assert_eq!(
            simulated.frame.colour.as_ref(),
            Some(&simulated.exact.colour)
        );
        assert_eq!(truth.poses()[index], simulated.state.world_from_camera);
        let sample = simulated
            .frame
            .imu
            .iter()
            .find(|s| s.stamp == simulated.frame.stamp);
        if let Some(sample) = sample {
            assert_eq!(sample.gyro_rad_s, simulated.state.twist.angular_rad_s);
        }
    }
}

#[test]
fn simulator_with_rolling_shutter_shears_what_a_global_shutter_does_not() {
    let global = Simulator::new(SimConfig {
        readout_s: 0.0,
        ..small_demo(1)
    })
    .unwrap();
    let rolling = Simulator::new(small_demo(1)).unwrap();
    let stamp = rolling.stamp(3);
    let (a, b) = (global.exact(stamp), rolling.exact(stamp));
    // The two rows in the middle are exposed half a row's time before and after the stamp, the first
    // row almost half a read-out before.
    let differ = |y: usize| {
        let rows = a.range.metres().row(y).iter().zip(b.range.metres().row(y));
        let mut off: Vec<f32> = rows.map(|(a, b)| (a - b).abs()).collect();
        off.sort_by(f32::total_cmp);
        off[off.len() / 2]
    };
    assert!(differ(59) < 1e-3 && differ(60) < 1e-3);
    assert!(
        differ(0) > 20.0 * differ(60),
        "{} {}",
        differ(0),
        differ(60)
    );
}

#[test]
fn simulator_with_impossible_setting_is_an_error_that_names_it() {
    let fails = |change: &dyn Fn(&mut SimConfig), name: &str| {
        let mut config = small_demo(1);
        change(&mut config);
        let text = Simulator::new(config).unwrap_err().to_string();
        assert!(text.contains(name), "{name}: {text}");
    };
    fails(&|c| c.duration_s = 0.0, "duration_s");
    fails(&|c| c.duration_s = 0.01, "duration_s");
    fails(&|c| c.duration_s = 1e12, "duration_s");
    fails(&|c| c.rate_hz = f64::NAN, "rate_hz");
    fails(&|c| c.readout_s = f64::NAN, "readout_s");
    fails(&|c| c.readout_s = 1.0, "readout_s");
    fails(&|c| c.motion.yaw_rad.offset = f64::NAN, "motion");
    fails(&|c| c.motion.position_m[1].offset = 2.0, "free space");
    // On the table's leg, or any other solid: looking out of it would be a lie.
    fails(
        &|c| c.motion = Motion::still().shifted([0.0, 1.0, 0.0]),
        "free space",
    );
    fails(&|c| c.image_noise.sigma_grey = -1.0, "sigma_grey");
    fails(
        &|c| {
            c.depth_noise = DepthNoiseParameters::Independent {
                sigma_inv_m: -1.0,
                quantum_inv_m: 0.0,
            };
        },
        "sigma_inv_m",
    );
    fails(
        &|c| {
            c.depth_noise = DepthNoiseParameters::Kinect(KinectParameters {
                hole_share: 2.0,
                ..KinectParameters::default()
            });
        },
        "hole_share",
    );
    let rate = |c: &mut SimConfig| {
        if let Some(imu) = &mut c.imu {
            imu.rate_hz = 0.0;
        }
    };
    fails(&rate, "rate_hz");
    let mag_rate = |c: &mut SimConfig| {
        if let Some(mag) = &mut c.mag {
            mag.rate_hz = -1.0;
        }
    };
    fails(&mag_rate, "mag.rate_hz");
}

#[test]
fn simulator_camera_of_the_thesis_has_pixels_that_are_not_square() {
    // Thesis: section 4.1.1. 640x480 pixels for 50 x 40 degrees.
    let camera = SimConfig::thesis_camera(640, 480).unwrap();
    let ray = |x, y| {
        let eta = camera.unproject(&nalgebra::Vector2::new(x, y)).unwrap();
        eta / eta.z
    };
    let (corner, next) = (ray(-0.5, -0.5), ray(0.5, 0.5));
    assert!((corner.x.atan().to_degrees() + 25.0).abs() < 1e-9);
    assert!((corner.y.atan().to_degrees() + 20.0).abs() < 1e-9);
    let step = next - corner;
    assert!((step.x - 1.457e-3).abs() < 1e-6 && (step.y - 1.517e-3).abs() < 1e-6);
    assert_eq!(
        Simulator::new(SimConfig::thesis_411().unwrap())
            .unwrap()
            .len(),
        240
    );
}

#[test]
fn simulator_recording_reads_back_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("demo");
    let simulator = Simulator::new(small_demo(3)).unwrap();
    simulator.write(&path).unwrap();
    let recording =
        sphereflow_io::open_recording(&path, &sphereflow_io::OpenOptions::default()).unwrap();
    assert_eq!(recording.len(), simulator.len());
    assert_eq!(recording.camera(), Some(&simulator.config().camera));
    let truth = simulator.truth().unwrap();
    let read_truth = recording.truth().unwrap();
    assert_eq!(read_truth.stamps(), truth.stamps());
    for (a, b) in read_truth.poses().iter().zip(truth.poses()) {
        let (distance, angle) = a.distance_and_angle(b);
        assert!(distance < 1e-6 && angle < 1e-6, "{distance} {angle}");
    }
    for (index, simulated) in simulator.frames().enumerate() {
        let (written, read) = (simulated.unwrap().frame, recording.frame(index).unwrap());
        assert_eq!((read.stamp, &read.colour), (written.stamp, &written.colour));
        assert_eq!(read.imu.len(), written.imu.len());
        let (a, b) = (read.depth.unwrap(), written.depth.unwrap());
        for (a, b) in a.metres().data().iter().zip(b.metres().data()) {
            // Half a count of 1/5000 m, and f32.
            assert!(
                (a - b).abs() < 1.01e-4 || (a.is_nan() && b.is_nan()),
                "{a} {b}"
            );
        }
    }
    assert!(
        simulator.write(&path).is_err(),
        "a recording is never overwritten"
    );
}
