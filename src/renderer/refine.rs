//! Progressive refinement: light bounces until it has settled, then passes over the light are averaged, then passes
//! over the image. [`Renderer::render`] makes all of them, and a window can show intermediate results.

use super::{FrameReport, Renderer};
use crate::Result;
use crate::gi::CoarseLight;
use crate::layers::PassMean;
use crate::scene::{Pose, View};
use crate::vk;

impl Renderer {
    /// Renders one frame and waits for it. If a buffer is too small, it grows and the frame is repeated. With `bounces
    /// = all` the first frame repeats until the light of two passes differs by less than [`super::SETTLED`], at most
    /// [`MOST_SETTLING`](crate::frame::MOST_SETTLING) times, and then for as many passes as the method averages.
    ///
    /// # Errors
    /// A buffer cannot grow as far as the scene needs, the device is lost, or the watching function returns an error.
    pub fn render(&mut self, pose: &Pose, view: &View) -> Result<FrameReport> {
        let (mut settling, mut repeats, before) = (0, 0, vk::process_cpu_ms());
        while let Some(pass) = self.light_pass(pose, view)? {
            repeats += pass.repeats;
            settling += 1;
        }
        let mut report = self.render_now(pose, view)?;
        for _ in 1..self.settings.image.passes {
            report = report.then(self.refine(pose, view)?);
        }
        let cpu_ms = vk::process_cpu_ms().zip(before).map(|(after, before)| after - before);
        Ok(FrameReport { repeats: repeats + report.repeats, settling, cpu_ms, ..report })
    }

    /// Makes one of the passes over the light that precede the image of [`Self::render`]; returns `None` if
    /// [`Self::light_is_whole`].
    ///
    /// # Errors
    /// As for [`Self::render`].
    pub fn light_pass(&mut self, pose: &Pose, view: &View) -> Result<Option<FrameReport>> {
        if self.light_is_whole() { Ok(None) } else { self.draw(pose, view, None).map(Some) }
    }

    /// Whether the light has had all of the passes that [`Self::render`] makes; with `bounces = all` there are several.
    pub fn light_is_whole(&self) -> bool {
        !self.frame.light.is_awaited()
    }

    /// Renders an image of one pass with the light in its current state. If the light is not whole, this adds one pass
    /// to it.
    ///
    /// # Errors
    /// As for [`Self::render`].
    pub fn render_now(&mut self, pose: &Pose, view: &View) -> Result<FrameReport> {
        self.mean = None;
        self.draw(pose, view, Some(0))
    }

    /// Adds one more pass to the last image; reads then return the mean of all passes. This is the result of
    /// [`Self::render`] with `image.passes` of that number. The report has the times of this pass and the noise of the
    /// mean.
    ///
    /// # Errors
    /// As for [`Self::render`]; after an error the mean is as before.
    pub fn refine(&mut self, pose: &Pose, view: &View) -> Result<FrameReport> {
        let first = || {
            let mut mean = PassMean::default();
            mean.add(&self.readback.read(&self.options.aovs));
            mean
        };
        let mut mean = self.mean.take().unwrap_or_else(first);
        let drawn = self.draw(pose, view, Some(mean.passes()));
        if drawn.is_ok() {
            mean.add(&self.readback.read(&self.options.aovs));
        }
        let noise = mean.noise();
        self.mean = Some(mean);
        Ok(FrameReport { noise, ..drawn? })
    }

    /// The number of passes in the mean that reads return.
    pub fn passes(&self) -> u32 {
        self.mean.as_ref().map_or(1, PassMean::passes)
    }

    /// Measures the light after a pass over it, as long as the renderer waits for it to settle.
    pub(super) fn light_made(&mut self) -> Result<()> {
        if self.frame.light.is_measured() {
            let light = self.coarse_light()?;
            self.frame.light.measured(light);
        }
        Ok(())
    }

    /// Numbers that coarsely represent the light that the method stores.
    fn coarse_light(&self) -> Result<Vec<f64>> {
        let number = |bits: u16| half::f16::from_bits(bits).to_f64();
        Ok(match self.frame.method.coarse_light() {
            Some(CoarseLight::Image(image, level)) => {
                let texels: Vec<[u16; 4]> = vk::download_image(&self.context, image, level)?;
                texels.iter().flat_map(|t| t[..3].to_vec()).map(number).collect()
            }
            Some(CoarseLight::Sums(sums)) => {
                let sums: Vec<u64> = vk::download(&self.context, sums)?;
                sums.into_iter().map(|sum| sum as f64).collect()
            }
            Some(CoarseLight::Full(image)) => {
                let texels: Vec<[f32; 4]> = vk::download_image(&self.context, image, 0)?;
                texels.iter().flat_map(|t| t[..3].to_vec()).map(f64::from).collect()
            }
            None => vec![],
        })
    }
}
