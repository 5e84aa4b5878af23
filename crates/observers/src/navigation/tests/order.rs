//! Samples out of order give the same state; too late ones are refused.

use super::*;

/// A run whose poses and velocities arrive `late` steps after their stamps.
fn run(late: usize) -> (NavigationState, Vec<Status>) {
    let (mut tour, mut filter) = (Tour::new(3), filter());
    let (mut waiting, mut statuses) = (std::collections::VecDeque::new(), Vec::new());
    for step in 0..2000 {
        filter.push_imu(&tour.imu(step));
        if step % 7 == 0 {
            waiting.push_back((step, tour.pose(step), tour.velocity(step)));
        }
        while waiting.front().is_some_and(|(due, ..)| due + late <= step) {
            let (due, pose, velocity) = waiting.pop_front().unwrap();
            statuses.push(filter.push_pose(Tour::stamp(due), &pose, &pose_covariance()));
            filter.push_velocity(Tour::stamp(due), &velocity, &speed_covariance());
        }
    }
    // All that is waiting still comes, late but within the delay.
    for (due, pose, velocity) in waiting {
        filter.push_pose(Tour::stamp(due), &pose, &pose_covariance());
        filter.push_velocity(Tour::stamp(due), &velocity, &speed_covariance());
    }
    (filter.state(Tour::stamp(1999)).unwrap(), statuses)
}

#[test]
fn samples_late_within_the_delay_give_the_same_state() {
    let (prompt, _) = run(0);
    let (late, statuses) = run(40); // 0.2 s
    let apart = (prompt.nominal.world_from_body.translation
        - late.nominal.world_from_body.translation)
        .norm();
    // Readings held to a pose's stamp and readings redone differ by the rounding of one step.
    assert!(apart < 1e-9, "{apart} m");
    assert!(statuses.iter().all(Status::is_used));
}

#[test]
fn samples_later_than_the_delay_are_refused_with_the_reason() {
    let (state, statuses) = run(150); // 0.75 s
    assert!(
        matches!(statuses[20], Status::Skipped(Reason::TooLate { .. })),
        "{}",
        statuses[20]
    );
    assert!(state.nominal.velocity_m_s.iter().all(|v| v.is_finite()));
}

#[test]
fn inertial_readings_out_of_order_are_put_in_place() {
    let mut tour = Tour::new(4);
    let samples: Vec<ImuSample> = (0..400).map(|i| tour.imu(i)).collect();
    let (mut even, mut swapped) = (filter(), filter());
    for sample in &samples {
        even.push_imu(sample);
    }
    for i in 0..200 {
        let [first, second] = if i % 5 == 2 {
            [2 * i + 1, 2 * i]
        } else {
            [2 * i, 2 * i + 1]
        };
        swapped.push_imu(&samples[first]);
        swapped.push_imu(&samples[second]);
    }
    let at = |f: &NavigationFilter| f.state(Tour::stamp(399)).unwrap().nominal.world_from_body;
    let (distance, angle) = at(&even).distance_and_angle(&at(&swapped));
    assert!(distance < 1e-12 && angle < 1e-7, "{distance} {angle}");
}
