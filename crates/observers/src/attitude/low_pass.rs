//! A second-order Butterworth low-pass filter that does not mind a changing time step.
//!
//! The continuous filter `tau^2 y'' + 2 tau y' + 2 (y - u) = 0` is solved exactly over each step
//! with the input held, so that its state means the same whatever the step. During the first `tau`
//! seconds the output is the mean so far.

/// The exact transition over one step.
#[derive(Clone, Copy, Debug)]
pub struct Decay {
    dt_s: f64,
    tau_s: f64,
    own: f64,
    slope: f64,
    slope_own: f64,
    back: f64,
}

impl Decay {
    /// Of a filter with time constant `tau_s` over `dt_s`.
    pub fn new(tau_s: f64, dt_s: f64) -> Self {
        let s = dt_s / tau_s;
        let (sin, cos) = s.sin_cos();
        let decay = (-s).exp();
        Self {
            dt_s,
            tau_s,
            own: decay * (cos + sin),
            slope: decay * sin,
            slope_own: decay * (cos - sin),
            back: -2.0 * decay * sin,
        }
    }
}

/// `N` channels.
#[derive(Clone, Copy, Debug)]
pub struct LowPass<const N: usize> {
    value: [f64; N],
    slope: [f64; N],
    /// Seconds averaged so far, while below the time constant.
    averaged_s: f64,
}

impl<const N: usize> LowPass<N> {
    /// Without a sample.
    pub fn new() -> Self {
        Self {
            value: [0.0; N],
            slope: [0.0; N],
            averaged_s: 0.0,
        }
    }

    /// The next sample; returns the output.
    #[inline]
    pub fn step(&mut self, input: &[f64; N], decay: &Decay) -> [f64; N] {
        if self.averaged_s < decay.tau_s {
            self.averaged_s += decay.dt_s;
            let share = decay.dt_s / self.averaged_s;
            for (value, u) in self.value.iter_mut().zip(input) {
                *value += share * (u - *value);
            }
            return self.value;
        }
        for ((value, slope), u) in self.value.iter_mut().zip(&mut self.slope).zip(input) {
            let e = *value - u;
            *value = u + decay.own * e + decay.slope * *slope;
            *slope = decay.slope_own * *slope + decay.back * e;
        }
        self.value
    }

    /// Another output, and its slope changed: the axes of the channels turned.
    #[inline]
    pub fn replace(&mut self, value: [f64; N], slope: impl Fn([f64; N]) -> [f64; N]) {
        self.value = value;
        self.slope = slope(self.slope);
    }

    /// The last output.
    pub fn value(&self) -> &[f64; N] {
        &self.value
    }

    /// True after the first time constant.
    pub fn is_settled(&self, tau_s: f64) -> bool {
        self.averaged_s >= tau_s
    }
}
