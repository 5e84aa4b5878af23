//! Velocity and trajectory of a camera from its depth images: the geometric flow of Chapter 6.
