//! States and runs of the observers as plain values.

use super::plain_struct;
use sphereflow_observers::attitude::{AttitudeRun, AttitudeState};
use sphereflow_observers::imu_bias::{ImuBiasRun, ImuBiasState};
use sphereflow_observers::navigation::{NavigationState, NominalState};
use sphereflow_observers::velocity_bias::VelocityBiasState;
use sphereflow_solver::bundle::Motion;
use sphereflow_solver::inertial::ImuBias;

plain_struct!(AttitudeState {
    world_from_body,
    gyro_bias_rad_s,
    status,
    at_rest,
    mag_disturbed
});
plain_struct!(AttitudeRun {
    world_from_body,
    gyro_bias_rad_s,
    status,
    at_rest,
    mag_disturbed
});
plain_struct!(ImuBiasState {
    velocity_m_s,
    gravity_m_s2,
    gyro_bias_rad_s,
    accel_bias_m_s2,
    covariance,
    status
});
plain_struct!(ImuBiasRun { states, samples });
plain_struct!(VelocityBiasState {
    angular_rad_s,
    linear_m_s,
    covariance,
    blind_directions,
    field_energy,
    status
});
plain_struct!(NominalState {
    world_from_body,
    velocity_m_s,
    gyro_bias_rad_s,
    accel_bias_m_s2
});
plain_struct!(NavigationState {
    stamp,
    nominal,
    covariance,
    status
});
plain_struct!(ImuBias { gyro, accel });
plain_struct!(Motion { velocity, bias });
