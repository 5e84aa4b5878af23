//! Frames aligned to stored keyframes: in any order, from any guess, from coarse images alone.
#![allow(clippy::unwrap_used)] // a test may panic: it has nobody to report an error to

mod scene;

use nalgebra::Matrix6;
use scene::{Scene, pinhole, somewhere};
use sphereflow_alignment::{
    Aligner, BrightnessPyramid, Config, DepthImage, FramePyramid, MotionPrior, Priors,
};
use sphereflow_core::{Plane, Pose, Reason, TrackStatus};
use sphereflow_sphere::lie::se3;
use sphereflow_sphere::{Camera, RollingShutter};

/// Exact depth of a room: what the creases leave, metres and radians.
const EXACT: f64 = 1e-3;
/// The same without the finest level: blocks twice as wide see the creases move.
const COARSE: f64 = 4e-3;

/// Poses `[rotation, translation]` of the frames in the keyframe's frame: 1 to 8 cm, 1 to 4 degrees.
const MOTIONS: [[f64; 6]; 3] = [
    [0.01, -0.02, 0.01, 0.01, 0.0, -0.01],
    [-0.03, 0.05, 0.02, 0.04, -0.03, 0.05],
    [0.05, 0.04, -0.03, -0.06, 0.03, 0.04],
];

fn pyramid(aligner: &Aligner, camera: &Camera, pose: &Pose) -> FramePyramid {
    let depth = Scene::room().depths(camera, pose);
    let mut out = FramePyramid::default();
    let image = DepthImage::from(&depth);
    aligner.average(&image, "depth", &mut out).unwrap();
    out
}

fn aligner() -> Aligner {
    Aligner::new(&pinhole(), Config::default()).unwrap()
}

fn lost_without_pixels(status: &TrackStatus) -> bool {
    matches!(status, TrackStatus::Lost(Reason::FewKnownPixels { share }) if *share == 0.0)
}

#[test]
fn frames_align_to_any_keyframe_from_any_guess_with_an_honest_covariance() {
    let (camera, mut aligner) = (pinhole(), aligner());
    let keyframe = pyramid(&aligner, &camera, &somewhere());
    for motion in MOTIONS.map(|m| se3::exp(&m.into())) {
        let frame = pyramid(&aligner, &camera, &(somewhere() * motion));
        for guess in [Pose::identity(), motion] {
            let found = aligner.align(&keyframe, &frame, guess, &Priors::default());
            let (d, a) = found.motion.distance_and_angle(&motion);
            assert_eq!(found.status, TrackStatus::Tracked, "{d} {a}");
            assert!(d < EXACT && a < EXACT, "{d} {a}");
            let off = se3::log(&(motion * found.motion.inverse()));
            let deviations = off.dot(&(found.information() * off)).sqrt();
            assert!(deviations < 3.0, "{deviations} standard deviations");
        }
    }
}

#[test]
fn coarse_frames_of_a_quarter_of_the_memory_align_too() {
    let (camera, mut aligner) = (pinhole(), aligner());
    let keyframe = pyramid(&aligner, &camera, &somewhere()).coarse();
    let motion = se3::exp(&MOTIONS[1].into());
    let frame = pyramid(&aligner, &camera, &(somewhere() * motion));
    for frame in [&frame, &frame.coarse()] {
        let found = aligner.align(&keyframe, frame, Pose::identity(), &Priors::default());
        let (d, a) = found.motion.distance_and_angle(&motion);
        assert!(found.status.has_pose(), "{}", found.status);
        assert!(d < COARSE && a < COARSE, "{d} {a}");
    }
}

#[test]
fn alignment_depends_on_its_arguments_alone() {
    let (camera, mut aligner) = (pinhole(), aligner());
    let keyframe = pyramid(&aligner, &camera, &somewhere());
    let frames = MOTIONS.map(|m| {
        let pose = somewhere() * se3::exp(&m.into());
        pyramid(&aligner, &camera, &pose)
    });
    let mut align = |frame: &FramePyramid| {
        aligner
            .align(&keyframe, frame, Pose::identity(), &Priors::default())
            .motion
    };
    let before = frames.each_ref().map(&mut align);
    let mut again = frames.each_ref();
    again.reverse();
    let mut after = again.map(&mut align);
    after.reverse();
    assert_eq!(before, after, "bit for bit");
}

#[test]
fn frames_of_other_cameras_and_empty_ones_are_lost_with_nothing_known() {
    let (camera, mut aligner) = (pinhole(), aligner());
    let keyframe = pyramid(&aligner, &camera, &somewhere());
    let small = Camera::pinhole(130.0, 130.0, 79.5, 59.5, 160, 120).unwrap();
    let other = Aligner::new(&small, Config::default()).unwrap();
    let foreign = pyramid(&other, &small, &somewhere());
    let guess = se3::exp(&MOTIONS[0].into());
    for stranger in [&foreign, &FramePyramid::default()] {
        for (a, b) in [(&keyframe, stranger), (stranger, &keyframe)] {
            let found = aligner.align(a, b, guess, &Priors::default());
            assert!(lost_without_pixels(&found.status), "{}", found.status);
            assert_eq!((found.motion, found.covariance), (guess, None));
            assert_eq!(found.information(), Matrix6::zeros());
        }
        assert_eq!(aligner.overlap_and_flow(stranger, &guess).0, 0.0);
        let mut undone = keyframe.clone();
        aligner.undo_rolling_shutter(stranger, RollingShutter::default(), &mut undone);
        assert_eq!(undone.known_share(), 0.0);
    }
    let brightness = BrightnessPyramid::default();
    let priors = Priors {
        brightness: Some((&brightness, &brightness)),
        ..Priors::default()
    };
    let found = aligner.align(&keyframe, &keyframe, guess, &priors);
    assert!(lost_without_pixels(&found.status), "{}", found.status);
}

#[test]
fn impossible_guess_is_lost_and_leaves_no_trace() {
    let (camera, mut aligner) = (pinhole(), aligner());
    let keyframe = pyramid(&aligner, &camera, &somewhere());
    let mut guess = Pose::identity();
    guess.translation.x = f64::NAN;
    let found = aligner.align(&keyframe, &keyframe, guess, &Priors::default());
    assert!(!found.status.has_pose(), "{}", found.status);
    let found = aligner.align(&keyframe, &keyframe, Pose::identity(), &Priors::default());
    assert_eq!(found.status, TrackStatus::Tracked);
}

#[test]
fn motion_prior_decides_what_a_wall_hides() {
    let (camera, mut aligner) = (pinhole(), aligner());
    let wall = Plane::filled(camera.width(), camera.height(), 2.0);
    let wall = sphereflow_core::DepthMap::new(wall);
    let mut image = FramePyramid::default();
    let depth = DepthImage::from(&wall);
    aligner.average(&depth, "depth", &mut image).unwrap();
    // sideways along the wall: 5 cm, known to 1 mm
    let known = se3::exp(&[0.0, 0.0, 0.0, 0.05, 0.0, 0.0].into());
    let priors = Priors {
        motion: Some(MotionPrior {
            keyframe_from_frame: known,
            information: Matrix6::identity() * 1e6,
        }),
        ..Priors::default()
    };
    let found = aligner.align(&image, &image, known, &priors);
    let (d, a) = found.motion.distance_and_angle(&known);
    assert!(d < EXACT && a < EXACT, "{d} {a}");
    assert_eq!(
        aligner
            .align(&image, &image, known, &Priors::default())
            .rank,
        3,
        "a wall alone determines three directions"
    );
}

#[test]
fn brightness_of_wrong_size_is_an_error_that_names_it() {
    let aligner = aligner();
    let mut out = BrightnessPyramid::default();
    let image = Plane::filled(8, 8, 1.0);
    let error = aligner.average_brightness(&image, "image0", &mut out);
    assert!(error.unwrap_err().to_string().starts_with("image0"));
}
