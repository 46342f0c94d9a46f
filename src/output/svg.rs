//! Text, colours and logarithmic axes for SVG pictures.

/// Okabe and Ito's colours, which people with most colour vision deficiencies can distinguish, and a grey. The yellow
/// is darker than the original, for contrast on light and dark pages.
pub const COLORS: &[&str] = &["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b8860b", "#56b4e9", "#7f7f7f"];

/// Colours for white pages only: with the original yellow, a darker one and two greys.
pub const COLORS_ON_WHITE: &[&str] =
    &["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c7a00", "#777777", "#222222"];

/// Text, escaped for an element or a quoted attribute of SVG or HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A logarithmic axis: maps values to positions.
pub struct LogAxis {
    low: f64,
    high: f64,
    start: f64,
    end: f64,
}

impl LogAxis {
    /// Maps positive values to positions from `start` to `end`. Beyond the values there are at least `air` decades at
    /// each end, and the span is at least half a decade.
    pub fn around(values: impl Iterator<Item = f64>, air: f64, start: f64, end: f64) -> Self {
        let positive = values.filter(|v| *v > 0.0);
        let (low, high) = positive.fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
        if low > high {
            return Self { low: 1.0, high: 10.0, start, end };
        }
        let air = 10f64.powf(air.max(0.25 - (high / low).log10() / 2.0));
        Self { low: low / air, high: high * air, start, end }
    }

    pub fn place(&self, value: f64) -> f64 {
        self.start + (self.end - self.start) * (value / self.low).ln() / (self.high / self.low).ln()
    }

    /// These numbers, multiplied by all powers of ten, within the axis.
    pub fn ticks(&self, of_a_decade: &[f64]) -> Vec<f64> {
        let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
        let all = decades.flat_map(|e| of_a_decade.iter().map(move |m| m * 10f64.powi(e)));
        all.filter(|t| (self.low..=self.high).contains(t)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_hold_their_values_and_have_ticks_within() {
        for values in [vec![3.0], vec![1.0, 1.0], vec![0.013, 95.0], vec![250.0, 260.0]] {
            let axis = LogAxis::around(values.iter().copied(), 0.125, 10.0, 110.0);
            assert!(values.iter().all(|v| (10.0..=110.0).contains(&axis.place(*v))), "{values:?}");
            assert!(!axis.ticks(&[1.0, 2.0, 5.0]).is_empty(), "{values:?}");
        }
        let axis = LogAxis::around([1.0, 100.0].into_iter(), 0.0, 0.0, 1.0);
        assert_eq!(axis.ticks(&[1.0, 2.0, 5.0]), [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]);
        assert_eq!(LogAxis::around([0.5, 20.0].into_iter(), 0.0, 0.0, 1.0).ticks(&[1.0]), [1.0, 10.0]);
        assert_eq!([1.0, 10.0, 100.0].map(|v| axis.place(v)), [0.0, 0.5, 1.0]);
    }

    #[test]
    fn text_cannot_end_its_element_or_attribute() {
        assert_eq!(escape("<a> & \"b\""), "&lt;a&gt; &amp; &quot;b&quot;");
    }
}
