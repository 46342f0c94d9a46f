//! The progress of a frame's light: one state machine for the frame, the renderer, the host and the window. Callers
//! report changes, passes and measurements, and it decides what the next pass does. A table in `ARCHITECTURE.md` lists
//! its states.

/// With `bounces = all`: the number of passes after which light counts as settled. A closed room that loses no light
/// never settles.
pub const MOST_SETTLING: u32 = 64;

/// With `bounces = all`: the largest share of all light by which two successive passes of settled light differ.
pub const SETTLED: f64 = 1e-3;

/// The state of the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightState {
    /// The method stores no light: the next pass starts without light of earlier passes.
    Unlit,
    /// The next pass lights what changed, or feedback still adds bounces. `passes` counts passes since the last change.
    Settling { passes: u32 },
    /// Feedback has settled: each further pass enters a mean, which has `passes` so far.
    Averaging { passes: u32 },
    /// Further passes change nothing until the scene changes.
    Whole,
}

/// The rules for transitions between states.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightRules {
    /// Whether each pass continues from the light of the previous one: `bounces = all` with a method that supports
    /// feedback.
    pub feeds: bool,
    /// The number of passes in the mean, after which the light stays; `None` if every pass after settling enters the
    /// mean.
    pub mean_passes: Option<u32>,
    /// Whether the caller makes passes until the first light is whole, and measures it after each. A renderer does, a
    /// host does not.
    pub waits: bool,
}

/// The state, and whether the first light is still awaited.
#[derive(Clone, Debug, PartialEq)]
pub struct LightProgress {
    rules: LightRules,
    state: LightState,
    /// Whether the first light is still awaited.
    awaited: bool,
    /// Passes made during this wait.
    awaited_passes: u32,
    /// Passes made since the light was forgotten.
    passes: u32,
    /// The number of measurements since the light was first made, and the last one.
    measurements: u32,
    last: Vec<f64>,
}

impl LightProgress {
    pub fn new(rules: LightRules) -> Self {
        let awaited = rules.feeds && rules.waits;
        let state = LightState::Unlit;
        Self { rules, state, awaited, awaited_passes: 0, passes: 0, measurements: 0, last: Vec::new() }
    }

    pub fn state(&self) -> LightState {
        self.state
    }

    /// The light is lost or must not be continued: the next pass starts without it.
    pub fn forget(&mut self) {
        *self = Self::new(self.rules);
    }

    /// Something changed that affects the light. Awaited light is still awaited. Light that was whole is updated by one
    /// pass per frame.
    pub fn changed(&mut self) {
        if self.state != LightState::Unlit {
            self.state = LightState::Settling { passes: 0 };
        }
    }

    /// Whether the next frame makes a pass over the light.
    pub fn needs_pass(&self) -> bool {
        self.state != LightState::Whole
    }

    /// Whether the next pass continues from the light of the previous one.
    pub fn has_history(&self) -> bool {
        self.rules.feeds && self.state != LightState::Unlit
    }

    /// The number of the next pass in the mean, starting with 1; 0 before feedback has settled. Until then the random
    /// directions stay the same, because a mean over growing light would be too dark.
    pub fn mean_pass(&self) -> u32 {
        if let LightState::Averaging { passes } = self.state { passes + 1 } else { 0 }
    }

    /// Passes made since the light was forgotten: random directions of a method that leaves a share of the light before
    /// follow it.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    /// A pass over the light was recorded.
    pub fn passed(&mut self) {
        self.passes = self.passes.wrapping_add(1);
        self.awaited_passes += u32::from(self.awaited);
        self.state = match self.state {
            _ if !self.rules.feeds => LightState::Whole,
            LightState::Unlit => LightState::Settling { passes: 1 },
            LightState::Settling { passes } if passes < MOST_SETTLING => LightState::Settling { passes: passes + 1 },
            LightState::Settling { .. } => LightState::Averaging { passes: 0 },
            LightState::Averaging { passes } => LightState::Averaging { passes: passes.saturating_add(1) },
            LightState::Whole => LightState::Whole,
        };
        self.end();
    }

    /// Whether [`Self::measured`] is expected after the next pass, or after the one that was just made.
    pub fn is_measured(&self) -> bool {
        self.awaited && matches!(self.state, LightState::Unlit | LightState::Settling { .. })
    }

    /// Reports a coarse measurement of all light after the last pass. The light has settled if it differs little from
    /// that of the previous pass, or after [`MOST_SETTLING`] passes.
    pub fn measured(&mut self, light: Vec<f64>) {
        self.measurements += 1;
        let before = std::mem::replace(&mut self.last, light);
        if self.measurements == 1 {
            return;
        }
        let change: f64 = self.last.iter().zip(&before).map(|(a, b)| (a - b).abs()).sum();
        let is_settled = change <= SETTLED * self.last.iter().sum::<f64>() || self.measurements >= MOST_SETTLING;
        if is_settled && let LightState::Settling { .. } = self.state {
            self.state = LightState::Averaging { passes: 0 };
            self.end();
        }
    }

    /// Ends the mean once it has all of its passes, and the wait once no pass is missing.
    fn end(&mut self) {
        if let (LightState::Averaging { passes }, Some(all)) = (self.state, self.rules.mean_passes)
            && passes >= all
        {
            self.state = LightState::Whole;
        }
        let goes_on_forever = matches!(self.state, LightState::Averaging { .. }) && self.rules.mean_passes.is_none();
        if goes_on_forever || self.state == LightState::Whole {
            self.awaited = false;
        }
    }

    /// Whether passes are missing before an image shows the light that the settings request.
    pub fn is_awaited(&self) -> bool {
        self.awaited
    }

    /// Passes made while the light was awaited.
    pub fn awaited_passes(&self) -> u32 {
        self.awaited_passes
    }
}

#[cfg(test)]
mod tests {
    use super::LightState::{Averaging, Settling, Unlit, Whole};
    use super::*;

    fn progress(feeds: bool, mean_passes: Option<u32>, waits: bool) -> LightProgress {
        LightProgress::new(LightRules { feeds, mean_passes, waits })
    }

    /// Makes a pass, and measures the light of two cells if a measurement is expected.
    fn pass(progress: &mut LightProgress, light: f64) {
        progress.passed();
        if progress.is_measured() {
            progress.measured(vec![1.0, light]);
        }
    }

    #[test]
    fn light_without_feedback_is_whole_after_one_pass() {
        let mut light = progress(false, Some(8), true);
        assert!(light.needs_pass() && !light.is_awaited() && !light.is_measured());
        light.passed();
        assert_eq!((light.state(), light.has_history(), light.awaited_passes()), (Whole, false, 0));
        light.changed();
        assert_eq!((light.state(), light.needs_pass()), (Settling { passes: 0 }, true));
        light.passed();
        assert_eq!((light.state(), light.needs_pass()), (Whole, false));
    }

    #[test]
    fn a_host_averages_after_the_most_passes() {
        let mut light = progress(true, Some(3), false);
        let mut numbers = Vec::new();
        while light.needs_pass() {
            assert!(!light.is_awaited() && !light.is_measured());
            numbers.push((light.has_history(), light.mean_pass()));
            light.passed();
        }
        // One pass without earlier light, then passes that settle, then passes of the mean.
        let settling = std::iter::repeat_n((true, 0), MOST_SETTLING as usize);
        assert_eq!(
            numbers,
            [(false, 0)].into_iter().chain(settling).chain([1, 2, 3].map(|n| (true, n))).collect::<Vec<_>>()
        );
        assert_eq!(light.state(), Whole);
    }

    #[test]
    fn measured_light_settles_when_it_changes_little() {
        let mut progress = progress(true, Some(2), true);
        let a_little_more = 3.2 + 4.3 * SETTLED;
        for (light, state) in [
            (2.0, Settling { passes: 1 }),
            (3.0, Settling { passes: 2 }),
            (3.2, Settling { passes: 3 }),
            (a_little_more, Settling { passes: 4 }),
            (3.2, Settling { passes: 5 }),
            (3.2, Averaging { passes: 0 }),
            (3.2, Averaging { passes: 1 }),
            (3.2, Whole),
        ] {
            assert!(progress.is_awaited() && progress.needs_pass());
            pass(&mut progress, light);
            assert_eq!(progress.state(), state, "{light}");
            assert_eq!(progress.is_measured(), matches!(state, Settling { .. }), "{light}");
        }
        assert_eq!((progress.is_awaited(), progress.needs_pass(), progress.awaited_passes()), (false, false, 8));
    }

    #[test]
    fn light_that_never_settles_is_waited_for_so_long() {
        let mut light = progress(true, Some(0), true);
        (0..MOST_SETTLING).for_each(|n| pass(&mut light, f64::from(n).exp2()));
        assert_eq!((light.state(), light.is_awaited(), light.awaited_passes()), (Whole, false, MOST_SETTLING));
    }

    #[test]
    fn without_a_number_of_passes_the_mean_goes_on_and_nobody_waits() {
        let mut light = progress(true, None, true);
        (0..2).for_each(|_| pass(&mut light, 1.0));
        assert_eq!((light.state(), light.is_awaited(), light.needs_pass()), (Averaging { passes: 0 }, false, true));
        light.passed();
        assert_eq!((light.state(), light.mean_pass(), light.awaited_passes()), (Averaging { passes: 1 }, 2, 2));
    }

    #[test]
    fn whole_light_is_brought_along_and_forgotten_light_is_waited_for() {
        let mut light = progress(true, Some(1), true);
        (0..3).for_each(|_| pass(&mut light, 1.0));
        assert_eq!((light.state(), light.awaited_passes()), (Whole, 3));
        light.changed();
        assert_eq!((light.state(), light.has_history(), light.is_awaited()), (Settling { passes: 0 }, true, false));
        light.passed();
        assert_eq!((light.state(), light.awaited_passes()), (Settling { passes: 1 }, 3));
        light.forget();
        assert_eq!((light.state(), light.has_history(), light.is_awaited()), (Unlit, false, true));
        light.changed();
        assert_eq!(light.state(), Unlit, "there is nothing to go on from");
        pass(&mut light, 5.0);
        assert_eq!((light.state(), light.awaited_passes()), (Settling { passes: 1 }, 1), "nothing to compare with");
    }

    #[test]
    fn a_change_while_light_is_waited_for_settles_again() {
        let mut light = progress(true, Some(9), true);
        (0..3).for_each(|_| pass(&mut light, 1.0));
        assert_eq!(light.state(), Averaging { passes: 1 });
        light.changed();
        assert!(light.is_awaited() && light.is_measured());
        pass(&mut light, 2.0);
        assert_eq!(light.state(), Settling { passes: 1 });
        pass(&mut light, 2.0);
        assert_eq!((light.state(), light.is_awaited()), (Averaging { passes: 0 }, true));
    }
}
