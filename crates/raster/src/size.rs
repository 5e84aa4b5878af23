//! The check that two planes are of one size.

use sphereflow_core::{Error, Result};

/// Refuses a plane `(width, height)` of another size than expected; the text has them as arrays,
/// (height, width).
///
/// # Errors
/// [`Error::Shape`] naming the argument.
pub fn same_size(argument: &str, expected: (usize, usize), found: (usize, usize)) -> Result<()> {
    if expected == found {
        return Ok(());
    }
    let text = |(width, height): (usize, usize)| format!("({height}, {width})");
    Err(Error::shape(argument, text(expected), text(found)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn same_size_of_two_sizes_is_an_error_that_names_both_as_arrays() {
        assert!(same_size("image", (4, 3), (4, 3)).is_ok());
        let text = same_size("image", (4, 3), (3, 4)).unwrap_err().to_string();
        assert_eq!(text, "image: expected shape (3, 4), found (4, 3)");
    }
}
