//! Tracks a folder of a data set without Python: `cargo run --release --example run_folder -- FOLDER`.

use sphereflow_engine::{Engine, EngineConfig, Kind, Result};
use sphereflow_io::trajectory::{TrajectoryFormat, write_trajectory};
use sphereflow_io::{OpenOptions, Recording, open_recording};
use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(folder) = std::env::args().nth(1) else {
        eprintln!("usage: run_folder FOLDER");
        return ExitCode::from(2);
    };
    match run(Path::new(&folder)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(folder: &Path) -> std::result::Result<(), Box<dyn Error>> {
    let recording = open_recording(folder, &OpenOptions::default())?;
    let mut engine = engine_of(&recording)?;
    for index in 0..recording.len() {
        match recording.frame(index) {
            Ok(frame) => {
                if let Some(update) = engine.push(frame)? {
                    println!("{} {}", update.stamp, update.status);
                }
            }
            Err(error) => eprintln!("frame {index}: {error}"),
        }
    }
    let graph = engine.finish()?;
    let report = engine.report();
    println!("{graph:?}");
    println!("coverage {:.3}, world {}", report.coverage(), report.world);
    let trajectory = engine.trajectory(Kind::Final)?;
    let out = Path::new("trajectory.tum");
    write_trajectory(out, &trajectory, TrajectoryFormat::Tum)?;
    println!("{} poses in {}", trajectory.len(), out.display());
    Ok(())
}

/// An engine for the recording's device; its frames' depth is corrected when they are read.
fn engine_of(recording: &Recording) -> std::result::Result<Engine, Box<dyn Error>> {
    let device = recording.device()?.ok_or("a recording without images")?;
    let mut calibration = device.calibration()?;
    calibration.depth_field = None;
    let engine: Result<Engine> = Engine::new(calibration, EngineConfig::default());
    Ok(engine?)
}
